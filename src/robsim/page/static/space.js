// The scene in 3-D: solids, marks, trails and views on frames that move.

import { Pace } from "./pace.js";
import { Surface } from "./shading.js";
import { empty, geometryOf, linesOf, surface, wayOf } from "./solids.js";
import { THREE, OrbitControls } from "./vendor.js";

const GHOSTS = {
  true: { opacity: 1, lines: 0.55 },
  belief: { opacity: 0.22, lines: 0.9, tint: "#0072b2" },
  goal: { opacity: 0, lines: 1, dashed: true },
  start: { opacity: 0, lines: 0.6, dashed: true, tint: "#8c8c8c" },
  second: { opacity: 0.25, lines: 0.9, tint: "#e69f00" },
};
const FAR = 10; // the view follows a path longer than so many radii of the moving bodies
const VIEW = { elevation: 22, azimuth: -55 }; // degrees, as in the figures

const GROUPS = ["true", "belief", "second", "goal", "start", "trails", "views", "rays", "frames", "ground"];

export class Space {
  constructor(element) {
    this.shown = {
      belief: true, second: true, goal: true, start: false, trails: true, follow: false, views: true, rays: false, frames: false, ground: true,
    };
    this.renderer = new THREE.WebGLRenderer({ antialias: true });
    this.pace = new Pace();
    this.sharpen(1);
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    element.append(this.renderer.domElement);
    this.element = element;
    this.scene = new THREE.Scene();
    this.groups = {};
    for (const name of GROUPS) {
      this.groups[name] = new THREE.Group();
      this.scene.add(this.groups[name]);
    }
    this.sky = new THREE.Group(); // lights
    this.scene.add(this.sky);
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => (this.dirty = true));
    new ResizeObserver(() => this.resize()).observe(element);
    this.resize();
  }

  // Show a recording; with `keep` the view does not change.
  load(header, arrays, keep) {
    Object.assign(this, { header, arrays, bounds: null, size: null });
    this.shown.follow &&= keep;
    for (const group of [...Object.values(this.groups), this.sky]) empty(group);
    this.build();
    this.light();
    if (!keep) this.look();
    this.dirty = true;
  }

  build() {
    const { header } = this;
    this.frames = header.frames.map((frame) => {
      const node = new THREE.Group();
      node.name = frame.name;
      this.groups[frame.group].add(node);
      return node;
    });
    this.ways = [];
    this.moving = []; // rebuilt at each instant: lines from frame to frame
    for (const part of header.parts) this.addPart(part);
    for (const marks of header.marks) this.addMarks(marks);
    for (const camera of header.cameras) this.addView(camera);
    for (const trail of header.trails) this.addTrail(trail);
    this.extend(0);
    this.addAxes();
    this.place(0);
  }

  addPart(part) {
    const group = groupOf(this.header, part.frame);
    const look = GHOSTS[group];
    if ("to" in part) {
      this.addStick(part, group);
      return;
    }
    const node = this.frames[part.frame];
    const color = new THREE.Color(look.tint ?? part.color);
    const corners = this.arrays[part.triangles].values;
    const skin = new Surface(corners);
    if (corners.length && look.opacity) {
      const mesh = new THREE.Mesh(geometryOf(skin), surface(color, part.sheer ? 0.12 : look.opacity));
      mesh.castShadow = mesh.receiveShadow = group === "true" && !part.sheer;
      node.add(mesh);
    }
    const solid = group === "true" && corners.length && !part.sheer;
    const stroke = solid ? color.clone().multiplyScalar(0.35) : color;
    const edges = this.arrays[part.edges].values;
    node.add(linesOf(solid ? skin.seen(edges) : edges, stroke, look));
  }

  addStick(part, group) {
    const color = new THREE.Color(GHOSTS[group].tint ?? part.color);
    const line = linesOf(new Float32Array(6), color, { lines: 1 });
    line.frustumCulled = false;
    this.groups[group].add(line);
    this.moving.push(() => {
      const at = line.geometry.attributes.position;
      at.copyArray([...this.frames[part.frame].position, ...this.frames[part.to].position]);
      at.needsUpdate = true;
    });
  }

  addMarks(marks) {
    const points = this.arrays[marks.points].values;
    const size = this.extent() * 0.009;
    const ball = new THREE.SphereGeometry(size, 12, 8);
    marks.colors.forEach((color, i) => {
      const dot = new THREE.Mesh(ball, new THREE.MeshBasicMaterial({ color }));
      dot.position.fromArray(points, 3 * i);
      this.frames[marks.frame].add(dot);
    });
  }

  addView(camera) {
    const color = new THREE.Color("#6f6f6f");
    const node = new THREE.Group();
    node.add(linesOf(this.arrays[camera.frustum].values, color, { lines: 0.9 }));
    this.groups.views.add(node);
    this.moving.push(() => copyPose(node, this.frames[camera.frame]));
    for (const marks of this.header.marks) {
      const count = marks.colors.length;
      const rays = linesOf(new Float32Array(6 * count), color, { lines: 0.5 });
      rays.frustumCulled = false;
      this.groups.rays.add(rays);
      this.moving.push(() => this.castRays(rays, camera, marks));
    }
  }

  castRays(rays, camera, marks) {
    const at = rays.geometry.attributes.position;
    const eye = this.frames[camera.frame].position;
    const target = this.frames[marks.frame];
    const points = this.arrays[marks.points].values;
    const end = new THREE.Vector3();
    marks.colors.forEach((_, i) => {
      end.fromArray(points, 3 * i).applyQuaternion(target.quaternion).add(target.position);
      at.setXYZ(2 * i, eye.x, eye.y, eye.z);
      at.setXYZ(2 * i + 1, end.x, end.y, end.z);
    });
    at.needsUpdate = true;
  }

  addTrail(trail) {
    const lines = [wayOf(trail.color, 0.3), wayOf(trail.color, 1)]; // the whole path, and the path so far
    this.groups.trails.add(...lines);
    this.ways.push((from) => this.lay(lines, trail.frame, from));
    this.moving.push((index) => lines[1].geometry.setDrawRange(0, index + 1));
  }

  // Write the path of a frame into its lines, from an instant on.
  lay(lines, frame, from) {
    const { shape, values } = this.arrays.poses;
    let at = lines[0].geometry.attributes.position;
    if (!at || at.count < shape[0]) {
      const room = new Float32Array(3 * 2 * shape[0]);
      if (at) room.set(at.array);
      at = new THREE.BufferAttribute(room, 3);
      for (const line of lines) line.geometry.setAttribute("position", at);
    }
    for (let t = from; t < shape[0]; t++)
      for (let i = 0; i < 3; i++) at.array[3 * t + i] = values[(t * shape[1] + frame) * 7 + i];
    at.needsUpdate = true;
    lines[0].geometry.setDrawRange(0, shape[0]);
  }

  // Replace the poses from an instant on.
  extend(from) {
    for (const lay of this.ways) lay(from);
  }

  addAxes() {
    const size = this.extent() * 0.07;
    this.frames.forEach((frame, i) => {
      if (this.header.frames[i].group !== "true") return;
      const axes = new THREE.AxesHelper(size);
      axes.material.depthTest = false;
      const node = new THREE.Group();
      node.add(axes);
      this.groups.frames.add(node);
      this.moving.push(() => copyPose(node, frame));
    });
  }

  light() {
    const box = this.box();
    const size = this.extent();
    const centre = box.getCenter(new THREE.Vector3());
    this.sky.add(new THREE.HemisphereLight("#ffffff", "#b9b4ab", 2.0));
    const sun = new THREE.DirectionalLight("#ffffff", 2.2);
    sun.position.copy(centre).add(new THREE.Vector3(0.35, -0.55, 1.1).multiplyScalar(2 * size));
    sun.target.position.copy(centre);
    sun.castShadow = true;
    sun.shadow.mapSize.set(1024, 1024);
    Object.assign(sun.shadow.camera, { left: -size, right: size, top: size, bottom: -size, near: size / 100, far: 6 * size });
    sun.shadow.bias = -0.0005;
    sun.shadow.normalBias = size * 0.002;
    this.sky.add(sun, sun.target);
    this.addGround(box, size, centre);
  }

  addGround(box, size, centre) {
    const plane = new THREE.Mesh(new THREE.PlaneGeometry(6 * size, 6 * size), new THREE.ShadowMaterial({ opacity: 0.22 }));
    plane.receiveShadow = true;
    const step = 10 ** Math.floor(Math.log10(size / 2));
    const cells = 2 * Math.ceil((1.5 * size) / step);
    this.grid = new THREE.GridHelper(cells * step, cells, "#9a9a9a", "#c9c9c9");
    this.grid.rotateX(Math.PI / 2);
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.6;
    for (const each of [plane, this.grid]) {
      each.position.set(Math.round(centre.x / step) * step, Math.round(centre.y / step) * step, box.min.z - size * 0.002);
      this.groups.ground.add(each);
    }
    this.grid.position.z -= size * 0.001;
  }

  look() {
    const all = this.box().getBoundingSphere(new THREE.Sphere());
    const near = this.far();
    this.shown.follow = near !== null;
    const sphere = near ? new THREE.Sphere(near.center, 2.2 * near.radius) : all;
    this.camera.near = sphere.radius / 100;
    this.camera.far = all.radius * 60;
    this.camera.updateProjectionMatrix();
    this.sphere = sphere;
    this.home();
  }

  home() {
    const { sphere } = this;
    this.led = this.frames[this.header.trails[0]?.frame]?.position.clone();
    const e = (VIEW.elevation * Math.PI) / 180;
    const a = (VIEW.azimuth * Math.PI) / 180;
    const ahead = new THREE.Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e));
    const aspect = Math.min(this.camera.aspect || 1, 1);
    const away = (1.12 * sphere.radius) / Math.sin((this.camera.fov * Math.PI) / 360) / aspect;
    this.camera.position.copy(sphere.center).addScaledVector(ahead, away);
    this.controls.target.copy(sphere.center);
    this.controls.update();
    this.dirty = true;
  }

  // The box around the true bodies at the start and the end, and around the trails.
  box() {
    if (this.bounds) return this.bounds;
    this.bounds = new THREE.Box3(...this.header.reach.map((end) => new THREE.Vector3(...end)));
    const last = this.arrays.poses.shape[0] - 1;
    for (const index of [last, 0]) {
      this.place(index);
      this.scene.updateMatrixWorld(true);
      for (const name of ["true", "goal", "views", "trails"]) this.bounds.expandByObject(this.groups[name]);
    }
    if (this.bounds.getSize(new THREE.Vector3()).length() < 1e-6) this.bounds.set(new THREE.Vector3(-0.5, -0.5, 0), new THREE.Vector3(0.5, 0.5, 1));
    return this.bounds;
  }

  extent() {
    if (this.size) return this.size;
    const [low, high] = this.header.reach.map((end) => new THREE.Vector3(...end));
    const size = high.distanceTo(low);
    this.size = size > 1e-3 ? size : 1;
    return this.size;
  }

  place(index) {
    const { shape, values } = this.arrays.poses;
    this.frames?.forEach((frame, i) => {
      const at = (index * shape[1] + i) * 7;
      frame.position.fromArray(values, at);
      frame.quaternion.fromArray(values, at + 3);
    });
    for (const move of this.moving) move(index);
    if (this.shown.follow) this.follow();
    this.placed?.();
    this.dirty = true;
  }

  show(shown) {
    Object.assign(this.shown, shown);
    for (const [name, group] of Object.entries(this.groups)) group.visible = this.shown[name] ?? true;
    this.dirty = true;
  }

  // Let the view follow the body of the first trail.
  follow() {
    const led = this.frames[this.header.trails[0]?.frame];
    if (!led || !this.led) return;
    const step = led.position.clone().sub(this.led);
    this.led = led.position.clone();
    this.camera.position.add(step);
    this.controls.target.add(step);
    this.controls.update();
  }

  // The sphere around the body of the first trail, if its path is long beside its size; else null.
  far() {
    const { shape, values } = this.arrays.poses;
    const at = (index, frame) => new THREE.Vector3().fromArray(values, (index * shape[1] + frame) * 7);
    const gone = (frame) => at(0, frame).distanceTo(at(shape[0] - 1, frame));
    const way = this.header.trails.length ? gone(this.header.trails[0].frame) : 0;
    const box = new THREE.Box3();
    this.header.frames.forEach(({ group }, i) => group === "true" && gone(i) > way / 2 && box.expandByPoint(at(0, i)));
    const sphere = box.getBoundingSphere(new THREE.Sphere());
    return way > 0 && sphere.radius > 0 && way > FAR * sphere.radius ? sphere : null;
  }

  paint(background, dark) {
    this.scene.background = new THREE.Color(background);
    if (this.grid) this.grid.material.opacity = dark ? 0.15 : 0.6;
    this.dirty = true;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (!width || !height) return;
    const first = !this.sized;
    this.sized = true;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (first && this.sphere) this.home();
    this.dirty = true;
  }

  // Draw changes, at low resolution on a slow machine, and at full resolution once nothing moves.
  draw(now) {
    if (!this.header) return;
    const share = this.pace.share(now, this.dirty);
    if (share !== this.sharpness) this.sharpen(share);
    if (!this.dirty) return;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
  }

  sharpen(share) {
    this.sharpness = share;
    this.renderer.setPixelRatio(share * Math.min(window.devicePixelRatio, 2));
    this.dirty = true;
  }
}

function groupOf(header, frame) {
  return header.frames[frame].group;
}

function copyPose(to, from) {
  to.position.copy(from.position);
  to.quaternion.copy(from.quaternion);
}
