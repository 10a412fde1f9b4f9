// Recordings that change while they are shown: shapes, entries and rows that arrive one after another.

// Write further rows into an array from a row on, in place of its former rows.
export function extend(array, from, more) {
  if (more.shape.length === 3 && more.shape[1] < array.shape[1]) widen(more, array.shape[1]);
  if (array.shape.length === 3 && array.shape[1] < more.shape[1]) widen(array, more.shape[1]);
  const width = array.shape.slice(1).reduce((a, b) => a * b, 1);
  const count = from + more.shape[0];
  if (!array.store || array.store.length < count * width) {
    array.store = new Float32Array(Math.max(2 * count, 256) * width);
    array.store.set(array.values.subarray(0, from * width));
  }
  array.store.set(more.values, from * width);
  array.shape[0] = count;
  array.values = array.store.subarray(0, count * width);
}

// Give an array (T, n, k) more columns; their former values are unknown.
export function widen(array, columns) {
  const [rows, before, size] = array.shape;
  if (columns <= before) return;
  const values = new Float32Array(rows * columns * size).fill(NaN);
  for (let t = 0; t < rows; t++)
    values.set(array.values.subarray(t * before * size, (t + 1) * before * size), t * columns * size);
  Object.assign(array, { shape: [rows, columns, size], values, store: null });
}

// A header with changed values and changed entries of lists.
export function amended(header, changes) {
  const next = { ...header };
  for (const [key, { value, length, changed }] of Object.entries(changes)) {
    next[key] = length === undefined ? value : header[key].slice(0, length);
    for (const [index, entry] of changed ?? []) next[key][index] = entry;
  }
  return next;
}

// The names of the shapes of a header.
export function shapeNamesOf(header) {
  const parts = header.parts.flatMap(({ pictures }) => pictures ?? []);
  const entries = [...header.parts, ...header.marks, ...header.cameras, ...parts];
  return new Set(entries.flatMap(({ triangles, edges, points, frustum, greys }) => [triangles, edges, points, frustum, greys]));
}

// Shapes by name, which are kept while a header names them.
export class Shapes {
  constructor() {
    this.arrays = {};
  }

  // Add the shapes of a message; a large one arrives in several pieces.
  add({ starts }, arrays) {
    for (const [name, piece] of Object.entries(arrays)) {
      if (starts[name] === 0) this.arrays[name] = piece;
      else extend(this.arrays[name], starts[name], piece);
    }
  }

  keep(header) {
    const names = shapeNamesOf(header);
    for (const name of Object.keys(this.arrays)) if (!names.has(name)) delete this.arrays[name];
    return this.arrays;
  }
}
