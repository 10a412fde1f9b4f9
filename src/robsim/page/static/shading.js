// Shading of triangle meshes: smooth across small angles, with edge lines at large angles.

const CREASE = Math.cos((30 * Math.PI) / 180); // of the least angle between faces with a visible edge

export class Surface {
  constructor(corners) {
    this.corners = corners; // x, y, z of each corner of each triangle
    this.numbers = new Map(); // numbers of the points, by position
    this.ids = Uint32Array.from({ length: corners.length / 3 }, (_, i) => this.number(corners, i));
    this.facing();
    this.around = Array.from({ length: this.numbers.size }, () => []); // triangles, by point
    this.ids.forEach((id, i) => this.around[id].push(Math.floor(i / 3)));
  }

  number(points, i) {
    const key = `${points[3 * i]},${points[3 * i + 1]},${points[3 * i + 2]}`;
    if (!this.numbers.has(key)) this.numbers.set(key, this.numbers.size);
    return this.numbers.get(key);
  }

  // Normals of the triangles, as long as twice their areas, and their lengths.
  facing() {
    const { corners } = this;
    this.faces = new Float32Array(corners.length / 3);
    this.sizes = new Float32Array(corners.length / 9);
    for (let t = 0; t < this.sizes.length; t++) {
      const [ax, ay, az, bx, by, bz, cx, cy, cz] = corners.subarray(9 * t, 9 * t + 9);
      const [ux, uy, uz, vx, vy, vz] = [bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az];
      const normal = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
      this.faces.set(normal, 3 * t);
      this.sizes[t] = Math.hypot(...normal);
    }
  }

  areSmooth(s, t) {
    const { faces, sizes } = this;
    const cosine = faces[3 * s] * faces[3 * t] + faces[3 * s + 1] * faces[3 * t + 1] + faces[3 * s + 2] * faces[3 * t + 2];
    return cosine >= CREASE * sizes[s] * sizes[t];
  }

  // A normal for each corner: the mean over its triangle and neighbours at small angles to it.
  normals() {
    const found = new Float32Array(this.corners.length);
    this.ids.forEach((id, i) => {
      const own = Math.floor(i / 3);
      for (const t of this.around[id]) {
        if (t !== own && !this.areSmooth(own, t)) continue;
        for (let k = 0; k < 3; k++) found[3 * i + k] += this.faces[3 * t + k];
      }
    });
    for (let i = 0; i < found.length; i += 3) {
      const size = Math.hypot(found[i], found[i + 1], found[i + 2]) || 1;
      for (let k = 0; k < 3; k++) found[i + k] /= size;
    }
    return found;
  }

  // The lines, given by their ends, that are not smooth joints of two triangles.
  seen(ends) {
    const kept = [];
    for (let i = 0; i < ends.length / 3; i += 2) {
      const [first, second] = [this.number(ends, i), this.number(ends, i + 1)];
      const beside = (this.around[first] ?? []).filter((t) => this.around[second]?.includes(t));
      if (beside.length !== 2 || !this.areSmooth(...beside)) kept.push(...ends.subarray(3 * i, 3 * i + 6));
    }
    return new Float32Array(kept);
  }
}
