// Fields of values: each shows the value in effect, except while a person types or drags.

import { numberText, readNumber, snapped, stepOf } from "./quantities.js";
import { element } from "./view.js";

const REPLY = 1500; // milliseconds until a field without a reply shows the value in effect again
const PAUSE_OF_SLIDER = 40; // milliseconds between values of a dragged slider

// The reason of a refusal, below the row of its field.
export class Reason {
  constructor(row) {
    Object.assign(this, { row, own: "", heard: "" });
    this.place = element("p", "", "reason");
    this.place.setAttribute("role", "status");
    row.after(this.place);
    this.show();
  }

  // Store the reason of the page itself, or of the studio; the empty text withdraws it.
  tell(texts) {
    Object.assign(this, texts);
    this.show();
  }

  isVisible() {
    return this.row.offsetParent !== null;
  }

  show() {
    const text = this.own || this.heard;
    this.row.classList.toggle("refused", text !== "");
    if (this.place.textContent !== text) this.place.textContent = text;
  }
}

// A number with a slider; `send` receives the numbers that a person enters, in the shown unit.
export class NumberField {
  constructor(place, { label, unit = "", meaning = "", value, low = null, high = null, whole = false }, send) {
    Object.assign(this, { unit, value, low, high, offered: [low, high], whole, send, editing: false, dragging: false });
    this.build(place, label, meaning);
    this.reason = new Reason(this.row);
    this.listenForTyping();
    if (this.slider) this.listenForSliding();
    this.show();
  }

  build(place, label, meaning) {
    const ranged = this.low !== null && this.high > this.low && !this.whole;
    this.row = element("div", "", `lil-controller lil-number${ranged ? " lil-has-slider" : ""}`);
    this.row.title = meaning;
    this.input = element("input");
    Object.assign(this.input, { type: "text", inputMode: "text", autocomplete: "off", spellcheck: false });
    this.input.setAttribute("role", "spinbutton");
    this.input.setAttribute("aria-label", label);
    const widget = element("div", "", "lil-widget");
    if (ranged) widget.append((this.slider = element("div", "", "lil-slider")));
    this.slider?.append((this.fill = element("div", "", "lil-fill")));
    widget.append(this.input);
    this.row.append(element("div", label, "lil-name"), widget);
    place.append(this.row);
  }

  get step() {
    return this.slider ? stepOf(this.high - this.low) : this.whole ? 1 : 10 ** Math.floor(Math.log10(Math.abs(this.value) || 1) - 1);
  }

  // Take the value in effect.
  take(value) {
    this.value = value;
    this.settle();
  }

  // Take the reason of a refusal by the studio, or "" without a refusal.
  tell(reason) {
    this.reason.tell({ heard: reason });
  }

  // Show the value in effect, unless a person is typing or dragging.
  settle() {
    clearTimeout(this.waiting);
    if (!this.editing && !this.dragging) this.show();
  }

  show(value = this.value) {
    this.input.value = numberText(value);
    this.input.setAttribute("aria-valuenow", value ?? "");
    if (!this.slider) return;
    if (!this.dragging) this.reach();
    const share = (value - this.low) / (this.high - this.low);
    this.fill.style.width = `${100 * Math.min(Math.max(share, 0), 1)}%`;
  }

  // The slider has its offered range, and reaches to the value in effect.
  reach() {
    const [low, high] = this.offered;
    [this.low, this.high] = [Math.min(low, this.value), Math.max(high, this.value)];
  }

  // Request a value; it is shown until the reply.
  ask(value) {
    this.show(value);
    this.reason.tell({ own: "", heard: "" });
    clearTimeout(this.waiting);
    if (!this.dragging) this.waiting = setTimeout(() => this.settle(), REPLY);
    this.send(value);
  }

  // End typing: request the typed number, or report the reason why it is none.
  commit() {
    if (!this.editing) return;
    this.editing = false;
    const typed = this.input.value;
    try {
      const value = readNumber(typed, this.unit, this.whole);
      if (value === this.value || typed === numberText(this.value)) this.show();
      else this.ask(value);
    } catch (error) {
      this.show();
      this.reason.tell({ own: error.message });
    }
  }

  listenForTyping() {
    const { input } = this;
    input.addEventListener("input", () => {
      this.editing = true;
      this.reason.tell({ own: "" });
    });
    input.addEventListener("blur", () => this.commit());
    input.addEventListener("keydown", (event) => {
      const turn = { ArrowUp: 1, ArrowDown: -1 }[event.key];
      if (event.key === "Enter") this.commit(); // a window without the focus has no blur event
      if (event.key === "Enter") input.blur();
      if (event.key === "Escape") this.giveUp();
      if (turn) this.turn(turn * (event.shiftKey ? 10 : 1));
      if (turn) event.preventDefault();
    });
  }

  giveUp() {
    this.editing = false;
    this.show();
    this.input.blur();
  }

  // Change the number by steps; it becomes a multiple of the step.
  turn(count) {
    this.commit();
    const now = Number(this.input.value);
    const end = now + count * this.step;
    this.ask(snapped(end, this.step, Math.min(end, this.low ?? -Infinity), Math.max(end, this.high ?? Infinity)));
  }

  // A touch that scrolls the page leaves the slider alone.
  listenForSliding() {
    const { slider } = this;
    slider.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      slider.setPointerCapture(event.pointerId);
      this.dragging = true;
      if (event.pointerType !== "touch") this.slide(event);
    });
    slider.addEventListener("pointermove", (event) => this.dragging && this.slide(event));
    slider.addEventListener("pointerup", (event) => this.dragging && this.release(event));
    slider.addEventListener("pointercancel", () => {
      this.dragging = false;
      this.settle();
    });
  }

  slide(event) {
    const box = this.slider.getBoundingClientRect();
    const value = this.low + ((event.clientX - box.left) / box.width) * (this.high - this.low);
    this.wanted = snapped(value, this.step, this.low, this.high);
    this.show(this.wanted);
    this.later ??= setTimeout(() => this.askWanted(), PAUSE_OF_SLIDER);
  }

  release(event) {
    this.slide(event);
    this.dragging = false;
    this.askWanted();
  }

  askWanted() {
    clearTimeout(this.later);
    this.later = undefined;
    if (this.wanted !== this.sent || !this.dragging) this.ask(this.wanted);
    this.sent = this.dragging ? this.wanted : undefined;
  }
}

// A choice or a switch of the library of fields; it shows the value in effect after each reply.
export class PlainField {
  constructor(gui, { label, meaning = "", value, options = null }, send) {
    Object.assign(this, { state: { value }, known: value });
    this.row = options ? gui.add(this.state, "value", options) : gui.add(this.state, "value");
    this.row.name(label).onChange((next) => this.ask(next, send));
    this.row.domElement.title = meaning;
    this.reason = new Reason(this.row.domElement);
  }

  ask(value, send) {
    this.reason.tell({ heard: "" });
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.settle(), REPLY);
    send(value);
  }

  take(value) {
    this.known = value;
    this.settle();
  }

  tell(reason) {
    this.reason.tell({ heard: reason });
  }

  settle() {
    clearTimeout(this.waiting);
    this.state.value = this.known;
    this.row.updateDisplay();
  }
}
