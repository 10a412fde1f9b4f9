// Handles in the scene, which the user drags to place a body.

import { THREE, GUI, TransformControls } from "./vendor.js";
import { find, hasRoom } from "./view.js";

const COLORS = { start: "#5d5d5d", goal: "#d6007a" };
const OWN = "#0072b2";
const PUSHED = "#d55e00"; // bodies that a robot carries
const INTERVAL = 40; // least milliseconds between messages of a drag
const PATIENCE = 80; // milliseconds that a slow machine waits for the reply before it draws the handle alone

export class Handles {
  constructor(space, drag) {
    Object.assign(this, { space, drag, balls: new Map(), sent: 0 });
    this.group = new THREE.Group();
    space.scene.add(this.group);
    this.tool = new TransformControls(space.camera, space.renderer.domElement);
    this.tool.setSize(0.7);
    space.scene.add(this.tool.getHelper());
    this.tool.addEventListener("change", () => (space.dirty = true));
    this.tool.addEventListener("dragging-changed", (event) => {
      space.controls.enabled = !event.value;
      if (!event.value) this.send();
    });
    this.tool.addEventListener("objectChange", () => this.sendLater());
    space.renderer.domElement.addEventListener("pointerdown", (event) => (this.down = [event.clientX, event.clientY]));
    space.renderer.domElement.addEventListener("pointerup", (event) => this.clicked(event));
    space.renderer.domElement.addEventListener("pointermove", (event) => event.buttons || this.nameBody(event));
    this.choice = { held: "none", turn: false };
    space.placed = () => this.follow();
  }

  // Show handles {name, frame, pose, carried}; a handle stays at the pointer while it is dragged.
  renew(handles) {
    this.carried = handles.filter((handle) => handle.carried);
    this.labels = new Map(handles.map((handle) => [handle.name, labelOf(handle)]));
    const names = new Set(handles.map((handle) => handle.name));
    for (const [name, ball] of this.balls)
      if (!names.has(name)) {
        if (this.choice.held === name) this.hold("none");
        this.group.remove(ball);
        this.balls.delete(name);
      }
    for (const { name, pose, carried } of handles) {
      const ball = this.balls.get(name) ?? this.add(name, carried);
      ball.scale.setScalar(this.space.extent() * 0.018);
      if (carried || this.isDragged(name)) continue;
      ball.position.fromArray(pose);
      ball.quaternion.fromArray(pose, 3);
    }
    this.follow();
    const key = [...names].join();
    if (this.key !== key) this.offer(key);
    this.space.dirty = true;
  }

  isDragged(name) {
    return this.tool.dragging && this.choice.held === name;
  }

  // Place the handles of the bodies that robots carry at these bodies.
  follow() {
    for (const { name, frame, pose } of this.carried ?? []) {
      const ball = this.balls.get(name);
      if (!ball || this.isDragged(name)) continue;
      const index = this.space.header?.frames.findIndex((each) => each.name === frame && each.group === "true");
      const body = this.space.frames?.[index];
      ball.position.fromArray(body ? body.position.toArray() : pose);
      ball.quaternion.fromArray(body ? body.quaternion.toArray() : pose.slice(3));
    }
  }

  add(name, carried) {
    const color = carried ? PUSHED : (COLORS[name] ?? OWN);
    const material = new THREE.MeshBasicMaterial({ color, transparent: true, opacity: 0.55, depthTest: false });
    const ball = new THREE.Mesh(new THREE.SphereGeometry(1, 16, 12), material);
    ball.renderOrder = 5;
    ball.name = name;
    this.group.add(ball);
    this.balls.set(name, ball);
    return ball;
  }

  offer(key) {
    this.key = key;
    const open = this.gui ? !this.gui._closed : hasRoom();
    this.gui?.destroy();
    if (!this.balls.size) return;
    this.gui = new GUI({ container: find("dragging"), title: "move a body", injectStyles: false });
    const names = Object.fromEntries(["none", ...this.balls.keys()].map((name) => [this.labels.get(name) ?? name, name]));
    this.picker = this.gui.add(this.choice, "held", names).name("body").onChange((name) => this.hold(name));
    this.gui.add(this.choice, "turn").name("rotation").onChange(() => this.hold(this.choice.held));
    if (!open) this.gui.close();
  }

  hold(name) {
    this.choice.held = name;
    this.picker?.updateDisplay();
    const ball = this.balls.get(name);
    if (ball) this.tool.attach(ball);
    else this.tool.detach();
    this.tool.setMode(this.choice.turn ? "rotate" : "translate");
    this.space.dirty = true;
  }

  // Select the handle under a click, if there is one.
  clicked(event) {
    const still = this.down && Math.hypot(event.clientX - this.down[0], event.clientY - this.down[1]) < 4;
    const name = still && !this.tool.dragging && this.nameAt(event);
    if (name) this.hold(name);
  }

  // Show the name of the body whose handle is under the pointer.
  nameBody(event) {
    const canvas = this.space.renderer.domElement;
    const name = this.nameAt(event);
    const text = name ? `${this.labels.get(name)}: click, then drag the arrows` : "";
    if (canvas.title !== text) canvas.title = text;
    canvas.style.cursor = name ? "pointer" : "";
  }

  // The name of the handle under the pointer, if there is one.
  nameAt(event) {
    const box = this.space.renderer.domElement.getBoundingClientRect();
    const at = new THREE.Vector2(
      (2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height,
    );
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.space.camera);
    return ray.intersectObjects([...this.balls.values()])[0]?.object.name;
  }

  // Send the newest pose, now or once the interval has passed; poses in between are left out.
  sendLater() {
    const rest = INTERVAL - (performance.now() - this.sent);
    if (rest <= 0) this.send();
    else this.later ??= setTimeout(() => this.send(), rest);
  }

  send() {
    clearTimeout(this.later);
    this.later = undefined;
    const ball = this.balls.get(this.choice.held);
    if (!ball) return;
    this.sent = performance.now();
    this.space.awaited = this.sent + PATIENCE;
    this.drag(this.choice.held, [...ball.position.toArray(), ...ball.quaternion.toArray()]);
  }
}

// The body of a handle in words; a body that a robot carries moves the robot.
function labelOf({ name, frame, carried }) {
  if (name === "start" || name === "goal") return `${name} pose of ${frame}`;
  return carried ? `${frame}, with its robot` : frame;
}
