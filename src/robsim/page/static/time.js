// The controls of time at the foot of the page.

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
