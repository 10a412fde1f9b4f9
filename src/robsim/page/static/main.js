// The page: a recording with time controls, the map of a study, or the messages of a studio.

import { Clock } from "./clock.js";
import { listenForKeys } from "./keys.js";
import { Pendant } from "./pendant.js";
import { Studio } from "./studio.js";
import { StudyMap } from "./study.js";
import { listenForTime, offerSpeeds, showTime } from "./time.js";
import { unpack } from "./unpack.js";
import { View, find } from "./view.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];

async function start() {
  const clock = new Clock([0]);
  const view = new View(clock);
  const options = new URLSearchParams(location.hash.slice(1)); // of a text that frames this page
  document.body.classList.toggle("framed", options.has("framed"));
  theme(options.get("theme"), () => view.repaint());
  const recorded = find("recording").textContent.trim();
  const { header, arrays } = recorded ? await unpack(recorded) : {};
  if (header?.format === "robsim study") return chart(header, arrays);
  if (header) replay(header, arrays, view, clock);
  else if (document.body.dataset.page === "pendant") new Pendant(view, clock);
  else new Studio(view, clock);
  frames(view, clock);
}

function chart(header, arrays) {
  document.body.classList.add("map");
  window.robsim = new StudyMap(header, arrays, null);
  document.body.dataset.ready = "yes";
}

function replay(header, arrays, view, clock) {
  timeControls(clock, view);
  view.load(header, arrays);
  document.body.classList.toggle("still", clock.times.length < 2);
  const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (!still && clock.times.length > 1) clock.toggle();
  window.robsim = { header, arrays, clock, space: view.space, pictures: view.pictures, choice: view.choice, layers: view.layers, charts: view.charts };
  document.body.dataset.ready = "yes";
}

function frames(view, clock) {
  let before = performance.now();
  const frame = (now) => {
    clock.pass(Math.min((now - before) / 1000, 0.25));
    before = now;
    if (!document.body.classList.contains("map")) {
      view.refresh(now);
      view.space.draw(now);
    }
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

function timeControls(clock, view) {
  listenForTime(clock, () => clock.toggle(), (count) => clock.step(count));
  offerSpeeds(SPEEDS, (speed) => (clock.speed = speed));
  clock.listen(() => showTime(clock, clock.playing));
  listenForKeys([
    { keys: [" "], words: "play or pause", act: () => clock.toggle() },
    { keys: ["ArrowRight"], words: "one instant on, with shift ten", act: (leap) => clock.step(leap) },
    { keys: ["ArrowLeft"], words: "one instant back, with shift ten", act: (leap) => clock.step(-leap) },
    { keys: ["Home"], words: "the first instant", act: () => clock.seek(0) },
    { keys: ["End"], words: "the last instant", act: () => clock.seek(clock.end) },
    { keys: ["h"], words: "reset the view of the scene", act: () => view.space.home() },
    { keys: ["p"], words: "marks, picture or difference in the images", act: () => view.choice.turn(view.header.cameras) },
  ]);
}

function theme(given, changed) {
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const apply = (name) => {
    document.documentElement.dataset.theme = name;
    changed();
  };
  find("theme").addEventListener("click", () =>
    apply(document.documentElement.dataset.theme === "dark" ? "light" : "dark"),
  );
  if (!given) dark.addEventListener("change", () => apply(dark.matches ? "dark" : "light"));
  apply(given ?? (dark.matches ? "dark" : "light"));
}

function tellProblem(error) {
  const note = find("problem");
  note.hidden = false;
  note.textContent = `This page cannot be shown: ${error?.message ?? error}`;
  document.body.dataset.ready = "failed";
}

start().catch(tellProblem);
