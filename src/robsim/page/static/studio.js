// The page of a studio: it shows the messages of the simulation, and sends the user's requests.

import { GUI } from "./vendor.js";
import { Controls } from "./controls.js";
import { Handles } from "./handles.js";
import { Link } from "./link.js";
import { StudyMap } from "./study.js";
import { listenForKeys, listenForTime, offerSpeeds, showTime } from "./time.js";
import { unpack } from "./unpack.js";
import { element, find } from "./view.js";

const FASTNESS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 0]; // 0: maximum speed
const COMPARED = /^(task|sensing|actuation|belief\.cameras)\./; // values in which two schemes may differ
const FILES = ["experiment.toml", "experiment.py", "run.nc", "run.html"];

export class Studio {
  constructor(view, clock) {
    Object.assign(this, { view, clock, state: {}, entries: [], live: true });
    for (const id of ["controls", "choose", "reset", "step"]) find(id).hidden = false;
    document.body.classList.add("studio");
    this.saving();
    this.controls = new Controls(find("controls"), (name, value) => this.link.ask({ set: [name, value] }));
    if (view.space.scene) this.handles = new Handles(view.space, (name, pose) => this.link.ask({ drag: [name, pose] }));
    this.timeControls();
    this.choosing();
    clock.following = true;
    this.link = new Link((message) => this.hear(message), (there) => this.tellThere(there), (error) => {
      this.tellNote(`Internal error of this page: ${error.message}`);
      console.error(error);
    });
    window.robsim = this;
  }

  hear(message) {
    const done = {
      study: () => this.chart(message),
      shapes: () => this.keepShapes(message),
      recording: () => this.record(message),
      entries: () => this.view.change(message.header),
      rows: () => this.further(message),
      controls: () => this.collect(message),
      values: () => this.offer(replaced(this.listed, message.controls)),
      gallery: () => (this.entries = message.entries),
      texts: () => this.view.tellTexts({ ...message.texts }),
      state: () => this.tell(message),
    }[message.type];
    if (done) return done();
    this.tellNote(message.error ?? "");
    return undefined;
  }

  // The map of a study, which is sent first, and again after a lost connection.
  async chart({ recording }) {
    if (this.map) return;
    document.body.classList.add("map");
    const { header, arrays } = await unpack(recording);
    this.map = new StudyMap(header, arrays, (number) => this.openRun(number));
    find("back").addEventListener("click", () => this.backToMap());
    document.body.dataset.ready = "yes";
  }

  openRun(number) {
    this.wanted = number;
    this.link.ask({ run: number });
  }

  // Show the requested run once it has arrived.
  followRun({ run }) {
    if (this.wanted === undefined || this.wanted !== run) return;
    this.wanted = undefined;
    this.left = window.scrollY; // scroll position of the map on a small screen
    document.body.classList.remove("map");
    window.scrollTo(0, 0);
    this.clock.following = true;
    find("play").focus({ preventScroll: true });
  }

  backToMap() {
    document.body.classList.add("map");
    this.map.renew();
    this.map.scatter.canvas.focus({ preventScroll: true });
    window.scrollTo(0, this.left);
  }

  tellRun({ run }) {
    find("back").hidden = !this.map;
    find("whose").textContent = this.map && run !== null ? this.map.name(run) : "";
  }

  async record({ recording, live }) {
    const { header, arrays } = await unpack(recording);
    this.live = live;
    this.view.load(header, arrays);
    this.clock.following = live;
    if (live) this.clock.toEnd();
    else this.clock.playing || this.clock.toggle();
    document.body.dataset.ready = "yes";
  }

  async keepShapes({ recording }) {
    const { header, arrays } = await unpack(recording);
    this.view.shapes.add(header, arrays);
  }

  // Further instants; from number 0 on, the run starts anew.
  async further({ from, recording }) {
    const { arrays } = await unpack(recording);
    if (from === 0) this.clock.following = this.live;
    this.view.extend(from, arrays);
  }

  // The controls arrive in several messages.
  collect({ controls, from, count }) {
    this.parts = from === 0 ? controls : [...this.parts, ...controls];
    if (this.parts.length === count) this.offer(this.parts);
  }

  offer(controls) {
    this.listed = controls;
    this.controls.renew(controls);
    this.offerSecond();
  }

  tell(state) {
    this.state = state;
    this.tellNote(state.note);
    this.tellRun(state);
    if (state.note && this.listed) this.controls.echo(this.listed); // resets rejected values
    if (this.live) this.view.tellOutcome(state.outcome, state.ending);
    const factor = state.playing && state.factor !== null && this.live;
    find("factor").textContent = factor ? `${state.factor.toFixed(state.factor < 10 ? 2 : 0)} x` : "";
    if (this.live) find("speed").value = state.speed;
    this.handles?.renew(state.handles);
    this.begin();
    this.offerSecond();
    showTime(this.clock, this.playing);
    this.followRun(state);
  }

  // Play an untouched experiment at once, unless the user prefers reduced motion.
  begin() {
    if (this.begun || this.map || !this.view.arrays) return;
    this.begun = true;
    const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    const begun = this.view.arrays.time.shape[0] > 1 || this.state.playing || this.state.outcome;
    const untouched = this.live && !begun;
    if (untouched && !still) this.link.ask({ play: true });
  }

  get playing() {
    return this.live ? this.state.playing : this.clock.playing;
  }

  tellNote(text) {
    find("note").hidden = !text;
    find("note").textContent = text;
    this.map?.tellNote(text);
  }

  tellThere(there) {
    const problem = find("problem");
    problem.hidden = there;
    problem.textContent = "The studio does not answer. If it was restarted, open the new address that it printed.";
    document.body.classList.toggle("alone", !there);
  }

  timeControls() {
    const { clock } = this;
    const toggle = () => (this.live ? this.play(!this.state.playing) : clock.toggle());
    const scrub = (count) => this.scrub(count);
    listenForTime(clock, toggle, scrub);
    offerSpeeds(FASTNESS, (speed) => (this.live ? this.link.ask({ speed }) : (clock.speed = speed || 100)));
    find("reset").addEventListener("click", () => this.reset());
    find("step").addEventListener("click", () => this.step(1));
    clock.listen(() => showTime(clock, this.playing));
    listenForKeys((leap) => ({
      " ": toggle, ArrowRight: () => this.step(leap), ArrowLeft: () => scrub(-leap), r: () => this.reset(),
      Home: () => scrub(-Infinity), End: () => scrub(Infinity), h: () => this.view.space.home(),
    }));
  }

  play(playing) {
    this.clock.following = true;
    this.clock.toEnd();
    this.link.ask({ play: playing });
  }

  reset() {
    this.clock.following = this.live;
    if (this.live) this.link.ask({ reset: true });
    else this.clock.seek(0);
  }

  // Show an earlier or later instant; at the last one follow new instants.
  scrub(count) {
    const last = this.clock.times.length - 1;
    this.clock.step(Math.min(Math.max(count, -last), last));
    this.clock.following = this.live && this.clock.index === last;
  }

  step(count) {
    const last = this.clock.index === this.clock.times.length - 1;
    if (this.live && last) this.link.ask({ step: count });
    else this.scrub(count);
  }

  choosing() {
    const dialog = find("gallery");
    find("choose").addEventListener("click", () => {
      dialog.replaceChildren(this.closer(dialog), ...this.entries.map((entry) => this.card(entry, dialog)));
      dialog.showModal();
    });
    dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  }

  closer(dialog) {
    const button = element("button", "✕", "close");
    button.setAttribute("aria-label", "close");
    button.addEventListener("click", () => dialog.close());
    return button;
  }

  card({ name, title, about }, dialog) {
    const card = element("button", "", "card");
    card.append(element("strong", title), element("span", about));
    card.addEventListener("click", () => {
      dialog.close();
      this.link.ask({ open: name });
    });
    return card;
  }

  // A second scheme, which differs in one value, runs beside the first.
  offerSecond() {
    const choices = (this.listed ?? []).filter((c) => ["choice", "number"].includes(c.form) && COMPARED.test(c.path));
    const [path, value] = Object.entries(this.state.second ?? {})[0] ?? ["", null];
    const key = JSON.stringify([this.live, choices.map((c) => c.path), path, value]);
    if (key === this.secondKey) return;
    this.secondKey = key;
    this.secondGui?.destroy();
    this.secondGui = null;
    if (!this.live) return;
    const gui = (this.secondGui = new GUI({ container: this.top, title: "second scheme", injectStyles: false }));
    const chosen = { path: path || "none", value };
    gui.add(chosen, "path", ["none", ...choices.map((c) => c.path)]).name("differs in").onChange((name) => {
      const control = choices.find((c) => c.path === name);
      this.link.ask({ second: control ? [name, otherValue(control)] : null });
    });
    const control = choices.find((c) => c.path === path);
    if (!control) return;
    const row = control.options.length
      ? gui.add(chosen, "value", control.options)
      : gui.add(chosen, "value", control.low ?? 0, control.high ?? 1);
    row.name("is").onFinishChange((next) => this.link.ask({ second: [path, next] }));
  }

  saving() {
    this.top = element("div", "", "top");
    const row = element("p", "", "files");
    for (const name of FILES) {
      const link = element("a", name);
      Object.assign(link, { href: `/download/${name}`, download: name });
      row.append(link);
    }
    const copy = element("button", "copy the Python");
    copy.addEventListener("click", async () => {
      const code = await (await fetch("/download/experiment.py")).text();
      await navigator.clipboard.writeText(code);
      copy.textContent = "copied";
      setTimeout(() => (copy.textContent = "copy the Python"), 1500);
    });
    row.append(copy);
    row.title = "The experiment with all changes, and its run from the start.";
    find("controls").append(this.top, row);
  }
}

// A list of controls with those that have changed.
function replaced(controls, changed) {
  const news = new Map(changed.map((control) => [control.path, control]));
  return controls.map((control) => news.get(control.path) ?? control);
}

// An initial value that differs from the first scheme.
function otherValue(control) {
  if (control.form === "number") return 2 * control.value || (control.high ?? 1) / 4;
  return control.options.find((option) => option !== control.value) ?? control.value;
}
