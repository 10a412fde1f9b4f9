// The bar of the experiment: history, goal, files.

import { closeButton, element, find } from "./view.js";
import { wordsOfChange, wordsOfPath } from "./why.js";

const FILES = {
  "experiment.toml": "the experiment, a scenario file",
  "experiment.py": "the experiment and its run in Python",
  "run.nc": "the run as NetCDF",
  "run.html": "this page, for a browser without RobSim",
};
const FILMS = ["film.mp4", "film.gif"];
const MESSAGE = 6000; // milliseconds that a message is shown

export class Bar {
  constructor(place, ask) {
    Object.assign(this, { place, ask });
    this.undo = this.button("undo", "take back the last change (Ctrl Z)", () => ask({ undo: true }));
    this.redo = this.button("redo", "repeat the change that was taken back (Ctrl Shift Z)", () => ask({ redo: true }));
    this.original = this.button("original", "back to the experiment as it was opened", () => ask({ original: true }));
    this.changes = this.menu("changes", "what I changed");
    this.anew = this.button("show the goal anew", "the goal shows the bodies where they are now (g)", () => ask({ show_goal: "anew" }));
    this.here = this.button("take this image as the goal", "the goal is the present configuration", () => ask({ show_goal: "here" }));
    this.files = this.menu("save", "save the experiment or its run");
    this.share = this.button("share", "pass on this page as a file", () => this.offer(this.share, "run.html", shareFile));
    this.film = this.button("film", "save a film of the run", () => this.offer(this.film, FILMS, saveFile, "rendering …"));
    this.copy = this.button("copy Python", "copy the experiment as Python", () => this.offer(this.copy, "experiment.py", copyText));
    this.since = element("span", "", "since");
    this.said = element("span", "", "told");
    this.said.setAttribute("role", "status");
    place.append(this.since, this.said);
    this.offerFiles();
    closeMenusOutside(place);
    place.hidden = false;
  }

  button(text, title, act) {
    const button = element("button", text);
    Object.assign(button, { type: "button", title });
    button.addEventListener("click", act);
    this.place.append(button);
    return button;
  }

  menu(text, label) {
    const menu = element("details", "", "menu");
    menu.title = label;
    menu.panel = element("div", "", "panel");
    menu.panel.setAttribute("role", "group");
    menu.panel.setAttribute("aria-label", label);
    menu.append(element("summary", text), menu.panel);
    menu.addEventListener("toggle", () => keepInside(menu.panel));
    this.place.append(menu);
    return menu;
  }

  tell({ undo = false, redo = false, edited = false, changes = [], goal = {}, since = 0, live = true }) {
    [this.undo.disabled, this.redo.disabled, this.original.disabled] = [!undo, !redo, !edited];
    for (const button of [this.anew, this.here]) button.hidden = !goal.shown;
    this.anew.disabled = !goal.kept;
    this.since.textContent = since > 0 ? `files hold the run since the last change (${since.toFixed(2)} s)` : "files hold the run from its start";
    this.since.classList.toggle("whole", !(since > 0));
    this.since.hidden = !live;
    this.listChanges(changes);
  }

  listChanges(changes) {
    const key = JSON.stringify(changes);
    if (key === this.changesKey) return;
    this.changesKey = key;
    this.changes.firstChild.textContent = changes.length ? `changes (${changes.length})` : "changes";
    const rows = changes.map((change) => this.changeRow(change));
    this.changes.panel.replaceChildren(...(rows.length ? rows : [element("p", "nothing has been changed")]));
  }

  changeRow({ path, before, after, original }) {
    const row = element("div", "", "change");
    row.append(element("span", wordsOfPath(path), "name"), element("span", wordsOfChange({ before, after }), "turned"));
    if (original === null) return row;
    const back = element("button", "back");
    back.type = "button";
    back.title = `set ${path} to ${before} again`;
    back.setAttribute("aria-label", back.title);
    back.addEventListener("click", () => this.ask({ set: [path, original] }));
    row.append(back);
    return row;
  }

  offerFiles() {
    for (const [name, about] of Object.entries(FILES)) {
      const button = element("button", name, "file");
      button.type = "button";
      button.title = about;
      button.addEventListener("click", () => this.offer(button, name, saveFile));
      this.files.panel.append(button, element("span", about));
    }
  }

  // Fetch the first available one of several files and use it; the button shows the wait, the bar the reason of a failure.
  async offer(button, names, use, wait = "preparing …") {
    const text = button.textContent;
    Object.assign(button, { textContent: wait, disabled: true });
    try {
      this.say(await use(await fetchFirst([names].flat())));
      this.files.open = false;
    } catch (error) {
      this.say(error.message, true);
    } finally {
      Object.assign(button, { textContent: text, disabled: false });
    }
  }

  say(text, warm = false) {
    clearTimeout(this.timer);
    this.said.textContent = text;
    this.said.classList.toggle("warm", warm);
    this.timer = setTimeout(() => (this.said.textContent = ""), warm ? 2 * MESSAGE : MESSAGE);
  }
}

// Shift an open panel to the left if the window ends before it.
function keepInside(panel) {
  panel.style.removeProperty("left");
  const over = panel.getBoundingClientRect().right + 10 - document.documentElement.clientWidth;
  if (over > 0) panel.style.left = `${-over}px`;
}

function closeMenusOutside(place) {
  const close = (kept) => {
    for (const menu of place.querySelectorAll(".menu")) if (menu !== kept) menu.open = false;
  };
  document.addEventListener("pointerdown", (event) => close(event.target.closest(".menu")));
  place.addEventListener("keydown", (event) => {
    const menu = event.key === "Escape" && event.target.closest(".menu[open]");
    if (!menu) return;
    close();
    menu.firstChild.focus();
  });
}

// The first file that the studio can build; throws the reason of the studio if there is none.
async function fetchFirst(names) {
  const reasons = [];
  for (const name of names) {
    const answer = await fetch(`/download/${name}`).catch(() => null);
    if (answer?.ok) return new File([await answer.blob()], storedName(answer) ?? name, { type: answer.headers.get("Content-Type") });
    reasons.push(answer ? await answer.text() : "the studio does not answer");
  }
  throw new Error(`${names[0]}: ${reasons[0]}`);
}

// The name that the studio gives to a file, such as eye_in_hand-run.nc.
function storedName(answer) {
  return /filename="([^"]+)"/.exec(answer.headers.get("Content-Disposition"))?.[1];
}

function saveFile(file) {
  const link = element("a");
  Object.assign(link, { href: URL.createObjectURL(file), download: file.name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  return `saved ${file.name}`;
}

// Share a file with the programs of the device; without this ability the file is saved.
async function shareFile(file) {
  const content = { files: [new File([file], file.name, { type: "text/html" })], title: document.title };
  if (!navigator.canShare?.(content)) return `${saveFile(file)}: send this file; any browser opens it`;
  try {
    await navigator.share(content);
    return "shared";
  } catch (error) {
    return error.name === "AbortError" ? "" : saveFile(file);
  }
}

// Copy a text; without access to the clipboard the text is shown, selected.
async function copyText(file) {
  const text = await file.text();
  try {
    await navigator.clipboard.writeText(text);
    return "copied";
  } catch {
    showText(text);
    return "";
  }
}

function showText(text) {
  const dialog = find("copying");
  const area = element("textarea");
  Object.assign(area, { value: text, readOnly: true, rows: Math.min(text.split("\n").length + 1, 24) });
  area.setAttribute("aria-label", "the experiment in Python");
  dialog.replaceChildren(closeButton(dialog), element("p", "This browser does not allow pages to copy: press Ctrl C."), area);
  dialog.showModal();
  area.select();
}
