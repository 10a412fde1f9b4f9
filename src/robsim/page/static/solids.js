// Solids and lines as three.js draws them.

import { THREE } from "./vendor.js";

export function geometryOf(skin) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(skin.corners, 3));
  geometry.setAttribute("normal", new THREE.BufferAttribute(skin.normals(), 3));
  return geometry;
}

export function surface(color, opacity) {
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

export function segmentsOf(ends) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(ends, 3));
  return geometry;
}

// A picture on a rectangle, given by its corners from the upper left one clockwise: a square for each
// grey value. It is seen from its front only.
export function pictureOf({ values, shape: [rows, columns] }, corners) {
  const places = new Float32Array(18 * rows * columns);
  const colors = new Float32Array(18 * rows * columns);
  const [from, right, , down] = [0, 3, 6, 9].map((i) => new THREE.Vector3().fromArray(corners, i));
  const [across, along] = [right.sub(from).divideScalar(columns), down.sub(from).divideScalar(rows)];
  const point = new THREE.Vector3();
  const turns = [[0, 0], [0, 1], [1, 1], [0, 0], [1, 1], [1, 0]]; // two triangles, counterclockwise
  for (let k = 0; k < rows * columns; k++) {
    const color = linearOf(values[k] / 255);
    turns.forEach(([i, j], corner) => {
      const [x, y] = [(k % columns) + i, Math.floor(k / columns) + j];
      point.copy(from).addScaledVector(across, x).addScaledVector(along, y).toArray(places, 18 * k + 3 * corner);
      colors.fill(color, 18 * k + 3 * corner, 18 * k + 3 * corner + 3);
    });
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(colors, 3));
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ vertexColors: true }));
}

// The light of a grey value of sRGB from 0 to 1.
function linearOf(grey) {
  return grey <= 0.04045 ? grey / 12.92 : ((grey + 0.055) / 1.055) ** 2.4;
}

export function linesOf(geometry, color, look) {
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

export function discard(node) {
  node.traverse((inner) => {
    inner.geometry?.dispose(); // of a shared geometry, only the copy in the memory of the GPU
    inner.material?.dispose();
    inner.shadow?.dispose?.();
  });
  node.removeFromParent();
}

export function empty(group) {
  for (const node of [...group.children]) discard(node);
}

export function wayOf(color, opacity) {
  const line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color, transparent: true, opacity }));
  line.frustumCulled = false;
  return line;
}
