// The arrays of a recording, unpacked from compressed bytes: see packing.py.

const KINDS = { f4: Float32Array, u4: Uint32Array, u2: Uint16Array };

export async function unpack(table, base64) {
  const bytes = Uint8Array.from(atob(base64.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const flat = new Uint8Array(await new Response(stream).arrayBuffer());
  const arrays = {};
  for (const [name, entry] of Object.entries(table)) arrays[name] = arrayOf(entry, flat);
  return arrays;
}

function arrayOf(entry, flat) {
  const count = entry.shape.reduce((a, b) => a * b, 1);
  const Kind = KINDS[entry.kind];
  const size = Kind.BYTES_PER_ELEMENT;
  const own = new Uint8Array(count * size);
  for (let byte = 0; byte < size; byte++)
    for (let i = 0; i < count; i++) own[i * size + byte] = flat[entry.at + byte * count + i];
  const values = new Kind(own.buffer);
  return { shape: entry.shape, values: entry.low ? dequantised(entry, values) : values };
}

// Differences, component by component, of levels from `low` on in steps.
function dequantised(entry, changes) {
  const instants = entry.shape[0];
  const width = entry.low.length;
  const found = new Float32Array(instants * width);
  for (let i = 0; i < width; i++) {
    let level = 0;
    for (let t = 0; t < instants; t++) {
      level = (level + changes[i * instants + t]) & 0xffff;
      found[t * width + i] = entry.low[i] + level * entry.step[i];
    }
  }
  return found;
}
