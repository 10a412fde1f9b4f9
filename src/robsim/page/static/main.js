// The page: a recording with the controls of time, the map of a study, or what a studio tells.

import { Clock } from "./clock.js";
import { Studio } from "./studio.js";
import { StudyMap } from "./study.js";
import { listenForKeys, listenForTime, offerSpeeds, showTime } from "./time.js";
import { unpack } from "./unpack.js";
import { View, find } from "./view.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];

async function start() {
  const clock = new Clock([0]);
  const view = new View(clock);
  theme(() => view.repaint());
  const header = JSON.parse(find("header").textContent);
  if (header?.format === "robsim study") return chart(header);
  if (header) await replay(header, view, clock);
  else new Studio(view, clock);
  frames(view, clock);
}

async function chart(header) {
  document.body.classList.add("map");
  window.robsim = new StudyMap(header, await unpack(header.arrays, find("numbers").textContent), null);
  document.body.dataset.ready = "yes";
}

async function replay(header, view, clock) {
  const arrays = await unpack(header.arrays, find("numbers").textContent);
  timeControls(clock, view);
  view.load(header, arrays);
  document.body.classList.toggle("still", clock.times.length < 2);
  const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (!still && clock.times.length > 1) clock.toggle();
  window.robsim = { header, arrays, clock, space: view.space, pictures: view.pictures, charts: view.charts };
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
  listenForKeys((leap) => ({
    " ": () => clock.toggle(), ArrowRight: () => clock.step(leap), ArrowLeft: () => clock.step(-leap),
    Home: () => clock.seek(0), End: () => clock.seek(clock.end), h: () => view.space.home(),
  }));
}

function theme(changed) {
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const apply = (name) => {
    document.documentElement.dataset.theme = name;
    changed();
  };
  find("theme").addEventListener("click", () =>
    apply(document.documentElement.dataset.theme === "dark" ? "light" : "dark"),
  );
  dark.addEventListener("change", () => apply(dark.matches ? "dark" : "light"));
  apply(dark.matches ? "dark" : "light");
}

function tellProblem(error) {
  const note = find("problem");
  note.hidden = false;
  note.textContent = `This page cannot be shown: ${error?.message ?? error}`;
  document.body.dataset.ready = "failed";
}

start().catch(tellProblem);
