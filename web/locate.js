// Points in triangulations: the triangle of a point, and piecewise linear functions; as in iccm/balanced/meshing/transfer.py.

import {boxOf} from './curve.js';

/**
 * Return a piecewise linear function at points, extended linearly from the closest triangle beyond the mesh.
 * @param {Float64Array} z
 * @param {Int32Array} faces
 * @param {Float64Array} values of the vertices, pairs of numbers
 * @param {Float64Array} points
 */
export const transfer = (z, faces, values, points) => transferrer(z, faces, values)(points);

/**
 * Return a piecewise linear function of points, extended linearly from the closest triangle beyond the mesh.
 * @param {Float64Array} z
 * @param {Int32Array} faces
 * @param {Float64Array} values of the vertices, pairs of numbers
 */
export function transferrer(z, faces, values) {
  const locate = locator(z, faces);
  return (/** @type {Float64Array} */ points) => {
    const found = new Float64Array(points.length);
    for (let k = 0; k < points.length; k += 2) {
      const t = locate(points[k], points[k + 1]), a = 2 * faces[3 * t], b = 2 * faces[3 * t + 1], c = 2 * faces[3 * t + 2];
      const ux = z[b] - z[a], uy = z[b + 1] - z[a + 1], vx = z[c] - z[a], vy = z[c + 1] - z[a + 1], area = ux * vy - uy * vx;
      const x = points[k] - z[a], y = points[k + 1] - z[a + 1], second = (x * vy - y * vx) / area, third = (ux * y - uy * x) / area;
      for (let axis = 0; axis < 2; axis++) {
        found[k + axis] = values[a + axis] + second * (values[b + axis] - values[a + axis]) + third * (values[c + axis] - values[a + axis]);
      }
    }
    return found;
  };
}

/**
 * Return a function that finds the triangle of a point, or the closest one.
 * @param {Float64Array} z
 * @param {Int32Array} faces
 */
export function locator(z, faces) {
  const m = faces.length / 3, [left, bottom, right, top] = boxOf(z), across = Math.max(1, Math.floor(Math.sqrt(m)));
  const side = Math.max(right - left, top - bottom, 1e-300) / across, columns = Math.floor((right - left) / side) + 1;
  const rows = Math.floor((top - bottom) / side) + 1;
  /** @type {number[][]} */
  const buckets = Array.from({length: columns * rows}, () => []);
  const cell = (/** @type {number} */ value, /** @type {number} */ low, /** @type {number} */ count) =>
    Math.min(Math.max(Math.floor((value - low) / side), 0), count - 1);
  for (let t = 0; t < m; t++) {
    const corners = [0, 1, 2].map((k) => 2 * faces[3 * t + k]), x = corners.map((k) => z[k]), y = corners.map((k) => z[k + 1]);
    for (let i = cell(Math.min(...x), left, columns); i <= cell(Math.max(...x), left, columns); i++) {
      for (let j = cell(Math.min(...y), bottom, rows); j <= cell(Math.max(...y), bottom, rows); j++) buckets[rows * i + j].push(t);
    }
  }
  return (/** @type {number} */ x, /** @type {number} */ y) => {
    let closest = 0, away = Infinity;
    const consider = (/** @type {Iterable<number>} */ triangles) => {
      for (const t of triangles) {
        const distance = outside(z, faces, t, x, y);
        if (distance < away) {
          away = distance;
          closest = t;
        }
        if (away === 0) return;
      }
    };
    const column = cell(x, left, columns), row = cell(y, bottom, rows);
    consider(buckets[rows * column + row]);
    if (away === 0) return closest;
    for (let i = Math.max(column - 1, 0); i <= Math.min(column + 1, columns - 1); i++) {
      for (let j = Math.max(row - 1, 0); j <= Math.min(row + 1, rows - 1); j++) consider(buckets[rows * i + j]);
    }
    if (away > side) consider(Array.from({length: m}, (_, t) => t));
    return closest;
  };
}

/**
 * Return how far a point is outside of a triangle; 0 inside.
 * @param {Float64Array} z
 * @param {Int32Array} faces
 * @param {number} t
 * @param {number} x
 * @param {number} y
 */
function outside(z, faces, t, x, y) {
  let inside = true, least = Infinity;
  for (let k = 0; k < 3; k++) {
    const a = 2 * faces[3 * t + k], b = 2 * faces[3 * t + (k + 1) % 3], dx = z[b] - z[a], dy = z[b + 1] - z[a + 1];
    if (dy * (x - z[a]) > dx * (y - z[a + 1])) inside = false;
    const share = Math.min(Math.max((dx * (x - z[a]) + dy * (y - z[a + 1])) / (dx * dx + dy * dy), 0), 1);
    least = Math.min(least, Math.hypot(x - z[a] - share * dx, y - z[a + 1] - share * dy));
  }
  return inside ? 0 : least;
}

/**
 * Return the triangle that contains a point, or the closest one. For many points, use `locator`.
 * @param {Float64Array} z
 * @param {Int32Array} faces
 * @param {number} x
 * @param {number} y
 */
export function triangleAt(z, faces, x, y) {
  let closest = 0, away = Infinity;
  for (let t = 0; t < faces.length / 3 && away > 0; t++) {
    const distance = outside(z, faces, t, x, y);
    if (distance < away) {
      away = distance;
      closest = t;
    }
  }
  return closest;
}
