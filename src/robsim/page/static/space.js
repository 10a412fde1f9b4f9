// The scene in 3-D: solids, marks, trails and views on frames that move.

import { Surface } from "./shading.js";
import { THREE, OrbitControls } from "./vendor.js";

const GHOSTS = {
  true: { opacity: 1, lines: 0.55 },
  belief: { opacity: 0.22, lines: 0.9, tint: "#0072b2" },
  goal: { opacity: 0, lines: 1, dashed: true },
  start: { opacity: 0, lines: 0.6, dashed: true, tint: "#8c8c8c" },
};
const VIEW = { elevation: 22, azimuth: -55 }; // degrees, as the figures have it

export class Space {
  constructor(element, header, arrays) {
    this.header = header;
    this.arrays = arrays;
    this.shown = { belief: true, goal: true, start: false, trails: true, views: true, rays: false, frames: false, ground: true };
    this.renderer = new THREE.WebGLRenderer({ antialias: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    element.append(this.renderer.domElement);
    this.element = element;
    this.scene = new THREE.Scene();
    this.groups = {};
    for (const name of ["true", "belief", "goal", "start", "trails", "views", "rays", "frames", "ground"]) {
      this.groups[name] = new THREE.Group();
      this.scene.add(this.groups[name]);
    }
    this.build();
    this.light();
    this.look();
    this.dirty = true;
    new ResizeObserver(() => this.resize()).observe(element);
    this.resize();
  }

  build() {
    const { header } = this;
    this.frames = header.frames.map((frame) => {
      const node = new THREE.Group();
      node.name = frame.name;
      this.groups[frame.group].add(node);
      return node;
    });
    this.moving = []; // what is made anew at each instant: lines from frame to frame
    for (const part of header.parts) this.addPart(part);
    for (const marks of header.marks) this.addMarks(marks);
    for (const camera of header.cameras) this.addView(camera);
    for (const trail of header.trails) this.addTrail(trail);
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
    const { shape, values } = this.arrays.poses;
    const way = new Float32Array(3 * shape[0]);
    for (let t = 0; t < shape[0]; t++)
      for (let i = 0; i < 3; i++) way[3 * t + i] = values[(t * shape[1] + trail.frame) * 7 + i];
    const whole = wayOf(way, trail.color, 0.3);
    const past = wayOf(way, trail.color, 1);
    this.groups.trails.add(whole, past);
    this.moving.push((index) => past.geometry.setDrawRange(0, index + 1));
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
    this.scene.add(new THREE.HemisphereLight("#ffffff", "#b9b4ab", 2.0));
    const sun = new THREE.DirectionalLight("#ffffff", 2.2);
    sun.position.copy(centre).add(new THREE.Vector3(0.35, -0.55, 1.1).multiplyScalar(2 * size));
    sun.target.position.copy(centre);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    Object.assign(sun.shadow.camera, { left: -size, right: size, top: size, bottom: -size, near: size / 100, far: 6 * size });
    sun.shadow.bias = -0.0005;
    sun.shadow.normalBias = size * 0.002;
    this.scene.add(sun, sun.target);
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
    const sphere = this.box().getBoundingSphere(new THREE.Sphere());
    this.camera = new THREE.PerspectiveCamera(35, 1, sphere.radius / 100, sphere.radius * 60);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => (this.dirty = true));
    this.sphere = sphere;
    this.home();
  }

  home() {
    const { sphere } = this;
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

  // The box around all that is true, at the start and the end, and around the trails.
  box() {
    if (this.bounds) return this.bounds;
    this.bounds = new THREE.Box3();
    const last = this.arrays.poses.shape[0] - 1;
    for (const index of [last, 0]) {
      this.place(index);
      this.scene.updateMatrixWorld(true);
      for (const name of ["true", "goal", "views", "trails"]) this.bounds.expandByObject(this.groups[name]);
    }
    if (this.bounds.isEmpty()) this.bounds.set(new THREE.Vector3(-0.5, -0.5, 0), new THREE.Vector3(0.5, 0.5, 1));
    return this.bounds;
  }

  extent() {
    if (this.size) return this.size;
    const { shape, values } = this.arrays.poses;
    const box = new THREE.Box3();
    const point = new THREE.Vector3();
    for (let i = 0; i < shape[0] * shape[1]; i++) box.expandByPoint(point.fromArray(values, 7 * i));
    this.size = Math.max(box.getSize(point).length(), 1e-3) || 1;
    if (box.isEmpty() || this.size <= 1e-3) this.size = 1;
    return this.size;
  }

  place(index) {
    const { shape, values } = this.arrays.poses;
    this.frames.forEach((frame, i) => {
      const at = (index * shape[1] + i) * 7;
      frame.position.fromArray(values, at);
      frame.quaternion.fromArray(values, at + 3);
    });
    for (const move of this.moving) move(index);
    this.dirty = true;
  }

  show(shown) {
    Object.assign(this.shown, shown);
    for (const [name, visible] of Object.entries(this.shown)) this.groups[name].visible = visible;
    this.dirty = true;
  }

  paint(background, dark) {
    this.scene.background = new THREE.Color(background);
    this.grid.material.opacity = dark ? 0.15 : 0.6;
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
    if (first) this.home();
    this.dirty = true;
  }

  draw() {
    if (!this.dirty) return;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
  }
}

function groupOf(header, frame) {
  return header.frames[frame].group;
}

function copyPose(to, from) {
  to.position.copy(from.position);
  to.quaternion.copy(from.quaternion);
}

function geometryOf(skin) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(skin.corners, 3));
  geometry.setAttribute("normal", new THREE.BufferAttribute(skin.normals(), 3));
  return geometry;
}

function surface(color, opacity) {
  return new THREE.MeshStandardMaterial({
    color: color.clone().lerp(new THREE.Color("#ffffff"), 0.18),
    roughness: 0.75,
    metalness: 0.05,
    side: THREE.DoubleSide,
    transparent: opacity < 1,
    opacity,
    depthWrite: opacity === 1,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
  });
}

function linesOf(ends, color, look) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(ends, 3));
  const Kind = look.dashed ? THREE.LineDashedMaterial : THREE.LineBasicMaterial;
  const material = new Kind({ color, transparent: true, opacity: look.lines });
  const lines = new THREE.LineSegments(geometry, material);
  if (look.dashed) {
    lines.computeLineDistances();
    const spread = Math.max(...lines.geometry.attributes.lineDistance.array, 1e-6);
    material.dashSize = spread / 40;
    material.gapSize = spread / 60;
  }
  return lines;
}

function wayOf(points, color, opacity) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
  const line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color, transparent: true, opacity }));
  line.frustumCulled = false;
  return line;
}
