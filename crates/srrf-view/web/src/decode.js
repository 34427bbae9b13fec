// The numbers that quantise.rs packs: little-endian 16-bit in base64.

function words(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const view = new DataView(bytes.buffer);
  const out = new Uint16Array(bytes.length >> 1);
  for (let i = 0; i < out.length; i++) out[i] = view.getUint16(2 * i, true);
  return out;
}

/** Points relative to the centre of their cloud's bounding box, xyz after xyz. */
export function decodePoints({ extent, data }) {
  const steps = words(data);
  const out = new Float32Array(steps.length);
  for (let i = 0; i < out.length; i++) out[i] = (steps[i] / 65535 - 0.5) * extent[i % 3];
  return out;
}

/** Bytes as they are. */
export function decodeBytes(base64) {
  const text = atob(base64);
  return Uint8Array.from(text, (letter) => letter.charCodeAt(0));
}

/** Values from 0 to `max`. */
export function decodeValues({ max, data }) {
  return Float32Array.from(words(data), (step) => (step / 65535) * max);
}
