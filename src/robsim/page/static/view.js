// The content of a recording on the page: scene, images, curves and texts.

import { GUI } from "./vendor.js";
import { Chart } from "./charts.js";
import { ActingConstraints } from "./constraints.js";
import { amended, extend, shapeNamesOf, Shapes, widen } from "./growing.js";
import { LayerChoice, LiveLayer, StoredLayer } from "./layers.js";
import { Picture } from "./picture.js";
import { Space } from "./space.js";
import { WhyCard } from "./why.js";

const NAMES = {
  belief: "belief", second: "second scheme", goal: "goal", start: "start", trails: "paths",
  follow: "follow", views: "views of cameras", rays: "rays to feature points", frames: "axes of frames", ground: "ground",
};

const LIMITED = "same colours; broad: limited"; // in place of the names of the joints
const MOST_NAMES = 8; // of the curves in a legend
const CURVES = 120; // milliseconds between drawings of growing curves

export function find(id) {
  return document.getElementById(id);
}

// Whether the window has room for open panels over the scene.
export function hasRoom() {
  return window.matchMedia("(min-width: 1101px)").matches;
}

export function element(kind, text = "", className = "") {
  const made = document.createElement(kind);
  made.textContent = text;
  made.className = className;
  return made;
}

export function closeButton(dialog) {
  const button = element("button", "✕", "close");
  button.setAttribute("aria-label", "close");
  button.addEventListener("click", () => dialog.close());
  return button;
}

// Dotted names without their first parts, if the last parts differ.
export function shortNames(names) {
  const short = names.map((name) => name.split(".").at(-1));
  return new Set(short).size === short.length ? short : names;
}

// The groups of frames with parts.
function groupsOf(header) {
  return [...new Set(header.parts.map((part) => header.frames[part.frame].group))].sort();
}

// A placeholder for the scene if the browser cannot draw in 3-D.
const FLAT = { frames: [], load() {}, change() {}, extend() {}, place() {}, paint() {}, draw() {}, home() {} };

export class View {
  constructor(clock) {
    this.clock = clock;
    this.pictures = [];
    this.layers = new Map(); // rendered pictures, by the name of the camera
    this.choice = new LayerChoice();
    this.version = 0; // number of changes of instants
    this.askForPicture = () => {}; // set by a studio
    this.charts = [];
    this.why = new WhyCard(find("why"));
    this.acting = new ActingConstraints(find("acting"));
    this.shapes = new Shapes();
    try {
      this.space = new Space(find("space"));
    } catch (error) {
      find("space").append(element("p", `This browser cannot draw in 3-D: ${error.message}`, "flat"));
      this.space = FLAT;
    }
    this.shown = -1;
    clock.listen(() => this.place());
  }

  // Show a recording; the view does not change if the recording has the same title.
  load(header, own) {
    const same = this.header?.title === header.title;
    const arrays = { ...this.shapes.keep(header), ...own };
    Object.assign(this, { header, arrays, late: undefined, unplotted: undefined });
    document.title = header.title;
    find("title").textContent = header.title;
    for (const chart of this.charts) chart.destroy();
    for (const id of ["charts", "texts"]) find(id).replaceChildren();
    this.space.load(header, arrays, same);
    this.options();
    this.clock.times = arrays.time.values;
    this.forgetLayers();
    this.showPictures();
    this.charts = header.curves.map((curve) => this.chart(curve));
    this.acting.load(header.constraints, arrays);
    this.tellTexts(header.texts, header.why);
    this.tellOutcome(header.outcome, header.events.at(-1)?.text ?? "");
    this.shown = -1;
    this.repaint();
    this.clock.renew(arrays.time.values);
  }

  // Show changed entries of the header; the view, the instants and the curves stay.
  change(changes) {
    const before = this.header;
    const header = (this.header = amended(before, changes));
    Object.assign(this.arrays, this.shapes.keep(header));
    const names = shapeNamesOf(header);
    for (const name of shapeNamesOf(before)) if (!names.has(name)) delete this.arrays[name];
    widen(this.arrays.poses, header.frames.length);
    this.version++;
    this.space.change(header);
    if (changes.cameras) this.showPictures();
    if (groupsOf(before).join() !== groupsOf(header).join()) this.options();
    this.shown = -1; // the next frame places the bodies, together with rows that arrive before it
  }

  showPictures() {
    for (const picture of this.pictures) picture.destroy();
    this.choice.listeners.clear();
    find("pictures").replaceChildren();
    const cameras = this.header.cameras.filter((c) => c.pixels);
    this.pictures = cameras.map((c) => this.picture(c));
    this.offerLayers(cameras.filter((c) => c.pictures));
    find("pictures").classList.toggle("several", this.pictures.length > 1);
    document.body.classList.toggle("blind", !this.pictures.length);
  }

  // The buttons that choose the content of the images: in the only caption, or above several images.
  offerLayers(cameras) {
    if (!cameras.length) return;
    const buttons = this.choice.buttons(cameras);
    const place = find("pictures");
    if (this.pictures.length === 1) place.querySelector("figcaption").append(buttons);
    else place.prepend(buttons);
    this.choice.listeners.add(() => this.pictures.forEach((each) => each.draw()));
  }

  forgetLayers() {
    for (const layer of this.layers.values()) layer.rest?.();
    this.layers.clear();
  }

  // The rendered pictures of a camera.
  layerOf({ name, pictures }) {
    const changed = () => this.pictures.find((each) => each.camera.name === name)?.draw();
    if (!this.layers.has(name))
      this.layers.set(name, pictures.images ? new StoredLayer(pictures, changed) : new LiveLayer(name, this.askForPicture, changed));
    return this.layers.get(name);
  }

  // Add rows from an instant on; arrays without rows replace the arrays of their names.
  extend(from, arrays) {
    const timed = new Set(["time", "poses", "constraints holding", "constraints yielding"]);
    for (const { values, limited } of this.header.curves) timed.add(values).add(limited);
    for (const { pixels, second } of this.header.cameras) timed.add(pixels).add(second);
    for (const [name, more] of Object.entries(arrays)) {
      if (timed.has(name)) extend(this.arrays[name], from, more);
      else Object.assign(this.arrays[name], more);
    }
    this.late = Math.min(this.late ?? Infinity, from);
    this.version++;
  }

  // Draw new instants, and curves at intervals of at least `CURVES`.
  refresh(now) {
    if (this.late !== undefined) this.unplotted = Math.min(this.unplotted ?? Infinity, this.late);
    if (this.unplotted !== undefined && now - (this.plotted ?? 0) > CURVES) {
      for (const chart of this.charts) chart.extend(this.unplotted);
      [this.plotted, this.unplotted] = [now, undefined];
    }
    if (this.late === undefined && this.shown < 0) this.place();
    if (this.late === undefined) return;
    this.clock.times = this.arrays.time.values;
    this.space.extend(this.late);
    this.acting.extend(this.late);
    this.late = undefined;
    this.shown = -1;
    this.clock.renew(this.arrays.time.values);
  }

  place() {
    if (!this.header) return;
    const { index } = this.clock;
    if (this.shown !== index) {
      this.shown = index;
      this.space.place(index);
      this.acting.place(index);
      for (const picture of this.pictures) picture.place(index, this.acting.statesIn(picture.camera));
    }
    for (const chart of this.charts) chart.place();
  }

  repaint() {
    const dark = document.documentElement.dataset.theme === "dark";
    const style = getComputedStyle(document.body);
    const [sky, ink] = ["--sky", "--ink"].map((name) => style.getPropertyValue(name).trim());
    this.space.paint(sky, ink, dark);
    for (const picture of this.pictures) picture.draw();
    for (const chart of this.charts) chart.build();
  }

  options() {
    if (this.space === FLAT) return;
    const { header, space } = this;
    const groups = new Set(groupsOf(header));
    const there = {
      belief: groups.has("belief"), second: groups.has("second"), goal: groups.has("goal"),
      start: groups.has("start"), trails: header.trails.length, follow: header.trails.length, views: header.cameras.length,
      rays: header.cameras.length && header.marks.length, frames: true, ground: true,
    };
    const open = this.gui && !this.gui._closed;
    this.gui?.destroy();
    this.gui = new GUI({ container: find("showing"), title: "show", injectStyles: false });
    for (const name of Object.keys(NAMES))
      if (there[name]) this.gui.add(space.shown, name).name(NAMES[name]).onChange(() => space.show({}));
    this.gui.add({ home: () => space.home() }, "home").name("reset view");
    if (!open) this.gui.close();
    space.show({});
  }

  picture(camera) {
    const figure = element("figure");
    figure.append(element("figcaption", camera.name));
    find("pictures").append(figure);
    const beneath = (index) => {
      const mode = this.choice.of(camera);
      if (mode !== "marks") return this.layerOf(camera).at(index, mode, this.version);
      this.layers.get(camera.name)?.rest?.();
      return null;
    };
    return new Picture(figure, camera, this.arrays, beneath);
  }

  chart(curve) {
    const figure = element("figure");
    const caption = element("figcaption", curve.title + (curve.unit ? ` (${curve.unit.replaceAll(" ", "\u00a0")})` : ""));
    caption.append(...(curve.limited ? [element("span", LIMITED, "key several")] : legendOf(curve)));
    const plot = element("div", "", "plot");
    figure.append(caption, plot);
    find("charts").append(figure);
    return new Chart(plot, curve, this.arrays, this.clock);
  }

  tellOutcome(outcome, text) {
    find("outcome").textContent = text;
    find("outcome").dataset.outcome = outcome;
  }

  // Show the card of the reason, and the other texts below the images.
  tellTexts(texts, why) {
    this.why.tell(why);
    const others = Object.entries(texts).filter(([heading]) => !(why && heading === "explanation"));
    find("texts").replaceChildren(
      ...others.map(([heading, text]) => {
        const details = element("details");
        details.append(element("summary", heading), heading === "mission" ? phaseTable(text) : element(heading === "experiment" ? "pre" : "p", text));
        details.open = heading !== "experiment";
        return details;
      }),
    );
  }
}

// The names of curves with their colours: of an error its length alone, and the number of names if there are many.
function legendOf({ names, colors }) {
  const shown = names[0] === "|e|" ? ["|e|"] : shortNames(names);
  if (shown.length > MOST_NAMES) return [element("span", `${shown.length} joints`, "key several")];
  return shown.map((name, i) => {
    const key = element("span", name, "key");
    key.style.setProperty("--own", colors[i]);
    return key;
  });
}

// The phases of a mission: start, name and outcome in columns; other lines as a whole.
function phaseTable(text) {
  const table = element("table", "", "phases");
  for (const line of text.split("\n")) {
    const cells = line.trim().split(/\s{2,}/).map((cell) => element("td", cell));
    if (cells.length === 1) cells[0].colSpan = 3;
    table.insertRow().append(...cells);
  }
  return table;
}
