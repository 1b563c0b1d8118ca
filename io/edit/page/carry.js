// Images of single points under a map, computed on the page: for the cross under the pointer and for linked views.

/** @import {Point} from './types.d.ts' */

const FLOATS = 18;   // of a triangle: corners in the target, corners and curvature vectors in the source (see gl.js)
const MARGIN = 1e-6; // relative to a triangle: points on its edge are inside

/**
 * Return the image of a point under a triangulated map, taken as linear in each triangle; null outside of the map.
 * @param {Float32Array} floats
 * @param {Point} point
 * @param {'source' | 'target'} side that the point is on
 * @returns {Point | null}
 */
export function carry(floats, [x, y], side) {
  const from = side === 'target' ? 0 : 6, to = 6 - from;
  for (let k = 0; k + FLOATS <= floats.length; k += FLOATS) {
    const a = k + from, ux = floats[a + 2] - floats[a], uy = floats[a + 3] - floats[a + 1];
    const vx = floats[a + 4] - floats[a], vy = floats[a + 5] - floats[a + 1], area = ux * vy - uy * vx;
    const px = x - floats[a], py = y - floats[a + 1];
    const s = (px * vy - py * vx) / area, t = (ux * py - uy * px) / area;
    if (s < -MARGIN || t < -MARGIN || s + t > 1 + MARGIN) continue;
    const b = k + to;
    return [0, 1].map((axis) => (1 - s - t) * floats[b + axis] + s * floats[b + 2 + axis] + t * floats[b + 4 + axis]);
  }
  return null;
}
