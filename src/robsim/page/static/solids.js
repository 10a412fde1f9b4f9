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
