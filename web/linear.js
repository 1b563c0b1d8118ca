// The pattern of the Cholesky factor of a mesh's matrices; as in iccm/linalg (ordering.py, fronts.py, cholesky.py).

import {FIRST_ENTRIES_PER_VERTEX, LEAST_FRONT_VERTICES, MOST_ZEROS_SHARE} from './constants.js';
import {declare, Scratch, struct} from './core.js';
import {lastUpTo} from './curve.js';

/** @import {Struct} from './core.js' */

/**
 * @typedef {object} Pattern
 * @property {Int32Array} position row of each vertex in the order of elimination
 * @property {Int32Array} columns block columns of the upper triangle
 * @property {Int32Array} corners (m, 3) vertices of the triangles in ascending position
 * @property {Int32Array} slots (m, 6) entries of the pairs 00, 01, 02, 11, 12, 22 of corners
 * @property {Int32Array} diagonal the entry of each vertex with itself
 * @property {Struct} record that the core takes
 * @property {(a: number, b: number) => number} entry returns the entry of a pair of vertices, in either order
 * @property {() => Struct} factor returns the record of a factor
 */


const frontsRecord = struct(`struct Fronts {
  const int64_t *starts; const int64_t *beyond_starts; const int64_t *beyond; const int64_t *parents;
  const int64_t *panels; int64_t count; }`);
const patternRecord = struct(`struct BlockPattern {
  const int64_t *order; const int64_t *starts; const int64_t *columns; const int64_t *diagonal;
  const int64_t *ahead; int64_t n; int64_t e; Fronts fronts; }`);
const factorRecord = struct(`struct Factor {
  double *values; int64_t *place; int64_t *waiting; int64_t *sources; double *part; double *left; }`);
const minimumDegree = declare(`int64_t iccm_linalg_minimum_degree(
  const int64_t *starts, int64_t *around, int64_t *count, int64_t *degree, int64_t *after, int64_t *before,
  int64_t *members, int64_t room, int64_t *first, int64_t *size, int64_t *marked, int64_t *order, int64_t n,
  int64_t m)`);
const supernodes = declare(`int64_t iccm_linalg_supernodes(
  const int64_t *parents, const int64_t *counts, int64_t *size, int64_t *free, int64_t *old, int64_t *zeros,
  int64_t *place, int64_t *starts, int64_t *last, int64_t n, int64_t few, double share)`);

/**
 * @param {number} count
 * @param {(k: number) => number} value
 */
const integers = (count, value) => Int32Array.from({length: count}, (_, k) => value(k));

/**
 * Return an order of elimination, and the vertices below the diagonal of each column of the factor.
 * @param {Int32Array} faces (m, 3)
 * @param {number} n number of vertices
 * @param {number[][]} cliques further sets of vertices that are coupled
 */
function eliminate(faces, n, cliques) {
  const triangles = faces.length / 3, m = triangles + cliques.length, sizes = integers(m, (k) => (k < triangles ? 3 : cliques[k - triangles].length));
  const corners = Int32Array.from([...faces, ...cliques.flat()]), ends = new Int32Array(m + 1);
  for (let k = 0; k < m; k++) ends[k + 1] = ends[k] + sizes[k];
  const count = new Int32Array(n), degree = new Int32Array(n), starts = new Int32Array(n + 1);
  for (const vertex of corners) count[vertex]++;
  for (let k = 0; k < n; k++) starts[k + 1] = starts[k] + count[k];
  const around = new Int32Array(corners.length), filled = starts.slice();
  for (let k = 0; k < m; k++) {
    for (const vertex of corners.subarray(ends[k], ends[k + 1])) {
      around[filled[vertex]++] = k;
      degree[vertex] += k < triangles ? 1 : sizes[k];
    }
  }
  for (let room = FIRST_ENTRIES_PER_VERTEX * n; ; room *= 2) {
    const members = new Int32Array(corners.length + room), first = new Int32Array(m + n + 1), size = new Int32Array(m + n);
    members.set(corners);
    first.set(ends);
    size.set(sizes);
    const order = new Int32Array(n), rings = integers(2 * n + 1, (k) => k);
    const isDone = minimumDegree(
      starts, around.slice(), count.slice(), degree.map((value) => Math.min(value, n)), rings, rings.slice(), members, members.length,
      first, size, new Int32Array(n), order, n, m);
    if (!isDone) continue;
    return {order, ends: integers(n + 1, (k) => first[m + k] - first[m]), columns: members.slice(first[m], first[m + n])};
  }
}

/**
 * Return an order with the same factor in which fronts are contiguous, and the fronts.
 * @param {Int32Array} faces
 * @param {number} n
 * @param {number[][]} cliques
 */
function frontsOf(faces, n, cliques) {
  const {order, ends, columns} = eliminate(faces, n, cliques), counts = integers(n, (k) => ends[k + 1] - ends[k]);
  const row = new Int32Array(n), parents = new Int32Array(n).fill(n);
  order.forEach((vertex, k) => {
    row[vertex] = k;
  });
  const rows = columns.map((vertex) => row[vertex]);
  for (let k = 0; k < n; k++) for (let at = ends[k]; at < ends[k + 1]; at++) parents[k] = Math.min(parents[k], rows[at]);
  const place = new Int32Array(n), allStarts = new Int32Array(n + 1), lasts = new Int32Array(n);
  const number = supernodes(
    parents, counts, new Int32Array(n + 1).fill(1), new Int32Array(n + 1).fill(n), new Int32Array(n), new Int32Array(n), place, allStarts, lasts,
    n, LEAST_FRONT_VERTICES, MOST_ZEROS_SHARE);
  const starts = allStarts.slice(0, number + 1), beyond = [], beyondStarts = new Int32Array(number + 1);
  const above = new Int32Array(number).fill(number), panels = new Int32Array(number + 1);
  for (let k = 0; k < number; k++) {
    const last = lasts[k], own = Array.from(rows.slice(ends[last], ends[last + 1]), (at) => place[at]).sort((a, b) => a - b);
    beyond.push(...own);
    beyondStarts[k + 1] = beyond.length;
    if (own.length) above[k] = lastUpTo(starts, own[0]);
    const width = starts[k + 1] - starts[k];
    panels[k + 1] = panels[k] + 2 * width * (2 * (width + own.length) + 1);
  }
  // the largest number of entries that wait for parents, with those of the current front
  const squares = integers(number, (k) => (2 * (beyondStarts[k + 1] - beyondStarts[k]) + 1) ** 2), taken = new Float64Array(number + 1);
  above.forEach((parent, k) => {
    taken[parent] += squares[k];
  });
  let waiting = 0, most = 0;
  for (let k = 0; k < number; k++) {
    most = Math.max(most, waiting + squares[k]);
    waiting += squares[k] - taken[k];
  }
  const newOrder = new Int32Array(n);
  place.forEach((at, k) => {
    newOrder[at] = order[k];
  });
  const record = frontsRecord(starts, beyondStarts, Int32Array.from(beyond), above, panels, number);
  return {order: newOrder, number, room: panels[number] + most, record};
}

/**
 * Return the pattern of the matrices of a mesh.
 * @param {Int32Array} faces (m, 3)
 * @param {Int32Array} following the next vertex, on the boundary, of each of the first vertices
 * @param {number} n number of vertices
 * @param {number[][]} [cliques] further sets of vertices for all pairs of which there are blocks
 * @returns {Pattern}
 */
export function patternOf(faces, following, n, cliques = []) {
  const more = pairsOf(cliques);
  const {order, number, room, record} = frontsOf(faces, n, cliques), m = faces.length / 3, position = new Int32Array(n);
  order.forEach((vertex, k) => {
    position[vertex] = k;
  });
  const places = new Int32Array(3 * m);
  for (let t = 0; t < m; t++) {
    places.set([position[faces[3 * t]], position[faces[3 * t + 1]], position[faces[3 * t + 2]]].sort((a, b) => a - b), 3 * t);
  }
  const keys = new Float64Array(3 * m + n + more.length / 2);  // row times n plus column
  for (let t = 0; t < m; t++) {
    const a = places[3 * t], b = places[3 * t + 1], c = places[3 * t + 2];
    keys[3 * t] = a * n + b;
    keys[3 * t + 1] = a * n + c;
    keys[3 * t + 2] = b * n + c;
  }
  for (let k = 0; k < n; k++) keys[3 * m + k] = k * (n + 1);
  const keyOf = (/** @type {number} */ a, /** @type {number} */ b) => {
    const p = position[a], q = position[b];
    return p < q ? p * n + q : q * n + p;
  };
  for (let k = 0; k < more.length; k += 2) keys[3 * m + n + k / 2] = keyOf(more[k], more[k + 1]);
  const entries = keys.slice().sort().filter((key, k, all) => k === 0 || key !== all[k - 1]);
  const entry = (/** @type {number} */ key) => lastUpTo(entries, key);
  const own = integers(n, (k) => entry(k * (n + 1))), diagonal = position.map((at) => own[at]);
  const slots = new Int32Array(6 * m);
  for (let t = 0; t < m; t++) {
    const a = places[3 * t], b = places[3 * t + 1], c = places[3 * t + 2];
    slots.set([own[a], entry(keys[3 * t]), entry(keys[3 * t + 1]), own[b], entry(keys[3 * t + 2]), own[c]], 6 * t);
  }
  const ahead = following.map((next, k) => entry(keyOf(k, next)));
  const starts = new Int32Array(n + 1);
  for (const key of entries) starts[Math.floor(key / n) + 1]++;
  for (let k = 0; k < n; k++) starts[k + 1] += starts[k];
  const columns = Int32Array.from(entries, (key) => key % n);
  return {
    position, columns, corners: places.map((at) => order[at]), slots, diagonal,
    record: patternRecord(order, starts, columns, diagonal, ahead, n, columns.length, record),
    entry: (a, b) => entry(keyOf(a, b)),
    factor: () => factorRecord(
      new Scratch(8 * room), new Scratch(8 * n), new Scratch(8 * number), new Scratch(8 * (number + 1)), new Scratch(8 * (2 * n + 1)),
      new Scratch(16 * n)),
  };
}

/**
 * Return the pairs of distinct vertices of some sets, one after the other.
 * @param {number[][]} cliques
 */
function pairsOf(cliques) {
  const pairs = [];
  for (const vertices of cliques) {
    for (let i = 0; i < vertices.length; i++) for (let j = 0; j < i; j++) pairs.push(vertices[i], vertices[j]);
  }
  return Int32Array.from(pairs);
}
