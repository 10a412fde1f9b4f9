// The values that may be changed; their declarations come from the studio.

import { GUI } from "./vendor.js";

const FIRST = ["task", "start", "sensing", "actuation", "safety", "belief", "objects", "cameras", "robots", "run"];
const OPEN = new Set(["task", "start", "start q"]);
const DEGREE = Math.PI / 180;

export class Controls {
  constructor(element, set) {
    Object.assign(this, { element, set, rows: new Map() });
  }

  // Show controls; existing controls only take their new values.
  renew(controls) {
    const form = controls.map((c) => [c.path, c.form, c.options, c.names]);
    const key = JSON.stringify(form);
    if (key === this.key) this.echo(controls);
    else this.build(controls, key);
  }

  echo(controls) {
    for (const control of controls) this.rows.get(control.path)?.(control);
    this.known = new Map(controls.map((c) => [c.path, c]));
  }

  build(controls, key) {
    this.key = key;
    this.known = new Map(controls.map((c) => [c.path, c]));
    this.rows.clear();
    this.element.querySelector(".values")?.remove();
    const place = document.createElement("div");
    place.className = "values";
    this.element.append(place);
    const tree = treeOf(controls);
    const order = [...tree.keys()].sort((a, b) => rank(a) - rank(b));
    for (const name of order) this.folder(new GUI({ container: place, title: name, injectStyles: false }), tree.get(name), name);
  }

  // Fill a folder when it is first opened: a robot has hundreds of values.
  folder(gui, branch, path) {
    let filled = false;
    const fill = () => {
      if (filled) return;
      filled = true;
      for (const [name, inside] of branch) {
        const here = `${path} ${name}`;
        if (inside instanceof Map) this.folder(gui.addFolder(words(name)), inside, here);
        else if (inside.form === "numbers") this.several(gui.addFolder(words(name)), inside, here);
        else this.one(gui, inside, words(name));
      }
    };
    if (OPEN.has(path)) fill();
    else gui.close();
    gui.onOpenClose(() => fill());
  }

  one(gui, control, name) {
    const state = { value: shown(this.known.get(control.path) ?? control, control.unit) };
    const row = rowOf(gui, state, control, [control.low, control.high]).name(labelled(name, control.unit));
    row.domElement.title = control.meaning;
    row.onChange((value) => this.set(control.path, control.form === "number" ? inside(value, control.unit) : value));
    this.rows.set(control.path, (news) => takeOver(row, state, shown(news, control.unit)));
  }

  several(gui, control, path) {
    const now = this.known.get(control.path) ?? control;
    const numbers = { value: [...now.value] };
    gui.domElement.title = control.meaning;
    const units = control.names.map((_, i) => (Array.isArray(control.unit) ? control.unit[i] : control.unit));
    const short = control.names.map((name) => name.split(".").at(-1));
    const plain = new Set(short).size === short.length ? short : control.names;
    const rows = control.names.map((_, i) => {
      const state = { value: outside(numbers.value[i], units[i]) };
      const row = numberRow(gui, state, numbers.value[i], units[i], [control.low[i], control.high[i]]).name(labelled(plain[i], units[i]));
      row.onChange((value) => {
        numbers.value[i] = inside(value, units[i]);
        this.set(control.path, [...numbers.value]);
      });
      return [row, state];
    });
    if (!OPEN.has(path)) gui.close();
    this.rows.set(control.path, (news) => {
      numbers.value = [...news.value];
      rows.forEach(([row, state], i) => takeOver(row, state, outside(news.value[i], units[i])));
    });
  }
}

function treeOf(controls) {
  const tree = new Map();
  for (const control of controls) {
    const keys = control.path.split(".");
    let branch = tree;
    for (const [i, key] of keys.slice(0, -1).entries()) {
      const next = branch.get(key);
      if (next instanceof Map) branch = next;
      else {
        const made = new Map(next ? [["kind", next]] : []); // a choice, and the values of the chosen kind
        branch.set(i || keys.length > 1 ? key : "more", made);
        branch = made;
      }
    }
    const leaf = keys.at(-1);
    if (branch.get(leaf) instanceof Map) branch.get(leaf).set("kind", control);
    else branch.set(leaf, control);
  }
  return tree;
}

function rank(name) {
  const at = FIRST.indexOf(name);
  return at < 0 ? FIRST.length : at;
}

function rowOf(gui, state, control, ends) {
  if (control.form === "choice") return gui.add(state, "value", control.options);
  if (control.form === "flag") return gui.add(state, "value");
  if (control.form === "whole") return gui.add(state, "value").step(1);
  return numberRow(gui, state, control.value, control.unit, ends);
}

function numberRow(gui, state, value, unit, bounds) {
  const ends = bounds.map((end) => outside(end, unit));
  const row = gui.add(state, "value", ...ends).decimals(places(ends[1] - ends[0], outside(value, unit)));
  row.domElement.querySelector("input").addEventListener("input", (event) => reach(row, parseFloat(event.target.value)), true);
  return row;
}

// Decimals that show a thousandth of the span, and two digits of the value.
function places(span, value) {
  const fine = value ? 1 - Math.floor(Math.log10(Math.abs(value))) : 0;
  return Math.min(Math.max(Math.ceil(3 - Math.log10(span)), Math.abs(value) < span / 100 ? fine : 0, 0), 9);
}

// Extend a slider to a typed value; the studio checks the value.
function reach(row, value) {
  if (value < row._min) row.min(value);
  if (value > row._max) row.max(value);
}

// Show the true value, unless the user is editing it.
function takeOver(row, state, value) {
  if (row.domElement.contains(document.activeElement) && document.activeElement.matches("input")) return;
  reach(row, value);
  state.value = value;
  row.updateDisplay();
}

function shown(control, unit) {
  return control.form === "number" ? outside(control.value, unit) : control.value;
}

// Angles are shown in degrees.
function outside(value, unit) {
  return unit.startsWith("rad") ? value / DEGREE : value;
}

function inside(value, unit) {
  return unit.startsWith("rad") ? value * DEGREE : value;
}

function labelled(name, unit) {
  const shownUnit = unit === "per second" ? "1/s" : unit.replace("rad", "deg");
  return unit && unit !== "1" ? `${name} (${shownUnit})` : name;
}

function words(name) {
  return name.replaceAll("_", " ");
}
