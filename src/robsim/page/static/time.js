// The controls of time at the foot of the page, and its keys.

import { find } from "./view.js";

export function showTime(clock, playing) {
  const slider = find("slider");
  slider.max = clock.times.length - 1;
  slider.value = clock.index;
  find("seconds").textContent = `${(clock.times[clock.index] ?? 0).toFixed(2)} s`;
  find("play").textContent = playing ? "❚❚" : "▶";
  find("play").setAttribute("aria-label", playing ? "pause" : "play");
}

export function listenForTime(clock, toggle, scrub) {
  find("play").addEventListener("click", toggle);
  find("slider").addEventListener("input", (event) => scrub(Number(event.target.value) - clock.index));
}

export function offerSpeeds(speeds, changed) {
  const speed = find("speed");
  for (const each of speeds) speed.add(new Option(each ? `${each} x` : "max", each, each === 1, each === 1));
  speed.addEventListener("change", () => changed(Number(speed.value)));
}

// Keys of the page and their actions; keys typed into a field belong to the field.
export function listenForKeys(actions) {
  document.addEventListener("keydown", (event) => {
    if (document.body.classList.contains("map")) return; // the map has its own keys
    if (event.target.closest("select, textarea, input:not(#slider), dialog")) return;
    if (event.key === " " && event.target.closest("summary, button")) return; // the key presses it
    const action = actions(event.shiftKey ? 10 : 1)[event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    action();
    event.preventDefault();
  });
}
