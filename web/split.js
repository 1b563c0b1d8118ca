// Split a map's boundary edges at the vertices of both outlines that its mesh skips; as in
// iccm/balanced/model/outline_split.py.

import {SAME_PLACE_SHARE, SNAPPED_EDGE_SHARE} from './constants.js';
import {lastUpTo, modulo} from './curve.js';
import {patternOf} from './linear.js';
import {DiscreteMap, followingOn} from './map.js';
import {matchAt} from './pairs.js';
import {areasOf, Tangled} from './unfold.js';

/** @import {Outline} from './pairs.js' */

/** A boundary vertex; `number` is its former one, -1 for new vertices. @typedef {{s: number, tau: number, atSource: boolean, atTarget: boolean, number: number}} Vertex */


/**
 * Return the map with a boundary vertex at every vertex of both outlines.
 * @param {DiscreteMap} map
 */
export function splitAtVertices(map) {
  const {source, target, border, weights} = map, vertices = merged(snapped(withMissing(map)), source.length, target.length);
  const added = vertices.length - border, count = map.mesh.z.length / 2, place = new Int32Array(count);
  for (let k = border; k < count; k++) place[k] = k + added;
  vertices.forEach(({number}, k) => {
    if (number >= 0) place[number] = k;
  });
  const pairs = {
    s: Float64Array.from(vertices, (vertex) => vertex.s), tau: Float64Array.from(vertices, (vertex) => vertex.tau),
    atSource: Uint8Array.from(vertices, (vertex) => Number(vertex.atSource)), atTarget: Uint8Array.from(vertices, (vertex) => Number(vertex.atTarget)),
  };
  const [z, u] = [map.mesh.z, map.mesh.u].map((inside) => {
    const all = new Float64Array(2 * (count + added));
    all.set(inside.subarray(2 * border), 2 * vertices.length);
    return all;
  });
  z.set(source.curve.at(pairs.s));
  u.set(target.curve.at(pairs.tau));
  const faces = bisected(map.mesh.faces.map((vertex) => place[vertex]), vertices);
  if (areasOf(z, faces).some((area) => !(area > 0))) throw new Tangled();
  const split = new DiscreteMap(source, target, pairs, weights, {z, u, faces, pattern: patternOf(faces, followingOn(vertices.length), count + added)});
  return areasOf(u, faces).some((area) => !(area > 0)) ? split.unfolded(false) : split;
}

/**
 * Return the boundary vertices with those of the outlines that the mesh lacks.
 * @param {DiscreteMap} map
 * @returns {Vertex[]}
 */
function withMissing(map) {
  const {s, tau} = map.pairs, {match} = map, inverse = {s: match.tau, tau: match.s};
  const own = missing(s, map.source), goal = missing(tau, map.target), first = {s: s[0], tau: tau[0], atSource: own.at[0], atTarget: goal.at[0], number: 0};
  /** @type {Vertex[]} */
  const others = [
    ...own.knots.map((at) => ({s: at, tau: matchAt(match, at), atSource: true, atTarget: false, number: -1})),
    ...goal.knots.map((at) => ({s: matchAt(inverse, at), tau: at, atSource: false, atTarget: true, number: -1})),
  ];
  for (let k = 1; k < s.length; k++) others.push({s: s[k], tau: tau[k], atSource: own.at[k], atTarget: goal.at[k], number: k});
  return [first, ...others.sort((a, b) => a.s - b.s || a.tau - b.tau || b.number - a.number)];
}

/**
 * Return the arclengths of an outline's vertices that are not among those of a mesh, and whether each of the latter is at one.
 * @param {Float64Array} own ascending
 * @param {Outline} outline
 */
function missing(own, {curve, length}) {
  const ends = [...own, own[0] + length], at = Array.from(own, () => false), knots = [];
  for (const knot of Array.from(curve.knots.subarray(0, curve.count), (s) => own[0] + modulo(s - own[0], length)).sort((a, b) => a - b)) {
    const before = Math.min(Math.max(lastUpTo(ends, knot), 0), own.length - 1);
    const nearest = knot - ends[before] < ends[before + 1] - knot ? before : before + 1;
    if (Math.abs(ends[nearest] - knot) < SAME_PLACE_SHARE * length) at[nearest % own.length] = true;
    else knots.push(knot);
  }
  return {knots, at};
}

/**
 * Merge mesh vertices that are not at corners into new vertices that are close, which take their numbers.
 * @param {Vertex[]} given
 */
function snapped(given) {
  const vertices = given.map((vertex) => ({...vertex})), dropped = new Set();
  const old = [...vertices.keys()].filter((k) => vertices[k].number >= 0);
  for (let k = 1; k < old.length - 1; k++) {
    const vertex = vertices[old[k]];
    if (vertex.atSource || vertex.atTarget) continue;
    const shorter = Math.min(vertex.s - given[old[k - 1]].s, given[old[k + 1]].s - vertex.s);
    const beside = [old[k] - 1, old[k] + 1].filter((w) => vertices[w].number < 0);
    if (!beside.length) continue;
    const gap = (/** @type {number} */ w) => Math.abs(vertices[w].s - vertex.s), closest = beside.reduce((a, b) => (gap(b) < gap(a) ? b : a));
    if (gap(closest) >= SNAPPED_EDGE_SHARE * shorter) continue;
    vertices[closest].number = vertex.number;
    dropped.add(old[k]);
  }
  return vertices.filter((_, k) => !dropped.has(k));
}

/**
 * Merge a new vertex of the source and one of the target into one where they coincide.
 * @param {Vertex[]} given
 * @param {number} length
 * @param {number} goal
 */
function merged(given, length, goal) {
  const vertices = given.map((vertex) => ({...vertex})), kept = [vertices[0]];
  for (let k = 1; k < vertices.length; k++) {
    const before = vertices[k - 1], vertex = vertices[k];
    const isClose = vertex.s - before.s < SAME_PLACE_SHARE * length && vertex.tau - before.tau < SAME_PLACE_SHARE * goal;
    if (isClose && before.number < 0 && vertex.number < 0 && before.atSource !== vertex.atSource) {
      if (!before.atSource) before.s = vertex.s;
      if (!before.atTarget) before.tau = vertex.tau;
      before.atSource = true;
      before.atTarget = true;
    } else {
      kept.push(vertex);
    }
  }
  kept.forEach((vertex, k) => {
    const next = kept[k + 1] ?? {s: kept[0].s + length, tau: kept[0].tau + goal};
    if (!(next.s > vertex.s && next.tau > vertex.tau)) throw new Tangled();
  });
  return kept;
}

/**
 * Bisect triangles at the new vertices of the boundary.
 * @param {Int32Array} faces
 * @param {Vertex[]} vertices
 */
function bisected(faces, vertices) {
  const count = vertices.length, out = Array.from(faces);
  /** @type {Map<number, number>} the triangle to the left of each edge of the outline */
  const where = new Map();
  const key = (/** @type {number} */ a, /** @type {number} */ b) => a * count + b;
  for (let k = 0; k < faces.length; k++) {
    const a = faces[k], b = faces[k % 3 === 2 ? k - 2 : k + 1];
    if (a < count && b < count) where.set(key(a, b), Math.floor(k / 3));
  }
  const kept = [...vertices.keys()].filter((k) => vertices[k].number >= 0);
  kept.forEach((a, k) => {
    const end = kept[k + 1] ?? count, b = end < count ? end : kept[0];
    if (end === a + 1) return;
    let t = where.get(key(a, b)), tail = a;
    if (t === undefined) throw new Tangled();
    const c = out.slice(3 * t, 3 * t + 3).find((vertex) => vertex !== a && vertex !== b) ?? 0;
    for (let m = a + 1; m < end; m++) {
      out.splice(3 * t, 3, tail, m, c);
      out.push(m, b, c);
      tail = m;
      t = out.length / 3 - 1;
    }
    if (where.has(key(b, c))) where.set(key(b, c), t);
  });
  return Int32Array.from(out);
}
