// The values that may be changed; their declarations come from the studio.

import { GUI } from "./vendor.js";
import { NumberField, PlainField } from "./fields.js";
import { fromShown, shownUnit, toShown } from "./quantities.js";
import { shortNames } from "./view.js";

const FIRST = ["task", "start", "sensing", "actuation", "safety", "belief", "objects", "cameras", "robots", "run"];
const OPEN = new Set(["task", "start", "start q"]);

export class Controls {
  constructor(element, set) {
    Object.assign(this, { element, set, rows: new Map(), open: new Set(OPEN), lights: new Map() }); // open: folders
  }

  // Show controls; existing controls only take their new values.
  renew(controls) {
    const form = controls.map((c) => [c.path, c.form, c.options, c.names, c.form === "list" && c.value]);
    const key = JSON.stringify(form);
    if (key === this.key) this.echo(controls);
    else this.build(controls, key);
  }

  // Show the values in effect.
  echo(controls) {
    this.known = new Map(controls.map((c) => [c.path, c]));
    for (const control of controls) this.rows.get(control.path)?.take(control);
  }

  // Show the values in effect after a request was handled.
  settle() {
    for (const row of this.rows.values()) row.settle();
  }

  // Show the reasons of refusals {path, reason} below their fields; return the refusals with a visible field.
  refuse(refusals) {
    const reasons = new Map(refusals.map(({ path, reason }) => [path, reason]));
    for (const [path, row] of this.rows) row.tell(reasons.get(path) ?? "");
    return refusals.filter(({ path }) => this.rows.get(path)?.isVisible());
  }

  build(controls, key) {
    this.key = key;
    this.known = new Map(controls.map((c) => [c.path, c]));
    this.rows.clear();
    this.folders = new Map(); // by path
    this.element.querySelector(".values")?.remove();
    const place = document.createElement("div");
    place.className = "values";
    this.element.append(place);
    const tree = treeOf(controls);
    const order = [...tree.keys()].sort((a, b) => rank(a) - rank(b));
    for (const name of order) this.folder(new GUI({ container: place, title: name, injectStyles: false }), tree.get(name), name);
  }

  // Fill a folder when it is first opened: a robot has hundreds of values.
  folder(gui, branch, path, end = () => {}) {
    let filled = false;
    const fill = () => {
      if (filled) return;
      filled = true;
      const listed = branch.get("kind") ?? branch;
      if (listed.form === "list") return this.growing(gui, listed, branch, path);
      for (const [name, inside] of branch) {
        const here = `${path} ${name}`;
        if (inside instanceof Map) this.folder(gui.addFolder(words(name)), inside, here);
        else if (inside.form === "list") this.folder(gui.addFolder(words(name)), new Map([["kind", inside]]), here);
        else if (inside.form === "numbers") this.several(gui.addFolder(words(name)), inside, here);
        else this.one(gui, inside, words(name));
      }
      end();
    };
    if (this.open.has(path)) fill();
    this.keepOpen(gui, path);
    this.folders.set(path, gui);
    this.showLight(path);
    gui.onOpenClose((changed) => changed === gui && fill());
  }

  // A folder that a person has opened stays open when the values of another scheme are shown.
  keepOpen(gui, path) {
    if (!this.open.has(path)) gui.close();
    gui.$title.addEventListener("click", () => this.open[gui._closed ? "delete" : "add"](path));
  }

  // A list of objects: a folder for each, and a choice of the kinds that can be added.
  growing(gui, control, branch, here) {
    const { meaning, path, value } = control;
    value.forEach((_, i) => this.item(gui, control, i, branch.get(String(i)), `${here} ${i}`));
    const options = { "…": "", ...Object.fromEntries(control.options.map((kind) => [words(kind), kind])) };
    const add = (kind) => kind && this.set(path, [...value.keys(), kind]);
    const field = new PlainField(gui, { label: "add", meaning, value: "", options }, add);
    this.rows.set(path, adapt(field, () => ""));
  }

  // The values of an object of a list, and a button that removes it.
  item(gui, { path, value, low }, index, inside, here) {
    const branch = new Map(inside instanceof Map ? inside : []);
    branch.delete("kind"); // the title has it
    const folder = gui.addFolder(words(value[index]));
    const remove = () => this.set(path, [...value.keys()].filter((each) => each !== index));
    this.folder(folder, branch, here, () => folder.add({ remove }, "remove").enable(value.length > low));
  }

  // Light up the folders of values that act; `states` are the states by path.
  light(states) {
    this.lights = new Map([...states].map(([path, state]) => [path.replaceAll(".", " "), state]));
    for (const path of this.folders?.keys() ?? []) this.showLight(path);
  }

  showLight(path) {
    const own = this.lights.get(path);
    const inside = path.includes(" ") && [...this.lights.keys()].some((each) => each.startsWith(`${path} `));
    this.folders.get(path).$title.dataset.acts = own ?? (inside ? "holding" : "");
  }

  one(gui, control, name) {
    const field = fieldOf(gui, { ...control, ...this.known.get(control.path) }, name, (value) => this.set(control.path, value));
    this.rows.set(control.path, { ...field, take: (news) => field.take(news.value) });
  }

  // Several numbers are one value: a change of one sends them all.
  several(gui, control, path) {
    const now = this.known.get(control.path) ?? control;
    const units = control.names.map((_, i) => (Array.isArray(control.unit) ? control.unit[i] : control.unit));
    const plain = shortNames(control.names);
    let [wanted, last] = [[...now.value], 0];
    gui.domElement.title = control.meaning;
    const fields = control.names.map((_, i) => numberField(gui, {
      ...control, value: now.value[i], unit: units[i], low: control.low[i], high: control.high[i],
    }, plain[i], (value) => {
      wanted[(last = i)] = value;
      this.set(control.path, [...wanted]);
    }));
    this.keepOpen(gui, path);
    this.rows.set(control.path, {
      take: (news) => {
        wanted = [...news.value];
        fields.forEach((field, i) => field.take(news.value[i]));
      },
      settle: () => {
        wanted = [...this.known.get(control.path).value];
        fields.forEach((field) => field.settle());
      },
      tell: (reason) => fields.forEach((field, i) => field.tell(i === last ? reason : "")),
      isVisible: () => fields[last].isVisible(),
    });
  }
}

// The field of a control: it sends and takes values with SI units, and reasons of refusals.
export function fieldOf(gui, control, name, send) {
  const { form, meaning, options, value } = control;
  if (!["choice", "flag"].includes(form)) return numberField(gui, control, name, send);
  const field = new PlainField(gui, { label: name, meaning, value, options: form === "choice" ? options : null }, send);
  return adapt(field, (news) => news);
}

function numberField(gui, control, name, send) {
  const { form, meaning, unit } = control;
  const [value, low, high] = [control.value, control.low, control.high].map((x) => toShown(x, unit));
  const shown = shownUnit(unit);
  const about = { label: shown ? `${name} (${shown})` : name, meaning, unit: shown, value, low, high, whole: form === "whole" };
  const field = new NumberField(gui.$children, about, (next) => send(fromShown(next, unit)));
  return adapt(field, (news) => toShown(news, unit));
}

function adapt(field, shown) {
  return {
    take: (news) => field.take(shown(news)), tell: (reason) => field.tell(reason), settle: () => field.settle(),
    isVisible: () => field.reason.isVisible(),
  };
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

function words(name) {
  return name.replaceAll("_", " ");
}
