// The page: what a recording holds, laid out, and the controls of time.

import { GUI } from "./vendor.js";
import { Chart } from "./charts.js";
import { Clock } from "./clock.js";
import { Picture } from "./picture.js";
import { Space } from "./space.js";
import { unpack } from "./unpack.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];
const NAMES = {
  belief: "belief", goal: "goal", start: "start", trails: "ways", views: "views of cameras",
  rays: "rays to marks", frames: "axes of frames", ground: "ground",
};

async function start() {
  const header = JSON.parse(document.getElementById("header").textContent);
  const arrays = await unpack(header.arrays, document.getElementById("numbers").textContent);
  const clock = new Clock(arrays.time.values);
  document.title = header.title;
  find("title").textContent = header.title;
  tellOutcome(header);
  const space = spaceOf(header, arrays);
  const pictures = header.cameras.filter((c) => c.pixels).map((c) => pictureOf(c, arrays));
  const charts = header.curves.map((curve) => chartOf(curve, arrays, clock));
  document.body.classList.toggle("still", clock.times.length < 2);
  document.body.classList.toggle("blind", !pictures.length);
  tellTexts(header.texts);
  timeControls(clock);
  keys(clock, space);
  theme(() => {
    const dark = document.documentElement.dataset.theme === "dark";
    space.paint(getComputedStyle(document.body).getPropertyValue("--sky").trim(), dark);
    for (const each of [...pictures, ...charts]) each.build ? each.build() : each.draw();
  });
  let shown = -1;
  clock.listen(() => {
    if (shown !== clock.index) {
      shown = clock.index;
      space.place(shown);
      for (const picture of pictures) picture.place(shown);
    }
    for (const chart of charts) chart.place();
  });
  run(clock, space);
  window.robsim = { header, arrays, clock, space, pictures, charts };
  document.body.dataset.ready = "yes";
}

function run(clock, space) {
  let before = performance.now();
  const frame = (now) => {
    clock.pass(Math.min((now - before) / 1000, 0.25));
    before = now;
    space.draw();
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
  const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (!still && clock.times.length > 1) clock.toggle();
}

// What stands for the scene where the browser cannot draw in 3-D.
const FLAT = { frames: [], place() {}, paint() {}, draw() {}, home() {} };

function spaceOf(header, arrays) {
  let space;
  try {
    space = new Space(find("space"), header, arrays);
  } catch (error) {
    find("space").textContent = `This browser cannot draw in 3-D: ${error.message}`;
    return FLAT;
  }
  const gui = new GUI({ container: find("options"), title: "show", injectStyles: false });
  const groups = new Set(header.frames.map((frame) => frame.group));
  const there = {
    belief: groups.has("belief") && header.parts.some((p) => header.frames[p.frame].group === "belief"),
    goal: groups.has("goal"),
    start: header.parts.some((p) => header.frames[p.frame].group === "start"),
    trails: header.trails.length, views: header.cameras.length,
    rays: header.cameras.length && header.marks.length, frames: true, ground: true,
  };
  for (const name of Object.keys(NAMES))
    if (there[name]) gui.add(space.shown, name).name(NAMES[name]).onChange(() => space.show({}));
  gui.add({ home: () => space.home() }, "home").name("view as at first");
  gui.close();
  space.show({});
  return space;
}

function pictureOf(camera, arrays) {
  const figure = document.createElement("figure");
  const caption = document.createElement("figcaption");
  caption.textContent = camera.name;
  figure.append(caption);
  find("pictures").append(figure);
  find("pictures").classList.toggle("several", find("pictures").children.length > 1);
  return new Picture(figure, camera, arrays);
}

function chartOf(curve, arrays, clock) {
  const figure = document.createElement("figure");
  const caption = document.createElement("figcaption");
  caption.append(curve.title + (curve.unit ? ` (${curve.unit})` : ""));
  if (curve.names.length <= 8)
    curve.names.slice(0, curve.log ? 1 : 8).forEach((name, i) => {
      const key = document.createElement("span");
      key.textContent = name;
      key.className = "key";
      key.style.setProperty("--own", curve.colors[i]);
      caption.append(key);
    });
  const plot = document.createElement("div");
  plot.className = "plot";
  figure.append(caption, plot);
  find("charts").append(figure);
  return new Chart(plot, curve, arrays, clock);
}

function tellOutcome(header) {
  const badge = find("outcome");
  badge.textContent = header.events.length ? header.events[header.events.length - 1].text : "";
  badge.dataset.outcome = header.outcome;
}

function tellTexts(texts) {
  for (const [heading, text] of Object.entries(texts)) {
    const details = document.createElement("details");
    const summary = document.createElement("summary");
    summary.textContent = heading;
    const body = document.createElement(heading === "experiment" ? "pre" : "p");
    body.textContent = text;
    details.append(summary, body);
    details.open = heading === "explanation";
    find("texts").append(details);
  }
}

function timeControls(clock) {
  const slider = find("slider");
  slider.max = clock.times.length - 1;
  slider.addEventListener("input", () => clock.step(Number(slider.value) - clock.index));
  find("play").addEventListener("click", () => clock.toggle());
  const speed = find("speed");
  for (const each of SPEEDS) speed.add(new Option(`${each} x`, each, each === 1, each === 1));
  speed.addEventListener("change", () => (clock.speed = Number(speed.value)));
  clock.listen(() => {
    slider.value = clock.index;
    find("seconds").textContent = `${clock.times[clock.index].toFixed(2)} s`;
    find("play").textContent = clock.playing ? "❚❚" : "▶";
    find("play").setAttribute("aria-label", clock.playing ? "pause" : "play");
  });
}

function keys(clock, space) {
  document.addEventListener("keydown", (event) => {
    if (event.target.closest("select, textarea, input:not(#slider), summary, button")) return;
    const leap = event.shiftKey ? 10 : 1;
    const actions = {
      " ": () => clock.toggle(), ArrowRight: () => clock.step(leap), ArrowLeft: () => clock.step(-leap),
      Home: () => clock.seek(0), End: () => clock.seek(clock.end), h: () => space.home(),
    };
    if (!actions[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    actions[event.key]();
    event.preventDefault();
  });
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

function find(id) {
  return document.getElementById(id);
}

function tellProblem(error) {
  const note = find("problem");
  note.hidden = false;
  note.textContent = `This page cannot be shown: ${error?.message ?? error}`;
  document.body.dataset.ready = "failed";
}

start().catch(tellProblem);
