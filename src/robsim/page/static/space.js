// The scene in 3-D: solids, marks, trails and views on frames that move.

import { inked } from "./charts.js";
import { Pace } from "./pace.js";
import { Surface } from "./shading.js";
import { shapeNamesOf } from "./growing.js";
import { discard, empty, segmentsOf, geometryOf, linesOf, pictureOf, surface, wayOf } from "./solids.js";
import { THREE, OrbitControls } from "./vendor.js";

const GHOSTS = {
  true: { opacity: 1, lines: 0.55 },
  belief: { opacity: 0.22, lines: 0.9, tint: "#0072b2" },
  goal: { opacity: 0, lines: 1, dashed: true },
  start: { opacity: 0, lines: 0.6, dashed: true, tint: "#8c8c8c" },
  second: { opacity: 0.25, lines: 0.9, tint: "#e69f00" },
};
const FAR = 10; // the view follows a path longer than so many radii of the moving bodies
const RAY_COLOR = "#6f6f6f"; // of views and rays
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
    this.ink = "#000000"; // of what is black on white paper
    this.groups = {};
    this.geometries = new Map(); // of shapes, by name
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
    for (const group of [this.groups.ground, this.sky]) empty(group);
    this.build();
    this.light();
    if (!keep) this.look();
    this.dirty = true;
  }

  // Show other entries of a header; the others, the view and the poses stay.
  change(header) {
    const kept = this.frames.every(({ name, group }, i) => name === header.frames[i]?.name && group === header.frames[i].group);
    this.header = header;
    if (kept) this.renew();
    else this.build();
  }

  build() {
    for (const group of Object.values(this.groups)) if (group !== this.groups.ground) empty(group);
    this.frames = [];
    this.items = new Map(); // what is drawn of each entry, by its text
    this.renew();
    this.extend(0);
    this.place(0);
  }

  // Add what is new in the header, and delete what is not in it any more.
  renew() {
    const { header } = this;
    for (const { name, group } of header.frames.slice(this.frames.length)) {
      const node = Object.assign(new THREE.Group(), { name, group });
      this.groups[group].add(node);
      this.frames.push(node);
    }
    const wanted = this.listItems();
    for (const [key, item] of this.items)
      if (!wanted.has(key)) {
        item.nodes.forEach(discard);
        this.items.delete(key);
      }
    for (const [key, draw] of wanted) if (!this.items.has(key)) this.items.set(key, this.itemOf(draw));
    const names = shapeNamesOf(header);
    for (const [key, { name }] of this.geometries) if (!names.has(name)) this.geometries.delete(key);
    this.dirty = true;
  }

  // Functions that draw each entry of the header, by the text of the entry.
  listItems() {
    const { header } = this;
    const wanted = new Map();
    const want = (key, draw) => {
      const text = JSON.stringify(key);
      wanted.set(wanted.has(text) ? `${text} ${wanted.size}` : text, draw);
    };
    for (const part of header.parts) want([part], () => this.addPart(part));
    for (const marks of header.marks) want(["marks", marks], () => this.addMarks(marks));
    for (const camera of header.cameras) {
      want(["view", camera.frame, camera.frustum], () => this.addView(camera));
      for (const marks of header.marks) want(["rays", camera.frame, marks], () => this.addRays(camera, marks));
    }
    for (const trail of header.trails) want(["trail", trail], () => this.addTrail(trail));
    header.frames.forEach(({ group }, i) => group === "true" && want(["axes", i], () => this.addAxes(i)));
    return wanted;
  }

  // What a function draws: nodes, motions at each instant, and ways that grow with the instants.
  itemOf(draw) {
    this.item = { nodes: [], moves: [], ways: [] };
    draw();
    return this.item;
  }

  put(parent, ...nodes) {
    parent.add(...nodes);
    this.item.nodes.push(...nodes);
  }

  // A geometry that is made once for each shape.
  shapeOf(name, kind, make) {
    const key = `${kind} ${name}`;
    if (!this.geometries.has(key)) this.geometries.set(key, { name, geometry: make() });
    return this.geometries.get(key).geometry;
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
    let known = null;
    const skin = () => (known ??= new Surface(corners));
    if (corners.length && look.opacity) {
      const geometry = this.shapeOf(part.triangles, "skin", () => geometryOf(skin()));
      const mesh = new THREE.Mesh(geometry, surface(color, part.sheer ? 0.12 : look.opacity));
      mesh.castShadow = mesh.receiveShadow = group === "true" && !part.sheer;
      this.put(node, mesh);
    }
    const solid = group === "true" && corners.length && !part.sheer;
    const stroke = solid ? color.clone().multiplyScalar(0.35) : color;
    const edges = this.arrays[part.edges].values;
    const kind = solid ? `seen ${part.triangles}` : "edges";
    const ends = this.shapeOf(part.edges, kind, () => segmentsOf(solid ? skin().seen(edges) : edges));
    this.put(node, linesOf(ends, stroke, look));
    for (const { greys, corners } of part.pictures ?? []) this.put(node, pictureOf(this.arrays[greys], corners));
  }

  addStick(part, group) {
    const color = new THREE.Color(GHOSTS[group].tint ?? part.color);
    const line = linesOf(segmentsOf(new Float32Array(6)), color, { lines: 1 });
    line.frustumCulled = false;
    this.put(this.groups[group], line);
    this.item.moves.push(() => {
      const at = line.geometry.attributes.position;
      const [start, end] = [this.frames[part.frame], this.frames[part.to]];
      line.visible = start.visible && end.visible;
      at.copyArray([...start.position, ...end.position]);
      at.needsUpdate = true;
    });
  }

  addMarks(marks) {
    const points = this.arrays[marks.points].values;
    const size = this.extent() * 0.009;
    const ball = new THREE.SphereGeometry(size, 12, 8);
    marks.colors.forEach((color, i) => {
      const dot = new THREE.Mesh(ball, new THREE.MeshBasicMaterial({ color: inked(color, this.ink) }));
      dot.userData.color = color;
      dot.position.fromArray(points, 3 * i);
      this.put(this.frames[marks.frame], dot);
    });
  }

  addView(camera) {
    const node = new THREE.Group();
    const frustum = this.shapeOf(camera.frustum, "edges", () => segmentsOf(this.arrays[camera.frustum].values));
    node.add(linesOf(frustum, new THREE.Color(RAY_COLOR), { lines: 0.9 }));
    this.put(this.groups.views, node);
    this.item.moves.push(() => copyPose(node, this.frames[camera.frame]));
  }

  addRays(camera, marks) {
    const ends = segmentsOf(new Float32Array(6 * marks.colors.length));
    const rays = linesOf(ends, new THREE.Color(RAY_COLOR), { lines: 0.5 });
    rays.frustumCulled = false;
    this.put(this.groups.rays, rays);
    this.item.moves.push(() => this.castRays(rays, camera, marks));
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
    const second = groupOf(this.header, trail.frame) === "second";
    for (const line of lines) Object.assign(line.userData, { second });
    this.put(this.groups.trails, ...lines);
    this.item.ways.push((from) => this.lay(lines, trail.frame, from));
    this.item.moves.push((index) => lines[1].geometry.setDrawRange(0, index + 1));
    this.lay(lines, trail.frame, 0);
    this.showSecondTrails();
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
    for (const { ways } of this.items.values()) for (const lay of ways) lay(from);
  }

  addAxes(i) {
    const axes = new THREE.AxesHelper(this.extent() * 0.07);
    axes.material.depthTest = false;
    const node = new THREE.Group();
    node.add(axes);
    this.put(this.groups.frames, node);
    this.item.moves.push(() => copyPose(node, this.frames[i]));
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
      frame.visible = i < shape[1] && Number.isFinite(values[at]); // a frame may have no pose yet, or no more
      if (!frame.visible) return;
      frame.position.fromArray(values, at);
      frame.quaternion.fromArray(values, at + 3);
    });
    for (const { moves } of this.items.values()) for (const move of moves) move(index);
    if (this.shown.follow) this.follow();
    this.placed?.();
    this.awaited = 0;
    this.dirty = true;
  }

  show(shown) {
    Object.assign(this.shown, shown);
    for (const [name, group] of Object.entries(this.groups)) group.visible = this.shown[name] ?? true;
    this.showSecondTrails();
    this.dirty = true;
  }

  showSecondTrails() {
    for (const line of this.groups.trails.children) line.visible = !line.userData.second || this.shown.second;
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

  paint(background, ink, dark) {
    this.ink = ink;
    this.scene.background = new THREE.Color(background);
    this.scene.traverse(({ userData, material }) => userData.color && material.color.set(inked(userData.color, ink)));
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

  // Draw changes, at low resolution on a slow machine, and at full resolution once nothing moves. A slow machine
  // draws a dragged handle together with the reply, which places the bodies, not before: once for each value.
  draw(now) {
    if (!this.header) return;
    const due = this.dirty && !(this.pace.coarse && now < this.awaited);
    const share = this.pace.share(now, due);
    if (share !== this.sharpness) this.sharpen(share);
    else if (!due) return;
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
  to.visible = from.visible;
  to.position.copy(from.position);
  to.quaternion.copy(from.quaternion);
}
