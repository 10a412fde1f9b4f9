// The page of a studio: it shows the messages of the simulation, and sends the user's requests.

import { GUI } from "./vendor.js";
import { Bar } from "./bar.js";
import { Controls, fieldOf } from "./controls.js";
import { Gallery } from "./gallery.js";
import { Handles } from "./handles.js";
import { listenForKeys } from "./keys.js";
import { Link } from "./link.js";
import { MatrixPanel } from "./matrix.js";
import { distanceText } from "./quantities.js";
import { StudyMap } from "./study.js";
import { listenForTime, offerSpeeds, showTime } from "./time.js";
import { unpack } from "./unpack.js";
import { element, find } from "./view.js";

const FASTNESS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 0]; // 0: maximum speed
const COMPARED = /^(task|sensing|actuation|belief\.cameras)\./; // values in which two schemes may differ
const FLASH = 5000; // milliseconds that a page shows why a run started over

export class Studio {
  constructor(view, clock) {
    Object.assign(this, { view, clock, state: {}, live: true, stroke: null });
    this.listenForStrokes();
    for (const id of ["controls", "choose", "reset", "step"]) find(id).hidden = false;
    document.body.classList.add("studio");
    const ask = (request) => this.link.ask(request);
    this.bar = new Bar(find("bar"), ask);
    find("controls").append((this.top = element("div", "", "top")));
    this.controls = new Controls(find("controls"), (path, value) => {
      if (path === this.askedSecond) this.askedSecond = undefined;
      ask({ set: [path, value, this.stroke] });
    });
    view.acting.told = (states) => this.controls.light(states);
    if (view.space.scene) this.handles = new Handles(view.space, (name, pose) => ask({ drag: [name, pose, this.stroke] }));
    view.why.ask = (request) => (this.live || !("reset" in request || "play" in request)) && ask(request); // a mission runs at once
    view.askForPicture = ask;
    this.matrix = new MatrixPanel(clock, ask);
    this.timeControls();
    this.gallery = new Gallery(find("gallery"), find("choose"), (name) => ask({ open: name }));
    clock.following = true;
    this.link = new Link((message) => this.hear(message), (there) => this.tellThere(there), (error) => {
      this.tellNote(`Internal error of this page: ${error.message}`);
      console.error(error);
    });
    window.robsim = this;
  }

  // While a pointer is pressed, all changes of a value belong to one stroke, which one undo takes back.
  listenForStrokes() {
    const page = Math.random().toString(36).slice(2);
    let strokes = 0;
    window.addEventListener("pointerdown", () => (this.stroke = `${page} ${++strokes}`), true);
    for (const end of ["pointerup", "pointercancel"]) window.addEventListener(end, () => (this.stroke = null));
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
      gallery: () => this.gallery.take(message.entries),
      texts: () => this.view.tellTexts(message.texts, message.why),
      state: () => this.tell(message),
      interaction: () => this.matrix.tell(message),
      picture: () => void this.view.layers.get(message.camera)?.hear?.(message), // other messages do not wait for it
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
    this.matrix.renew();
    this.offerSecond();
  }

  tell(state) {
    this.state = state;
    this.tellRun(state);
    this.tellRefusals(state);
    this.bar.tell({ ...state, live: this.live });
    this.tellRestart(state);
    this.tellRest(state);
    this.tellDistance(state);
    this.view.why.mark(state.second);
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

  // Each handled request ends the wait of the fields: they show the values in effect, and the reasons of refusals.
  // The note has the reasons that no field shows.
  tellRefusals({ note, requests, refusals = [] }) {
    const handled = requests !== this.requests;
    this.requests = requests;
    const shown = this.controls.refuse(refusals.filter((each) => each.path !== this.askedSecond));
    const refused = refusals.find((each) => each.path === this.askedSecond);
    const second = this.secondValue ?? this.second;
    second?.tell(refused?.reason ?? "");
    if (second && refused) shown.push(refused);
    this.tellNote(shown.reduce((rest, { path, reason }) => withoutReason(rest, path, reason), note));
    if (!handled) return;
    for (const each of [this.controls, this.second, this.secondValue]) each?.settle();
  }

  // Flash the reason why the run started over because of a change.
  tellRestart({ restarts = 0, restarted_because: reason }) {
    const grown = this.restarts !== undefined && restarts > this.restarts;
    this.restarts = restarts;
    if (!grown) return;
    find("flash").textContent = `started over: ${reason}`;
    find("flash").hidden = false;
    clearTimeout(this.flashing);
    this.flashing = setTimeout(() => (find("flash").hidden = true), FLASH);
  }

  tellRest({ resting = false }) {
    const text = resting ? "converged: drag the target, or change a value" : "";
    find("resting").hidden = !text;
    if (find("resting").textContent !== text) find("resting").textContent = text;
  }

  tellDistance({ distance = null, missed = false }) {
    find("distance").textContent = this.live && distance ? `${distanceText(distance)} from the goal` : "";
    find("distance").title = distance?.frame ? `of ${distance.frame}` : "";
    document.body.classList.toggle("missed", this.live && missed);
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
    this.keys(toggle, scrub);
  }

  keys(toggle, scrub) {
    const ask = (request) => this.link.ask(request);
    listenForKeys([
      { keys: [" "], words: "play or pause", act: toggle },
      { keys: ["ArrowRight"], words: "one step, with shift ten", act: (leap) => this.step(leap) },
      { keys: ["ArrowLeft"], words: "look back by one instant, with shift ten", act: (leap) => scrub(-leap) },
      { keys: ["Home"], words: "look at the first instant", act: () => scrub(-Infinity) },
      { keys: ["End"], words: "follow the last instant", act: () => scrub(Infinity) },
      { keys: ["r"], words: "back to the start", act: () => this.reset() },
      { keys: ["h"], words: "reset the view of the scene", act: () => this.view.space.home() },
      { keys: ["p"], words: "marks, picture or difference in the images", act: () => this.view.choice.turn(this.view.header.cameras) },
      { keys: ["m"], words: "show the interaction matrix of the instant", act: () => this.matrix.toggle() },
      { keys: ["g"], words: "show the goal anew", act: () => this.bar.anew.click() },
      { keys: ["ctrl+z"], words: "undo", act: () => ask({ undo: true }) },
      { keys: ["ctrl+shift+z", "ctrl+y"], words: "redo", act: () => ask({ redo: true }) },
    ]);
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

  // A second scheme, which differs in one value, runs beside the first.
  offerSecond() {
    const choices = (this.listed ?? []).filter((c) => ["choice", "number"].includes(c.form) && COMPARED.test(c.path));
    const [path, value] = Object.entries(this.state.second ?? {})[0] ?? ["", null];
    const key = JSON.stringify([this.live, choices.map((c) => c.path), path]);
    if (key !== this.secondKey) this.buildSecond(key, choices, path, value);
    if (value !== this.secondShown) this.secondValue?.take(value);
    this.secondShown = value;
  }

  buildSecond(key, choices, path, value) {
    this.secondKey = key;
    this.secondGui?.destroy();
    [this.secondGui, this.second, this.secondValue] = [null, null, null];
    if (!this.live) return;
    const gui = (this.secondGui = new GUI({ container: this.top, title: "second scheme", injectStyles: false }));
    const differing = { form: "choice", value: path || "none", options: ["none", ...choices.map((c) => c.path)], unit: "" };
    this.second = fieldOf(gui, differing, "differs in", (name) => {
      const control = choices.find((c) => c.path === name);
      this.askSecond(control ? [name, otherValue(control)] : null);
    });
    const control = choices.find((c) => c.path === path);
    if (!control) return;
    this.secondValue = fieldOf(gui, { ...control, value }, "is", (next) => this.askSecond([path, next]));
  }

  askSecond(second) {
    this.askedSecond = second?.[0];
    this.link.ask({ second });
  }
}

// A note without the reason of a refusal, which may begin with the path.
function withoutReason(note, path, reason) {
  return note === reason ? "" : note.replace(`${path}: ${reason}`, "").trim();
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
