// Colours that stay apart for colour-blind readers: Okabe and Ito's orange and blue, and viridis
// (van der Walt and Smith) for distances, cut so that small distances fade into the background and
// large ones stand out in both schemes.

const VIRIDIS = ['440154', '472d7b', '3b528b', '2c728e', '21918c', '28ae80', '5ec962', 'addc30', 'fde725'];

const rgb = (hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);

/** 9 colours along viridis between two places in [0, 1]. */
function ramp(from, to) {
  return Array.from({ length: 9 }, (_, i) => {
    const place = (from + ((to - from) * i) / 8) * (VIRIDIS.length - 1);
    const low = Math.min(Math.floor(place), VIRIDIS.length - 2);
    const [a, b] = [rgb(VIRIDIS[low]), rgb(VIRIDIS[low + 1])];
    return a.map((v, c) => v + (b[c] - v) * (place - low));
  });
}

export const SCHEMES = {
  light: {
    background: rgb('f5f6f8'),
    source: rgb('d55e00'),
    target: rgb('0072b2'),
    ghost: rgb('9aa1ab'),
    neutral: rgb('bcc2ca'),
    match: rgb('8a2f6b'),
    ramp: ramp(0.92, 0),
  },
  dark: {
    background: rgb('0f1216'),
    source: rgb('ff9f4a'),
    target: rgb('56b4e9'),
    ghost: rgb('737c88'),
    neutral: rgb('4d5663'),
    match: rgb('f0a3d0'),
    ramp: ramp(0.2, 1),
  },
};

/** Viridis at places from 0 to 255, three bytes each, for intensities. */
export function viridis(places) {
  const table = Array.from({ length: 256 }, (_, i) => {
    const place = (i / 255) * (VIRIDIS.length - 1);
    const low = Math.min(Math.floor(place), VIRIDIS.length - 2);
    const [a, b] = [rgb(VIRIDIS[low]), rgb(VIRIDIS[low + 1])];
    return a.map((v, c) => Math.round(255 * (v + (b[c] - v) * (place - low))));
  });
  const bytes = new Uint8Array(3 * places.length);
  places.forEach((place, i) => bytes.set(table[place], 3 * i));
  return bytes;
}

export const css = (colour) => `rgb(${colour.map((v) => Math.round(255 * v)).join(' ')})`;

export const mix = (a, b, share) => a.map((v, c) => v + (b[c] - v) * share);
