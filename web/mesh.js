// Meshes of a shape: triangulation in the core, sizes of triangles, and the transfer of a map to another mesh; as in
// iccm/balanced/meshing and iccm/balanced/model/mesh_sizes.py.

import {GRID_CELLS_ACROSS, MOST_FINER_AT_PINS, MOST_MAGNIFIED, MOST_MORE_AT_PINS, TRIANGLES_A_RADIUS} from './constants.js';
import {declare} from './core.js';
import {boxOf, moments} from './curve.js';
import {geometry} from './energy.js';
import {areasOf, Tangled} from './unfold.js';

/** @import {Curve} from './curve.js' */

/** Largest areas of triangles on a grid of square cells. @typedef {{x: number, y: number, side: number, areas: Float64Array, columns: number, rows: number}} Sizes */


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
 * Return smaller limits around soft pins, with about TRIANGLES_A_RADIUS triangles along each radius; they are relaxed
 * where there are so many patches that the mesh would grow by more than MOST_MORE_AT_PINS.
 * @param {Sizes} sizes limits without pins
 * @param {Curve} outline of the mesh
 * @param {Float64Array} pins positions
 * @param {Float64Array} radii of the patches
 * @returns {Sizes}
 */
export function finerAtPins(sizes, outline, pins, radii) {
  const {x, y, side, areas, columns, rows} = onCells(sizes, outline.z), wanted = areas.slice();
  const middles = new Float64Array(2 * wanted.length);
  for (let cell = 0; cell < wanted.length; cell++) {
    middles[2 * cell] = x + side * (Math.floor(cell / rows) + 0.5);
    middles[2 * cell + 1] = y + side * (cell % rows + 0.5);
    let most = Infinity;
    radii.forEach((radius, k) => {
      const away = Math.hypot(middles[2 * cell] - pins[2 * k], middles[2 * cell + 1] - pins[2 * k + 1]);
      if (away < radius + side) most = Math.min(most, 0.5 * (radius / TRIANGLES_A_RADIUS) ** 2);
    });
    wanted[cell] = Math.min(Math.max(most, areas[cell] / MOST_FINER_AT_PINS), areas[cell]);
  }
  let inside = 0, sum = 0;
  wanted.forEach((area, cell) => {
    if (!outline.contains(middles[2 * cell], middles[2 * cell + 1])) return;
    inside++;
    sum += areas[cell] / area;
  });
  // the number of triangles is the integral of 1 / area; the part that the pins add to it is reduced
  const more = inside ? sum / inside - 1 : 0, share = more > 0 ? Math.min(1, MOST_MORE_AT_PINS / more) : 1;
  return {x, y, side, columns, rows, areas: areas.map((area, cell) => 1 / (1 / area + share * (1 / wanted[cell] - 1 / area)))};
}

/**
 * Return the same limits on a grid of cells.
 * @param {Sizes} sizes
 * @param {Float64Array} outline
 * @returns {Sizes}
 */
function onCells(sizes, outline) {
  if (sizes.areas.length > 1) return sizes;
  const [x, y, right, top] = boxOf(outline), count = GRID_CELLS_ACROSS;
  const areas = new Float64Array(count * count).fill(sizes.areas[0]);
  return {x, y, side: Math.max(right - x, top - y) / count, areas, columns: count, rows: count};
}
