// The teach pendant: joints as sliders, the tool as a handle, and recorded poses to replay.

import { Link } from "./link.js";
import { listenForTime, offerSpeeds, showTime } from "./time.js";
import { unpack } from "./unpack.js";
import { THREE, TransformControls } from "./vendor.js";
import { element, find } from "./view.js";

const REPLAY_SPEEDS = [0.25, 0.5, 1, 2, 4, 8];
const DRAG_PAUSE = 40; // milliseconds between messages of a drag
const SETTLING = 600; // milliseconds after the last move of a slider until it shows the value in effect
const LARGEST_FILE = 60_000; // characters; a message has at most 64 KiB
const PENDANT_FILES = ["experiment.toml", "experiment.py", "poses.csv"];
const POSE_NUMBERS = [["x", "cm"], ["y", "cm"], ["z", "cm"], ["roll", "deg"], ["pitch", "deg"], ["yaw", "deg"]];
const LEAD_NAMES = { pose: "whole pose", pointing: "position and z axis", position: "position only" };
const PENDANT_KEYS = [
  ["t, r", "move, turn the tool"], ["x", "axes of the base or of the tool"], ["p", "record the pose"], ["space", "replay, pause"],
  ["Esc", "end of the replay"], ["Ctrl+Z, Ctrl+Y", "undo, redo"], ["h", "reset the view"],
];

export class Pendant {
  constructor(view, clock) {
    Object.assign(this, { view, clock, strokes: 0, page: Math.random().toString(36).slice(2), sent: 0 });
    document.body.classList.add("pendant");
    this.link = new Link((message) => this.hear(message), (there) => this.tellThere(there), (error) => {
      this.tellNote(`Internal error of this page: ${error.message}`);
      console.error(error);
    });
    this.timeOfReplay();
    this.listenForPendantKeys();
    window.robsim = this;
  }

  hear(message) {
    const done = {
      pendant: () => this.build(message),
      recording: () => this.collect(message, (whole) => this.showRobot(whole)),
      poses: () => this.listPoses(message),
      pose: () => this.place(message),
      replay: () => this.collect(message, (whole) => this.replay(whole)),
    }[message.type];
    if (done) return done();
    this.tellNote(message.error ?? "");
    return undefined;
  }

  // A recording arrives in parts; a page that lacks the first parts ignores the others.
  collect({ type, recording, part, parts }, show) {
    const before = part ? this.arrived?.[type] : [];
    if (before?.length !== part) return undefined;
    this.arrived = { ...this.arrived, [type]: [...before, recording] };
    return part === parts - 1 ? show(this.arrived[type].join("")) : undefined;
  }

  // The robot and its frames, which are sent first, and again after a lost connection.
  async showRobot(recording) {
    this.still = await unpack(recording);
    this.shown = false;
    this.endReplay();
    if (this.view.space.scene && !this.hand) this.hand = new ToolHandle(this.view.space, (pose, first) => this.drag(pose, first));
    this.tellMode();
    this.moveRobot();
    document.body.dataset.ready = "yes";
  }

  build(robot) {
    this.robot = robot;
    find("controls").hidden = false;
    find("controls").replaceChildren(this.jointPanel(robot));
    this.panels = element("div", "", "pendant-panels");
    this.panels.append(this.toolPanel(robot), this.posePanel(), keyPanel());
    find("side").querySelector(".pendant-panels")?.remove();
    find("side").prepend(this.panels);
  }

  jointPanel({ joints, coupled, remark }) {
    const panel = element("section", "", "joints");
    const bar = element("div", "", "buttons");
    this.undoButton = pressable("undo", () => this.link.ask({ undo: true }), "Ctrl+Z");
    this.redoButton = pressable("redo", () => this.link.ask({ redo: true }), "Ctrl+Y");
    bar.append(pressable("home", () => this.link.ask({ home: true })), this.undoButton, this.redoButton);
    panel.append(element("h2", "Joints"), bar);
    this.rows = joints.map((joint, i) => new JointRow(joint, (value, stroke) => this.setJoint(i, value, stroke)));
    panel.append(...this.rows.map((row) => row.box));
    if (!joints.length) panel.append(element("p", "This robot has no joint that moves.", "remark"));
    if (coupled.length) {
      panel.append(element("h2", "Coupled joints"));
      for (const { name, relation } of coupled) panel.append(element("p", `${name}: ${relation}`, "remark"));
    }
    if (remark) panel.append(element("p", remark, "remark"));
    return panel;
  }

  setJoint(index, value, stroke) {
    this.endReplay();
    this.asked = stroke ? null : this.rows[index];
    this.link.ask({ joint: [index, value, stroke && `${this.page} ${stroke}`] });
  }

  toolPanel({ links, leads }) {
    const panel = element("section", "", "tool");
    const pick = chooser(links, links, (name) => this.link.ask({ link: name }), "frame of the tool");
    const lead = chooser(leads, leads.map((name) => LEAD_NAMES[name]), (name) => this.link.ask({ lead: name }), "parts that follow the handle");
    this.chosen = { link: pick, lead };
    this.modes = ["translate", "rotate"].map((mode, i) => pressable(["move", "turn"][i], () => this.setMode(mode), "tr"[i]));
    this.axes = pressable("axes of the base", () => this.turnAxes(), "x");
    const modes = element("div", "", "buttons");
    modes.append(...this.modes, this.axes);
    this.fields = POSE_NUMBERS.map(([name, unit], i) => {
      const field = new JointField(name, unit, (value) => this.type(i, value));
      return field;
    });
    const numbers = element("div", "", "pose-numbers");
    numbers.append(...this.fields.map((field) => field.box));
    this.quaternion = element("p", "", "remark numbers");
    this.reason = element("p", "", "reason");
    this.condition = element("p", "", "remark");
    const copy = pressable("copy", () => this.copyPose(copy));
    const last = element("div", "", "buttons");
    last.append(copy);
    panel.append(element("h2", "Tool"), labelledRow("frame", pick), labelledRow("follows", lead), modes, numbers, this.reason, this.quaternion, this.condition, last);
    return panel;
  }

  type(index, value) {
    this.endReplay();
    this.asked = this.fields[index];
    this.link.ask({ tool: [index, value] });
  }

  async copyPose(button) {
    const { position, quaternion } = this.now.tool;
    const list = (numbers, places) => `[${numbers.map((x) => Number(x.toFixed(places))).join(", ")}]`;
    await navigator.clipboard.writeText(`Pose.from_quaternion(${list(position.map((x) => x / 100), 6)}, ${list(quaternion, 9)})`);
    button.textContent = "copied";
    setTimeout(() => (button.textContent = "copy"), 1500);
  }

  setMode(mode) {
    this.hand?.setMode(mode);
    this.tellMode();
  }

  turnAxes() {
    this.hand?.turnAxes();
    this.tellMode();
  }

  tellMode() {
    if (!this.hand) return;
    ["translate", "rotate"].forEach((mode, i) => this.modes[i].setAttribute("aria-pressed", this.hand.control.mode === mode));
    this.axes.textContent = this.hand.control.space === "local" ? "axes of the tool" : "axes of the base";
  }

  posePanel() {
    const panel = element("section", "", "poses");
    this.list = element("ol", "", "recorded");
    this.empty = element("p", "Move the robot, then record its pose. The replay drives from home through all poses.", "remark");
    this.recordButton = pressable("● record", () => this.link.ask({ record: true }), "p");
    this.replayButton = pressable("▶ replay", () => this.askReplay(), "space");
    const bar = element("div", "", "buttons");
    bar.append(this.recordButton, this.replayButton, this.opener());
    this.files = element("p", "save ", "files");
    for (const name of PENDANT_FILES) {
      const link = element("a", name);
      Object.assign(link, { href: `/download/${name}`, download: "" });
      this.files.append(link);
    }
    panel.append(element("h2", "Recorded poses"), bar, this.empty, this.list, this.pacePanel(), this.files);
    return panel;
  }

  // A button that loads the poses of a file poses.csv.
  opener() {
    const input = Object.assign(element("input"), { type: "file", accept: ".csv", hidden: true });
    input.setAttribute("aria-label", "file of poses");
    input.addEventListener("change", async () => {
      const text = await input.files[0]?.text();
      input.value = "";
      if (text?.length > LARGEST_FILE) this.tellNote("This file is too large for a list of poses.");
      else if (text !== undefined) this.link.ask({ load: text });
    });
    const button = pressable("load …", () => input.click(), "poses of a file poses.csv");
    button.append(input);
    return button;
  }

  pacePanel() {
    this.speed = Object.assign(element("input"), { type: "range", min: 5, max: 100, step: 5 });
    this.speed.setAttribute("aria-label", "speed in percent");
    this.percent = element("span", "", "numbers");
    this.seconds = Object.assign(element("input"), { type: "number", min: 0.1, step: 0.1, placeholder: "by speed" });
    this.seconds.setAttribute("aria-label", "seconds per motion");
    const send = () => this.link.ask({ pace: [this.speed.value / 100, this.seconds.value ? Number(this.seconds.value) : null] });
    this.speed.addEventListener("input", () => (this.percent.textContent = `${this.speed.value} %`));
    for (const each of [this.speed, this.seconds]) each.addEventListener("change", send);
    const panel = element("div", "", "pace");
    panel.append(labelledRow("speed", this.speed, this.percent), labelledRow("seconds per motion", this.seconds));
    return panel;
  }

  listPoses({ names, poses }) {
    this.count = poses.length;
    this.empty.hidden = poses.length > 0;
    this.files.hidden = this.replayButton.disabled = poses.length === 0;
    this.list.replaceChildren(...poses.map((pose, i) => this.poseItem(pose, i, names)));
  }

  poseItem({ name, values }, i, names) {
    const item = element("li");
    const title = Object.assign(element("input"), { value: name, maxLength: 64 });
    title.setAttribute("aria-label", `name of pose ${i + 1}`);
    title.addEventListener("change", () => this.link.ask({ rename: [i, title.value] }));
    const ask = (sign, label, wish, off) => {
      const button = pressable(sign, () => (this.endReplay(), this.link.ask(wish)), label);
      button.setAttribute("aria-label", `${label}: ${name}`);
      button.disabled = Boolean(off);
      return button;
    };
    const bar = element("div", "", "pose-bar");
    bar.append(
      title, ask("go", "go to", { go: i }), ask("↑", "earlier", { reorder: [i, i - 1] }, i === 0),
      ask("↓", "later", { reorder: [i, i + 1] }, i === this.count - 1), ask("✕", "remove", { remove: i }),
    );
    const numbers = element("p", values.map((x) => Number(x.toFixed(1))).join("  "), "remark numbers");
    numbers.title = names.map((each, j) => `${each} ${values[j].toFixed(3)}`).join("\n");
    item.append(bar, numbers);
    return item;
  }

  // Show the present coordinates, unless a replay is shown.
  place(now) {
    this.now = now;
    this.rows.forEach((row, i) => row.renew(now.joints[i], now.limits[i]));
    const tool = [...now.tool.position, ...now.tool.rpy];
    this.fields.forEach((field, i) => field.renew(tool[i]));
    this.quaternion.textContent = `quaternion x y z w: ${now.tool.quaternion.map((x) => x.toFixed(4)).join("  ")}`;
    this.condition.textContent = `condition of the Jacobian: ${now.condition === null ? "infinite, a singular pose" : now.condition.toPrecision(3)}`;
    this.reason.textContent = now.reach;
    this.undoButton.disabled = !now.undo;
    this.redoButton.disabled = !now.redo;
    this.chosen.link.value = now.link;
    this.chosen.lead.value = now.lead;
    this.takePace(now.pace);
    this.tellNote(now.note || (this.replaying ? "" : now.reach));
    this.asked?.refuse(now.note);
    this.asked = now.note ? this.asked : null;
    if (this.still && !this.replaying) this.moveRobot();
  }

  takePace([speed, duration]) {
    if (document.activeElement === this.speed || document.activeElement === this.seconds) return;
    this.speed.value = Math.round(100 * speed);
    this.percent.textContent = `${this.speed.value} %`;
    this.speed.disabled = duration !== null;
    this.seconds.value = duration ?? "";
  }

  moveRobot() {
    const { now, view } = this;
    const { values } = this.still.arrays.poses;
    if (!now || values.length !== now.frames.length) return;
    values.set(now.frames);
    view.space.place(0);
    this.hand?.renew(now);
  }

  drag(pose, first) {
    if (first) this.strokes++;
    this.asked = null;
    this.link.ask({ drag: [pose, `${this.page} hand ${this.strokes}`] });
  }

  askReplay() {
    if (this.replaying) return this.clock.toggle();
    if (!this.count) return this.tellNote("no pose is recorded yet");
    this.tellNote("simulating the motion …");
    return this.link.ask({ replay: true });
  }

  async replay(recording) {
    const { header, arrays } = await unpack(recording);
    this.replaying = true;
    document.body.classList.add("replay");
    this.hand?.show(false);
    this.load({ header: { ...header, title: this.robot.title }, arrays });
    this.legs = header.events;
    this.tellNote("");
    this.clock.seek(0);
    if (!this.clock.playing) this.clock.toggle();
  }

  endReplay() {
    if (!this.still) return;
    const was = this.replaying;
    this.replaying = false;
    this.clock.playing = false;
    document.body.classList.remove("replay");
    if (was || !this.shown) this.load(this.still);
    this.shown = true;
    find("outcome").textContent = "";
    this.hand?.show(true);
    this.moveRobot();
  }

  load({ header, arrays }) {
    this.view.load({ ...header, texts: {} }, arrays);
  }

  timeOfReplay() {
    const { clock } = this;
    listenForTime(clock, () => clock.toggle(), (count) => clock.step(count));
    offerSpeeds(REPLAY_SPEEDS, (speed) => (clock.speed = speed));
    const back = pressable("back to teaching", () => this.endReplay(), "Esc");
    back.id = "teach";
    document.querySelector("footer").append(back);
    clock.listen(() => {
      showTime(clock, clock.playing);
      if (!this.replaying) return;
      const leg = this.legs?.filter(({ time }) => time <= clock.seconds + 1e-9).at(-1);
      find("outcome").textContent = leg ? `→ ${leg.text}` : "";
    });
  }

  listenForPendantKeys() {
    document.addEventListener("keydown", (event) => {
      if (event.target.closest("select, textarea, input:not([type=range])")) return;
      if (event.key === " " && event.target.closest("summary, button")) return; // the key presses it
      const command = event.ctrlKey || event.metaKey ? "ctrl " : "";
      const action = {
        t: () => this.setMode("translate"), r: () => this.setMode("rotate"), x: () => this.turnAxes(),
        p: () => this.link.ask({ record: true }), " ": () => this.askReplay(), Escape: () => this.endReplay(),
        h: () => this.view.space.home(), "ctrl z": () => this.link.ask(event.shiftKey ? { redo: true } : { undo: true }),
        "ctrl y": () => this.link.ask({ redo: true }),
      }[command + (event.key.length === 1 ? event.key.toLowerCase() : event.key)];
      if (!action || event.altKey) return;
      action();
      event.preventDefault();
    });
  }

  tellNote(text) {
    find("note").hidden = !text;
    find("note").textContent = text;
  }

  tellThere(there) {
    const problem = find("problem");
    problem.hidden = there;
    problem.textContent = "The studio does not answer. If it was restarted, open the new address that it printed.";
    document.body.classList.toggle("alone", !there);
  }
}

// The handle of the tool, and the axes of a requested pose that the tool does not reach.
class ToolHandle {
  constructor(space, moved) {
    Object.assign(this, { space, moved, sent: 0 });
    this.hand = new THREE.Group();
    this.ghost = new THREE.Group();
    const size = space.extent() * 0.12;
    this.ghost.add(new THREE.AxesHelper(size), ball(size * 0.18));
    this.gap = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineDashedMaterial({ color: "#d55e00", dashSize: size / 6, gapSize: size / 10 }));
    this.gap.frustumCulled = false;
    space.scene.add(this.hand, this.ghost, this.gap);
    this.control = new TransformControls(space.camera, space.renderer.domElement);
    this.control.setSize(0.9);
    this.control.attach(this.hand);
    space.scene.add(this.control.getHelper());
    this.control.addEventListener("change", () => (space.dirty = true));
    this.control.addEventListener("dragging-changed", ({ value }) => this.held(value));
    this.control.addEventListener("objectChange", () => this.send(false));
    this.show(true);
  }

  held(holding) {
    this.space.controls.enabled = !holding;
    if (holding) this.begun = true;
    else this.send(true);
  }

  send(last) {
    const now = performance.now();
    if (!last && now - this.sent < DRAG_PAUSE) return;
    this.sent = now;
    this.moved([...this.hand.position.toArray(), ...this.hand.quaternion.toArray()], this.begun);
    this.begun = false;
  }

  // Follow the tool; while the handle is held, it stays at the pointer.
  renew({ handle, requested }) {
    const off = this.ghost.visible = this.gap.visible = Boolean(requested) && this.shown;
    if (!this.control.dragging) putAt(this.hand, handle);
    if (off) {
      putAt(this.ghost, requested);
      this.gap.geometry.setFromPoints([handle, requested].map((pose) => new THREE.Vector3().fromArray(pose)));
      this.gap.computeLineDistances();
    }
    this.space.dirty = true;
  }

  setMode(mode) {
    this.control.setMode(mode);
    this.space.dirty = true;
  }

  turnAxes() {
    this.control.setSpace(this.control.space === "local" ? "world" : "local");
    this.space.dirty = true;
  }

  show(shown) {
    this.shown = shown;
    this.control.enabled = shown;
    this.control.getHelper().visible = shown;
    if (!shown) this.ghost.visible = this.gap.visible = false;
    this.space.dirty = true;
  }
}

// A joint: its slider between the numbers of its limits, and its value to type.
class JointRow {
  constructor({ name, unit, low, high, ends }, set) {
    Object.assign(this, { name, unit, set });
    this.box = element("div", "", "joint");
    const head = element("div", "", "joint-head");
    this.mark = element("span", "", "at-limit");
    this.field = new JointField("", unit, (value) => this.set(value, null), `${name} in ${unit}`);
    const label = element("label", name);
    label.title = name;
    head.append(label, this.mark, this.field.box);
    this.box.append(head);
    if (!unit) {
      this.field.input.disabled = true;
      return;
    }
    this.slider = Object.assign(element("input"), { type: "range", min: ends[0], max: ends[1], step: "any" });
    this.slider.setAttribute("aria-label", name);
    this.slider.addEventListener("pointerdown", () => this.begin());
    this.slider.addEventListener("keydown", (event) => this.press(event, ends));
    this.slider.addEventListener("input", () => this.slide(ends));
    const track = element("div", "", "track");
    const end = (value) => element("span", value === null ? "∞" : String(Number(value.toFixed(1))), "end");
    const left = end(low);
    if (low === null) left.textContent = "−∞";
    track.append(left, this.slider, end(high));
    this.box.append(track);
  }

  begin() {
    this.stroke = `${this.name} ${performance.now()}`;
  }

  // Move by one unit for each arrow key, by ten with Shift.
  press(event, [low, high]) {
    const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!event.repeat) this.begin();
    if (!step) return;
    event.preventDefault();
    const value = Number(this.slider.value) + step * (event.shiftKey ? 10 : 1);
    this.slider.value = Math.min(Math.max(value, low), high);
    this.slide([low, high]);
  }

  // Send a value of the slider, rounded to 0.1 unless the slider is at an end.
  slide([low, high]) {
    const value = Number(this.slider.value);
    this.moved = performance.now();
    const near = [low, high].find((end) => Math.abs(end - value) < 0.05);
    this.set(near ?? Math.round(10 * value) / 10, this.stroke ?? this.name);
  }

  renew(value, side) {
    this.field.renew(value);
    this.value = value;
    if (this.slider) this.settle();
    this.mark.textContent = side ? "at limit" : "";
    for (const each of ["low", "high"]) this.box.classList.toggle(each, side === each);
  }

  // Show the value in effect; a slider under the hand does not jump back to an earlier value.
  settle() {
    clearTimeout(this.settling);
    const left = SETTLING - (performance.now() - (this.moved ?? -Infinity));
    if (left <= 0) this.slider.value = this.value;
    else this.settling = setTimeout(() => this.settle(), left);
  }

  refuse(text) {
    this.field.refuse(text);
  }
}

// A number with its unit; a typed value is replaced by the value in effect.
class JointField {
  constructor(name, unit, set, label = `${name} in ${unit}`) {
    this.box = element("label", "", "number-field");
    this.input = Object.assign(element("input"), { type: "number", step: "any" });
    this.input.setAttribute("aria-label", label);
    this.input.addEventListener("input", () => (this.typing = true));
    this.input.addEventListener("change", () => {
      this.typing = false;
      if (Number.isFinite(this.input.valueAsNumber)) set(this.input.valueAsNumber);
      else this.renew(this.value);
    });
    if (name) this.box.append(element("span", name));
    this.box.append(this.input, element("span", unit, "unit"));
  }

  renew(value) {
    this.value = value;
    this.refuse("");
    if (!this.typing) this.input.value = Number(value.toFixed(2));
  }

  refuse(text) {
    this.input.title = text;
    this.box.classList.toggle("refused", Boolean(text));
  }
}

function pressable(text, action, key = "") {
  const button = element("button", text);
  Object.assign(button, { type: "button", title: key });
  button.addEventListener("click", action);
  return button;
}

function chooser(values, names, changed, label) {
  const select = element("select");
  values.forEach((value, i) => select.add(new Option(names[i], value)));
  select.setAttribute("aria-label", label);
  select.addEventListener("change", () => changed(select.value));
  return select;
}

function labelledRow(text, ...fields) {
  const row = element("div", "", "labelled");
  row.append(element("span", text), ...fields);
  return row;
}

function keyPanel() {
  const details = element("details");
  details.append(element("summary", "keys"));
  for (const [key, meaning] of PENDANT_KEYS) details.append(element("p", `${key}: ${meaning}`, "remark"));
  return details;
}

function ball(radius) {
  const material = new THREE.MeshBasicMaterial({ color: "#d55e00", transparent: true, opacity: 0.5 });
  return new THREE.Mesh(new THREE.SphereGeometry(radius, 16, 12), material);
}

function putAt(node, pose) {
  node.position.fromArray(pose);
  node.quaternion.fromArray(pose, 3);
}
