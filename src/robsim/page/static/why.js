// The reason of an outcome: how far from the goal, why, what to try, and what to watch for.

import { element } from "./view.js";

// The words of a dotted name.
export function wordsOfPath(path) {
  return path.replaceAll(".", " ").replaceAll("_", " ");
}

// A changed value, before and after.
export function wordsOfChange({ before, after }) {
  return `${before || "none"} → ${after || "none"}`;
}

export class WhyCard {
  // Without `ask` (a page of a recording) the card has no buttons.
  constructor(place, ask = null) {
    Object.assign(this, { place, ask, key: "", second: "" });
    this.tell(null);
  }

  tell(why) {
    const { headline = "", missed = false, findings = [], watch = [], changed = false, changes = [] } = why ?? {};
    const key = JSON.stringify([headline, missed, findings, watch, changed, changes]);
    if (key === this.key) return;
    this.key = key;
    this.place.hidden = !(headline || findings.length || watch.length);
    this.place.classList.toggle("off-goal", missed);
    this.place.replaceChildren();
    if (headline) this.place.append(this.headline(headline));
    this.place.append(...findings.map((each) => this.paragraph(each)));
    if (changes.length && !this.ask) this.place.append(this.paragraph(listOfChanges(changes)));
    if (watch.length) this.place.append(this.watching(watch, !headline, changed));
    this.mark();
  }

  headline(text) {
    const line = element("h2", text[0].toUpperCase() + text.slice(1));
    line.setAttribute("role", "status");
    return line;
  }

  // The remark of the original experiment; it is folded once there is a reason to read, unless the user unfolds it.
  watching(watch, open, changed) {
    const section = element("details", "", "watch");
    section.append(element("summary", changed ? "Watch for, in the original" : "Watch for"), ...watch.map((each) => this.paragraph(each)));
    section.open = this.unfolded ?? open;
    section.firstChild.addEventListener("click", () => (this.unfolded = !section.open));
    return section;
  }

  paragraph({ head = "", text, actions = [] }) {
    const block = element("div", "", "finding");
    const paragraph = element("p");
    const offers = this.ask && actions.length > 0;
    if (head && !offers) paragraph.append(element("strong", head));
    for (const line of text.split("\n")) paragraph.append(line.startsWith("robsim ") ? element("code", line) : element("span", unbroken(line)));
    block.append(paragraph);
    if (offers) {
      const row = element("div", "", "actions");
      row.append(...actions.map((action) => this.button(action)));
      block.append(row);
    }
    return block;
  }

  button({ label, change, second, undo = false }) {
    const button = element("button", label);
    button.type = "button";
    if (undo) {
      button.addEventListener("click", () => this.undo());
      return button;
    }
    const changes = Object.entries(change ?? second).map(([path, value]) => `${path} = ${plainText(value)}`);
    button.title = `${changes.join(", ")}${second ? ", as a second scheme beside this run" : ", from the start"}`;
    if (second) button.dataset.second = JSON.stringify(second);
    button.addEventListener("click", () => (second ? this.compare(button, second) : this.try(change)));
    return button;
  }

  // The promise of a sentence holds for the start of the experiment, so the run starts over.
  try(change) {
    for (const request of [{ change }, { reset: true }, { play: true }]) this.ask(request);
  }

  // Take back the last change; the run goes on without it.
  undo() {
    for (const request of [{ undo: true }, { play: true }]) this.ask(request);
  }

  compare(button, second) {
    const shown = button.getAttribute("aria-pressed") === "true";
    for (const request of [{ second: shown ? null : second }, { play: true }]) this.ask(request);
  }

  // Mark the button of the second scheme that runs.
  mark(second = this.second) {
    this.second = second;
    for (const button of this.place.querySelectorAll("[data-second]"))
      button.setAttribute("aria-pressed", String(button.dataset.second === JSON.stringify(second)));
  }
}

function listOfChanges(changes) {
  return { head: "Changed", text: changes.map((each) => `${wordsOfPath(each.path)}: ${wordsOfChange(each)}`).join("\n") };
}

// A text whose lines do not end within a number such as 1e-05, nor between a number and its unit.
function unbroken(text) {
  return text.replace(/(\de-)(?=\d)/g, "$1\u2060").replace(/(\d) (?=(s|m|cm|mm|px|deg)\b)/g, "$1\u00a0");
}

function plainText(value) {
  if (value === null) return "default";
  return typeof value === "string" ? value : JSON.stringify(value);
}
