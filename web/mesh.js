// Meshes of a shape: triangulation in the core, sizes of triangles, and the transfer of a map to another mesh; as in
// iccm/balanced/meshing and iccm/balanced/model/mesh_sizes.py.

import {declare} from './core.js';
import {boxOf, moments} from './curve.js';
import {geometry} from './energy.js';
import {areasOf, Tangled} from './unfold.js';

/** Largest areas of triangles on a grid of square cells. @typedef {{x: number, y: number, side: number, areas: Float64Array, columns: number, rows: number}} Sizes */

const MOST_MAGNIFIED = 6;     // ratio of areas up to which triangles shrink in proportion
const GRID_CELLS_ACROSS = 40; // along the longer side

const clipEars = declare('int64_t iccm_meshing_clip_ears(const Complex *z, int64_t n, int64_t *faces, int64_t *across)');
const refine = declare(`int64_t iccm_meshing_refine(
  Complex *z, int64_t given, int64_t room, int64_t *faces, int64_t *across, int64_t *triangles,
  const int64_t *links, int64_t *stack, int64_t stack_size, double corner_x, double corner_y, double side,
  const double *areas, int64_t columns, int64_t row_count)`);

/**
 * Return the same limit everywhere.
 * @param {number} area
 * @returns {Sizes}
 */
export const even = (area) => ({x: 0, y: 0, side: 1, areas: Float64Array.of(area), columns: 1, rows: 1});

/**
 * Triangulate a polygon; its vertices are the first ones.
 * @param {Float64Array} outline counter-clockwise
 * @param {Sizes} sizes
 */
export function triangulate(outline, sizes) {
  const border = outline.length / 2, mean = sizes.areas.reduce((sum, area) => sum + area, 0) / sizes.areas.length;
  const room = Math.floor(12 * moments(outline).area / mean + 16 * border + 4000);
  const z = new Float64Array(2 * room), faces = new Int32Array(6 * room), across = new Int32Array(6 * room).fill(-1);
  z.set(outline);
  const count = clipEars(outline, border, faces, across);
  if (count < 0 || areasOf(z, faces.subarray(0, 3 * count)).some((area) => !(area > 0))) throw new Tangled();
  const triangles = Int32Array.of(count), stack = new Int32Array(8 * room);
  const vertices = refine(
    z, border, room, faces, across, triangles, new Int32Array(border).fill(-1), stack, stack.length, sizes.x, sizes.y, sizes.side, sizes.areas,
    sizes.columns, sizes.rows);
  return {z: z.slice(0, 2 * vertices), faces: faces.slice(0, 3 * triangles[0])};
}

/**
 * Return stretch max(s1, 1/s2) and determinant of each triangle.
 * @param {Float64Array} z
 * @param {Float64Array} u
 * @param {Int32Array} faces
 */
export function stretches(z, u, faces) {
  const {gradients} = geometry(z, faces), m = faces.length / 3, stretch = new Float64Array(m), determinant = new Float64Array(m);
  for (let t = 0; t < m; t++) {
    let ax = 0, ay = 0, bx = 0, by = 0;  // f_z and f_z̄
    for (let k = 3 * t; k < 3 * t + 3; k++) {
      const gx = gradients[2 * k], gy = gradients[2 * k + 1], x = u[2 * faces[k]], y = u[2 * faces[k] + 1];
      ax += gx * x - gy * y;
      ay += gx * y + gy * x;
      bx += gx * x + gy * y;
      by += gx * y - gy * x;
    }
    const a = Math.hypot(ax, ay), b = Math.hypot(bx, by), small = Math.max(a - b, 1e-300);
    stretch[t] = Math.max(a + b, 1 / small);
    determinant[t] = (a + b) * small;
  }
  return {stretch, determinant};
}

/**
 * Return an area limit divided by the local magnification of a map.
 * @param {Float64Array} z
 * @param {Float64Array} u
 * @param {Int32Array} faces
 * @param {number} area
 * @returns {Sizes}
 */
export function graded(z, u, faces, area) {
  const {determinant} = stretches(z, u, faces), [x, y, right, top] = boxOf(z), side = Math.max(right - x, top - y) / GRID_CELLS_ACROSS;
  const cells = Array.from(determinant, (_, t) => [0, 1].map((axis) => {
    const middle = (z[2 * faces[3 * t] + axis] + z[2 * faces[3 * t + 1] + axis] + z[2 * faces[3 * t + 2] + axis]) / 3;
    return Math.floor((middle - (axis ? y : x)) / side);
  }));
  const columns = 1 + Math.max(...cells.map((cell) => cell[0])), rows = 1 + Math.max(...cells.map((cell) => cell[1]));
  const grid = new Float64Array(columns * rows).fill(1);
  cells.forEach(([column, row], t) => {
    grid[rows * column + row] = Math.max(grid[rows * column + row], Math.min(Math.max(determinant[t], 1), MOST_MAGNIFIED));
  });
  const areas = new Float64Array(columns * rows);
  for (let i = 0; i < columns; i++) {
    for (let j = 0; j < rows; j++) {  // the largest of a cell and its neighbours
      let most = 1;
      for (let p = Math.max(i - 1, 0); p <= Math.min(i + 1, columns - 1); p++) {
        for (let q = Math.max(j - 1, 0); q <= Math.min(j + 1, rows - 1); q++) most = Math.max(most, grid[rows * p + q]);
      }
      areas[rows * i + j] = area / most;
    }
  }
  return {x, y, side, areas, columns, rows};
}

/**
 * Return a piecewise linear function at points, extended linearly from the closest triangle beyond the mesh.
 * @param {Float64Array} z
 * @param {Int32Array} faces
 * @param {Float64Array} values of the vertices, pairs of numbers
 * @param {Float64Array} points
 */
export function transfer(z, faces, values, points) {
  const locate = locator(z, faces), found = new Float64Array(points.length);
  for (let k = 0; k < points.length; k += 2) {
    const t = locate(points[k], points[k + 1]), a = 2 * faces[3 * t], b = 2 * faces[3 * t + 1], c = 2 * faces[3 * t + 2];
    const ux = z[b] - z[a], uy = z[b + 1] - z[a + 1], vx = z[c] - z[a], vy = z[c + 1] - z[a + 1], area = ux * vy - uy * vx;
    const x = points[k] - z[a], y = points[k + 1] - z[a + 1], second = (x * vy - y * vx) / area, third = (ux * y - uy * x) / area;
    for (let axis = 0; axis < 2; axis++) {
      found[k + axis] = values[a + axis] + second * (values[b + axis] - values[a + axis]) + third * (values[c + axis] - values[a + axis]);
    }
  }
  return found;
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
  /** How far a point is outside of a triangle, 0 inside. */
  const outside = (/** @type {number} */ t, /** @type {number} */ x, /** @type {number} */ y) => {
    let inside = true, least = Infinity;
    for (let k = 0; k < 3; k++) {
      const a = 2 * faces[3 * t + k], b = 2 * faces[3 * t + (k + 1) % 3], dx = z[b] - z[a], dy = z[b + 1] - z[a + 1];
      if (dy * (x - z[a]) > dx * (y - z[a + 1])) inside = false;
      const share = Math.min(Math.max((dx * (x - z[a]) + dy * (y - z[a + 1])) / (dx * dx + dy * dy), 0), 1);
      least = Math.min(least, Math.hypot(x - z[a] - share * dx, y - z[a + 1] - share * dy));
    }
    return inside ? 0 : least;
  };
  return (/** @type {number} */ x, /** @type {number} */ y) => {
    let closest = 0, away = Infinity;
    const consider = (/** @type {Iterable<number>} */ triangles) => {
      for (const t of triangles) {
        const distance = outside(t, x, y);
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
