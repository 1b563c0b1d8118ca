// STMaps: for each pixel of the target the place in the source's canvas, as the command writes them (iccm/pixels/stmap.py), in
// OpenEXR files without compression.

/** @import {Shape, WholeMap} from './types.d.ts' */

const SUBSAMPLES = 4;  // along each side of a pixel, to measure its coverage
const ABOUT = 'STMap: R = s from the left, G = t from the bottom, 0..1; A = coverage';
const CHANNELS = 'ABGR';
const FLOAT = 2;       // type of a channel
const STOP = 1e-9;     // relative to a triangle: points on its edges are inside

/**
 * Return (height, width, 4) floats: s from the left and t from the bottom of the source's canvas, 0, and the coverage.
 * @param {WholeMap} map
 * @param {Shape} source
 * @param {Shape} target
 * @param {number} width
 * @param {number} height
 */
export function stmapOf({source: z, image: u, faces}, source, target, width, height) {
  const [left, top, right, bottom] = target.box, [own, high, far, low] = source.box;
  const st = new Float32Array(4 * width * height), isAtCentre = new Uint8Array(width * height);
  const column = (/** @type {number} */ x) => (x - left) / (right - left) * width, row = (/** @type {number} */ y) => (-y - top) / (bottom - top) * height;
  const s = (/** @type {number} */ x) => (x - own) / (far - own), t = (/** @type {number} */ y) => (y + low) / (low - high);
  for (let face = 0; face < faces.length; face += 3) {
    const corners = [0, 1, 2].map((k) => 2 * faces[face + k]), [ax, bx, cx] = corners.map((v) => column(u[v])), [ay, by, cy] = corners.map((v) => row(u[v + 1]));
    const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax), ss = corners.map((v) => s(z[v])), ts = corners.map((v) => t(z[v + 1]));
    /** Barycentric coordinates of a point of the picture. */
    const shares = (/** @type {number} */ x, /** @type {number} */ y) => {
      const second = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area, third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area;
      return [1 - second - third, second, third];
    };
    const isInside = (/** @type {number[]} */ [a, b, c]) => a >= -STOP && b >= -STOP && c >= -STOP;
    const first = Math.max(Math.floor(Math.min(ay, by, cy)), 0), last = Math.min(Math.floor(Math.max(ay, by, cy)), height - 1);
    for (let i = first; i <= last; i++) {
      for (let j = Math.max(Math.floor(Math.min(ax, bx, cx)), 0); j <= Math.min(Math.floor(Math.max(ax, bx, cx)), width - 1); j++) {
        const pixel = width * i + j, at = 4 * pixel, middle = shares(j + 0.5, i + 0.5), hasCentre = isInside(middle);
        let hits = 0;
        for (let k = 0; k < SUBSAMPLES ** 2; k++) {
          if (isInside(shares(j + (k % SUBSAMPLES + 0.5) / SUBSAMPLES, i + (Math.floor(k / SUBSAMPLES) + 0.5) / SUBSAMPLES))) hits++;
        }
        if (!hits && !hasCentre) continue;
        st[at + 3] = Math.min(st[at + 3] + hits / SUBSAMPLES ** 2, 1);
        if (isAtCentre[pixel] && !hasCentre) continue;
        // beyond the outline, the map of the last triangle is extended to the centre
        isAtCentre[pixel] = Number(hasCentre);
        st[at] = middle.reduce((sum, share, k) => sum + share * ss[k], 0);
        st[at + 1] = middle.reduce((sum, share, k) => sum + share * ts[k], 0);
      }
    }
  }
  for (let at = 0; at < st.length; at += 4) if (!st[at + 3]) st.fill(0, at, at + 2);
  return st;
}

/**
 * Return an OpenEXR file of 32-bit floats without compression.
 * @param {Float32Array} pixels (height, width, 4) red, green, blue, alpha
 * @param {number} width
 * @param {number} height
 */
export function exrOf(pixels, width, height) {
  /** @type {number[]} */
  const head = [];
  const int = (/** @type {number} */ value) => head.push(value & 255, (value >> 8) & 255, (value >> 16) & 255, (value >> 24) & 255);
  const float = (/** @type {number} */ value) => head.push(...new Uint8Array(Float32Array.of(value).buffer));
  const text = (/** @type {string} */ value) => head.push(...new TextEncoder().encode(value), 0);
  const attribute = (/** @type {string} */ name, /** @type {string} */ type, /** @type {number} */ size) => {
    text(name);
    text(type);
    int(size);
  };
  const box = (/** @type {string} */ name) => {
    attribute(name, 'box2i', 16);
    [0, 0, width - 1, height - 1].forEach(int);
  };
  int(20000630);  // magic number
  int(2);         // version
  attribute('channels', 'chlist', 18 * CHANNELS.length + 1);
  for (const channel of CHANNELS) {
    text(channel);
    [FLOAT, 0, 1, 1].forEach(int);
  }
  head.push(0);
  attribute('compression', 'compression', 1);
  head.push(0);
  box('dataWindow');
  box('displayWindow');
  attribute('imageDescription', 'string', ABOUT.length);
  head.push(...new TextEncoder().encode(ABOUT));
  attribute('lineOrder', 'lineOrder', 1);
  head.push(0);
  attribute('pixelAspectRatio', 'float', 4);
  float(1);
  attribute('screenWindowCenter', 'v2f', 8);
  float(0);
  float(0);
  attribute('screenWindowWidth', 'float', 4);
  float(1);
  head.push(0);
  const line = 4 * CHANNELS.length * width, start = head.length + 8 * height, file = new DataView(new ArrayBuffer(start + height * (8 + line)));
  new Uint8Array(file.buffer).set(head);
  for (let i = 0; i < height; i++) {
    let at = start + i * (8 + line);
    file.setBigUint64(head.length + 8 * i, BigInt(at), true);
    file.setInt32(at, i, true);
    file.setInt32(at + 4, line, true);
    at += 8;
    for (const channel of CHANNELS) {
      for (let j = 0; j < width; j++, at += 4) file.setFloat32(at, pixels[4 * (width * i + j) + 'RGBA'.indexOf(channel)], true);
    }
  }
  return new Uint8Array(file.buffer);
}
