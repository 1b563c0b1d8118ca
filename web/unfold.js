// Remove folds with the outline held: from the harmonic map, or locally; as in iccm/balanced/minimise/untangle.py and
// unfold.py.

import {
  BARE, DEEP, ENOUGH, LEAST_EPSILON, LEAST_WEIGHT, LOCAL_POLISHING, LOCAL_SHARE, LOCAL_STEPS, PACE, POLISHED, RINGS, SHRINK, SLOW,
} from './constants.js';
import {geometry, holding, leastDeterminant, System} from './energy.js';
import {patternOf} from './linear.js';

/** @import {Rest} from './energy.js' */
/** @import {Pattern} from './linear.js' */


/** No map without folds was found. */
export class Tangled extends Error {}

/**
 * Return (m,) signed areas of triangles.
 * @param {Float64Array} z
 * @param {Int32Array} faces
 */
export function areasOf(z, faces) {
  const areas = new Float64Array(faces.length / 3);
  for (let t = 0; t < areas.length; t++) {
    const a = 2 * faces[3 * t], b = 2 * faces[3 * t + 1], c = 2 * faces[3 * t + 2];
    areas[t] = 0.5 * ((z[b] - z[a]) * (z[c + 1] - z[a + 1]) - (z[b + 1] - z[a + 1]) * (z[c] - z[a]));
  }
  return areas;
}

/** @param {Float64Array} values */
const sum = (values) => values.reduce((total, value) => total + value, 0);

/**
 * Return (m, 3) weights of the edges opposite the corners of triangles: half the cotangents, bounded below.
 * @param {{gradients: Float64Array, areas: Float64Array}} rest
 */
export function springs({gradients, areas}) {
  const weights = new Float64Array(3 * areas.length);
  for (let t = 0; t < areas.length; t++) {
    for (let k = 0; k < 3; k++) {
      const a = 2 * (3 * t + (k + 1) % 3), b = 2 * (3 * t + (k + 2) % 3);
      weights[3 * t + k] = Math.max(-4 * areas[t] * (gradients[a] * gradients[b] + gradients[a + 1] * gradients[b + 1]), LEAST_WEIGHT);
    }
  }
  return weights;
}

/**
 * Fill in the derivatives of the energy of springs.
 * @param {Pattern} pattern
 * @param {Float64Array} weights (m, 3)
 * @param {Float64Array} u
 * @param {System} system
 */
function pull(pattern, weights, u, {matrix, gradient}) {
  const {corners, slots, diagonal} = pattern;
  matrix.fill(0);
  gradient.fill(0);
  const add = (/** @type {number} */ entry, /** @type {number} */ value) => {
    matrix[4 * entry] += value;
    matrix[4 * entry + 3] += value;
  };
  for (let t = 0; t < corners.length / 3; t++) {
    for (let k = 0; k < 3; k++) {
      const i = corners[3 * t + (k + 1) % 3], j = corners[3 * t + (k + 2) % 3], w = weights[3 * t + k];
      add(slots[6 * t + [4, 2, 1][k]], -w);
      add(diagonal[i], w);
      add(diagonal[j], w);
      for (let axis = 0; axis < 2; axis++) {
        const force = w * (u[2 * i + axis] - u[2 * j + axis]);
        gradient[2 * i + axis] += force;
        gradient[2 * j + axis] -= force;
      }
    }
  }
}

/**
 * Move vertices until no triangle is folded, and return the least determinant.
 * @param {Pattern} pattern
 * @param {Rest} rest
 * @param {Float64Array} u changed, except for the first vertices, which are held
 * @param {number} held number of these
 * @param {{harmonic: boolean, steps: number, polish: number}} how whether to start from the harmonic map, the most steps, and how many of
 *   them may be made after nothing is folded
 */
export function untangle(pattern, rest, u, held, {harmonic, steps, polish}) {
  const system = new System(pattern, rest.corners, rest, holding(u, held));
  if (harmonic) {
    u.fill(0, 2 * held);
    pull(pattern, springs(rest), u, system);
    system.quadraticStep(u);
  }
  let epsilon = -1, shrink = 1, kept = u.slice(), best = 0, left = polish;
  /** @type {number[]} the least determinant so far */
  const highest = [];
  for (let remaining = steps; remaining > 0; remaining--) {
    const least = leastDeterminant(rest, u), number = highest.length;
    highest.push(number ? Math.max(least, highest[number - 1]) : least);
    if (number >= PACE && highest[number] + remaining * (highest[number] - highest[number - PACE]) / PACE < 0) break;
    if (least > best) {
      best = least;
      kept = u.slice();
    }
    if (least > ENOUGH) {
      if (left === 0 || least > POLISHED) return least;
      left--;
    }
    epsilon = nextEpsilon(least, epsilon, shrink);
    const {done, small} = system.descend({theta: 1, q: 1, epsilon}, u, new Float64Array(held), 1, SLOW);
    if (done === 0) break;
    shrink = small ? SHRINK : 1;
  }
  const least = leastDeterminant(rest, u);
  if (least >= best || best === 0) return least;
  u.set(kept);
  return best;
}

/**
 * @param {number} least determinant
 * @param {number} before
 * @param {number} shrink
 */
function nextEpsilon(least, before, shrink) {
  if (least > 0) return POLISHED;
  const epsilon = Math.sqrt(1e-6 + DEEP * least * least);
  return Math.max(before > 0 ? Math.min(epsilon, before * shrink) : epsilon, LEAST_EPSILON);
}

/**
 * Return images with the vertices near folds moved until no triangle is folded.
 * @param {Float64Array} z
 * @param {Float64Array} u
 * @param {Int32Array} faces
 * @param {number} held number of the first vertices, which do not move
 */
export function unfoldLocally(z, u, faces, held) {
  const n = z.length / 2, {areas} = geometry(z, faces), rest = sum(areas);
  let images = areasOf(u, faces);
  const whole = sum(images);
  let folded = images.map((area, t) => (area * rest < BARE * areas[t] * whole ? 1 : 0));
  let left = images.filter((area) => area <= 0).length;
  for (const rings of sum(folded) ? RINGS : []) {
    const near = around(faces, folded, rings, n);
    near.fill(0, 0, held);
    if (rings > RINGS[0] && sum(Float64Array.from(near)) > LOCAL_SHARE * (n - held)) break;
    const moved = moveNear(z, u, faces, near);
    images = areasOf(moved, faces);
    const remaining = images.map((area) => (area <= 0 ? 1 : 0)), count = sum(remaining);
    if (!count) return moved;
    if (count < left) {
      u = moved;
      folded = remaining;
      left = count;
    }
  }
  if (left) throw new Tangled();
  return u;
}

/**
 * Return which vertices are within a number of rings around some triangles.
 * @param {Int32Array} faces
 * @param {Float64Array} folded
 * @param {number} rings
 * @param {number} n
 */
function around(faces, folded, rings, n) {
  const near = new Uint8Array(n);
  let reached = folded;
  for (let ring = 0; ring <= rings; ring++) {
    reached.forEach((hit, t) => {
      if (hit) for (let k = 0; k < 3; k++) near[faces[3 * t + k]] = 1;
    });
    reached = folded.map((_, t) => near[faces[3 * t]] | near[faces[3 * t + 1]] | near[faces[3 * t + 2]]);
  }
  return near;
}

/**
 * Return images with some vertices moved; rest shapes are scaled to the total area of their images.
 * @param {Float64Array} z
 * @param {Float64Array} u
 * @param {Int32Array} faces
 * @param {Uint8Array} free
 */
function moveNear(z, u, faces, free) {
  const used = [];
  for (let t = 0; t < faces.length / 3; t++) {
    const own = faces.subarray(3 * t, 3 * t + 3);
    if (own.some((vertex) => free[vertex])) used.push(...own);
  }
  if (!used.length) return u;
  const distinct = [...new Set(used)].sort((a, b) => a - b), vertices = [...distinct.filter((v) => !free[v]), ...distinct.filter((v) => free[v])];
  const number = new Map(vertices.map((vertex, k) => [vertex, k])), part = Int32Array.from(used, (vertex) => number.get(vertex) ?? 0);
  const border = vertices.filter((vertex) => !free[vertex]).length;
  const pattern = patternOf(part, Int32Array.from({length: border}, (_, k) => k), vertices.length);
  const points = (/** @type {Float64Array} */ w) => Float64Array.from(vertices.flatMap((vertex) => [w[2 * vertex], w[2 * vertex + 1]]));
  const rest = points(z), images = points(u), area = sum(geometry(rest, part).areas);
  const scale = Math.sqrt(Math.abs(sum(areasOf(images, part))) / area), shapes = geometry(rest.map((value) => value * scale), pattern.corners);
  const measure = sum(shapes.areas);
  const triangles = {corners: pattern.corners, slots: pattern.slots, gradients: shapes.gradients, areas: shapes.areas.map((value) => value / measure)};
  untangle(pattern, triangles, images, border, {harmonic: false, steps: LOCAL_STEPS, polish: LOCAL_POLISHING});
  const moved = u.slice();
  vertices.forEach((vertex, k) => moved.set(images.subarray(2 * k, 2 * k + 2), 2 * vertex));
  return moved;
}
