// Arrays of a recording to which rows are added while it is shown.

// Write further rows into an array from a row on, in place of its former rows.
export function extend(array, from, more) {
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
