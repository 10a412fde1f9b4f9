// Unpacking of a recording from the compressed bytes of a container: see packing.py and container.py.

const KINDS = { f4: Float32Array, u4: Uint32Array, u2: Uint16Array };
const FOOT = 8 + 32 + 17; // bytes after the header: its length, the checksum, and a mark

export async function unpack(base64) {
  const bytes = Uint8Array.from(atob(base64.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const content = await new Response(stream).arrayBuffer();
  const end = content.byteLength - FOOT;
  const length = Number(new DataView(content).getBigUint64(end, true));
  const text = new TextDecoder().decode(new Uint8Array(content, end - length, length));
  const { header, arrays: blocks } = JSON.parse(text);
  const piece = (i) => new Uint8Array(content, blocks[i].offset);
  const arrays = header.arrays.map((entry, i) => [entry.name, arrayOf(entry, piece(i))]);
  return { header, arrays: Object.fromEntries(arrays) };
}

function arrayOf(entry, bytes) {
  const count = entry.shape.reduce((a, b) => a * b, 1);
  const Kind = KINDS[entry.kind];
  const size = Kind.BYTES_PER_ELEMENT;
  const own = new Uint8Array(count * size);
  for (let byte = 0; byte < size; byte++)
    for (let i = 0; i < count; i++) own[i * size + byte] = bytes[byte * count + i];
  const values = new Kind(own.buffer);
  return { shape: entry.shape, values: entry.low ? dequantised(entry, values) : values };
}

// Levels from their differences, for each component; values are low + step * level.
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
