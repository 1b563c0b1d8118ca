// Outlines at one level of the search, their correspondences, and the boundary vertices of a mesh; as in
// iccm/balanced/model/outline.py and boundary_pairs.py.

import {BOTH, MERGED_SPACING_SHARE, SHARP_CORNER_RADIANS, SOURCE, TARGET} from './constants.js';
import {Curve, interpolate, lastUpTo, modulo, reals, take} from './curve.js';

/** A monotone correspondence: ascending arclengths; the last ones are the first ones plus the lengths. @typedef {{s: ArrayLike<number>, tau: ArrayLike<number>}} Match */
/** Boundary vertices: ascending arclengths, and whether a vertex is at a corner. @typedef {{s: Float64Array, tau: Float64Array, atSource: Uint8Array, atTarget: Uint8Array}} Pairs */
/** @typedef {{s: number, tau: number, kind: number}} Pair */

const LEAST_GAP = 1e-10;    // relative to the length

/**
 * Return τ at an arclength of the source, on any lap.
 * @param {Match} match
 * @param {number} at
 */
export function matchAt({s, tau}, at) {
  const last = s.length - 1, length = s[last] - s[0], laps = Math.floor((at - s[0]) / length);
  return interpolate(at - laps * length, s, tau) + laps * (tau[last] - tau[0]);
}

/** One outline at one level: simplified, with the corners that get vertices. */
export class Outline {
  /**
   * @param {Curve} curve the simplified polyline
   * @param {Float64Array} origins arclengths of its knots on the original curve
   * @param {number[]} vertices the vertices that every mesh of this level has
   */
  constructor(curve, origins, vertices) {
    this.curve = curve;
    this.length = curve.length;
    this.origins = origins;
    this.vertices = vertices;
    /** Ascending arclengths of these vertices. */
    this.corners = vertices.map((k) => curve.knots[k]);
    const {bends} = curve;
    /** Arclengths of the corners at which sliding vertices stop. */
    this.sharp = Float64Array.from([...bends.keys()].filter((k) => Math.abs(bends[k]) > SHARP_CORNER_RADIANS), (k) => curve.knots[k]);
  }

  /**
   * Simplify a curve, and choose its corners by simplifying it further.
   * @param {Curve} curve
   * @param {number} fineness largest distance of the polyline from the curve, relative to the diagonal
   * @param {number} cornerFineness the same for the polyline of the corners alone
   * @param {number} [spacing] if finite, only vertices where the outline bends sharply within this length are corners
   */
  static of(curve, fineness, cornerFineness, spacing = Infinity) {
    const kept = curve.keptVertices(fineness), simple = new Curve(take(curve.z, kept));
    const origins = Float64Array.from([...kept.map((k) => curve.knots[k]), curve.knots[kept[0]] + curve.length]);
    let corners = simple.keptVertices(cornerFineness);
    if (spacing < Infinity) {
      const bending = bendsWithin(new Curve(take(simple.z, corners)), spacing);
      corners = corners.filter((_, k) => bending[k] > SHARP_CORNER_RADIANS);
    }
    return new Outline(simple, origins, corners);
  }

  /**
   * Return the same outline with edges no longer than a length.
   * @param {number} most
   */
  subdivided(most) {
    const {curve} = this, points = [], origins = [], places = new Int32Array(curve.count);
    for (let k = 0; k < curve.count; k++) {
      const [x, y] = curve.edge(k), parts = Math.max(1, Math.ceil(Math.hypot(x, y) / most));
      places[k] = origins.length;
      for (let part = 0; part < parts; part++) {
        points.push(curve.z[2 * k] + part / parts * x, curve.z[2 * k + 1] + part / parts * y);
        origins.push(this.origins[k] + part / parts * (this.origins[k + 1] - this.origins[k]));
      }
    }
    const all = Float64Array.from([...origins, this.origins[curve.count]]);
    return new Outline(new Curve(Float64Array.from(points)), all, this.vertices.map((k) => places[k]));
  }

  /**
   * Return the outline with its vertices at other points; it becomes the original curve.
   * @param {Float64Array} z
   */
  movedTo(z) {
    const curve = new Curve(z);
    return new Outline(curve, curve.knots, this.vertices);
  }

  get #lap() {
    return this.origins[this.origins.length - 1] - this.origins[0];
  }

  /**
   * Return the arclength on the original curve.
   * @param {number} s
   */
  original(s) {
    const laps = Math.floor(s / this.length);
    return interpolate(s - laps * this.length, this.curve.knots, this.origins) + laps * this.#lap;
  }

  /**
   * Return the arclength on the simplified polyline.
   * @param {number} s on the original curve
   */
  simplifiedFrom(s) {
    const laps = Math.floor((s - this.origins[0]) / this.#lap);
    return interpolate(s - laps * this.#lap, this.origins, this.curve.knots) + laps * this.length;
  }
}

/**
 * Return the angle in radians by which a closed polyline bends within half the spacing on both sides of each vertex.
 * @param {Curve} curve
 * @param {number} spacing
 */
function bendsWithin(curve, spacing) {
  const {bends, count, length, knots} = curve;
  const sums = new Float64Array(3 * count + 1), laps = reals(3 * count, (k) => knots[k % count] + (Math.floor(k / count) - 1) * length);
  for (let k = 0; k < 3 * count; k++) sums[k + 1] = sums[k] + bends[k % count];
  return reals(count, (k) => {
    const first = lastUpTo(laps, knots[k] - 0.5 * spacing) + 1, after = lastUpTo(laps, knots[k] + 0.5 * spacing) + 1;
    return Math.max(Math.abs(sums[after] - sums[first]), Math.abs(bends[k]));
  });
}

/**
 * Return the match with slopes, relative to the mean one, between 1/steepest and steepest.
 * @param {Match} match
 * @param {number} steepest
 * @returns {Match}
 */
export function limitSlope({s, tau}, steepest) {
  const count = s.length - 1, goal = tau[count] - tau[0], mean = goal / (s[count] - s[0]), sums = [0];
  for (let k = 0; k < count; k++) {
    const span = s[k + 1] - s[k], slope = (tau[k + 1] - tau[k]) / Math.max(span * mean, 1e-300);
    sums.push(sums[k] + span * Math.min(Math.max(slope, 1 / steepest), steepest));
  }
  return {s, tau: sums.map((sum) => tau[0] + sum * goal / sums[count])};
}

/**
 * Return the corners of both outlines with their partners, and as many pairs between them as the spacing requires.
 * @param {Outline} source
 * @param {Outline} target
 * @param {Match} match
 * @param {number} spacing the longest edge allowed on either side
 * @returns {Pairs}
 */
export function boundaryPairs(source, target, match, spacing) {
  let pairs = cornerPairs(source, target, match);
  if (!pairs.length) pairs = [{s: match.s[0], tau: match.tau[0], kind: 0}];
  pairs = mergeCorners(afterWidestGap(pairs, source.length, target.length), source.length, target.length, MERGED_SPACING_SHARE * spacing);
  const s = /** @type {number[]} */ ([]), tau = /** @type {number[]} */ ([]);
  const atSource = /** @type {number[]} */ ([]), atTarget = /** @type {number[]} */ ([]);
  pairs.forEach((pair, k) => {
    const [ds, dt] = gapsAfter(pairs, k, source.length, target.length);
    if (Math.min(ds / source.length, dt / target.length) < LEAST_GAP) throw new Error('two corners of the outlines coincide');
    const parts = Math.max(1, Math.ceil(Math.max(ds, dt) / spacing - 1e-6));
    for (let part = 0; part < parts; part++) {
      s.push(pair.s + part / parts * ds);
      tau.push(pair.tau + part / parts * dt);
      atSource.push(part === 0 && pair.kind & SOURCE ? 1 : 0);
      atTarget.push(part === 0 && pair.kind & TARGET ? 1 : 0);
    }
  });
  return {
    s: Float64Array.from(s), tau: Float64Array.from(tau), atSource: Uint8Array.from(atSource), atTarget: Uint8Array.from(atTarget),
  };
}

/**
 * @param {Outline} source
 * @param {Outline} target
 * @param {Match} match
 * @returns {Pair[]}
 */
function cornerPairs(source, target, match) {
  const s0 = match.s[0], t0 = match.tau[0];
  const own = source.corners.map((at) => s0 + modulo(at - s0, source.length)).map((s) => ({s, tau: interpolate(s, match.s, match.tau), kind: SOURCE}));
  const goals = target.corners.map((at) => t0 + modulo(at - t0, target.length)).map((tau) => ({s: interpolate(tau, match.tau, match.s), tau, kind: TARGET}));
  return [...own, ...goals].sort((a, b) => a.s - b.s || a.tau - b.tau);
}

/**
 * @param {Pair[]} pairs
 * @param {number} k
 * @param {number} length
 * @param {number} goal
 */
function gapsAfter(pairs, k, length, goal) {
  const next = pairs[(k + 1) % pairs.length], lap = k === pairs.length - 1 ? 1 : 0;
  return [next.s + lap * length - pairs[k].s, next.tau + lap * goal - pairs[k].tau];
}

/**
 * Return the pairs starting after the widest gap, so that none are merged across the end of the lap.
 * @param {Pair[]} pairs
 * @param {number} length
 * @param {number} goal
 */
function afterWidestGap(pairs, length, goal) {
  let widest = 0, most = -Infinity;
  pairs.forEach((_, k) => {
    const [ds, dt] = gapsAfter(pairs, k, length, goal);
    if (ds / length + dt / goal > most) {
      most = ds / length + dt / goal;
      widest = k;
    }
  });
  return [...pairs.slice(widest + 1), ...pairs.slice(0, widest + 1).map(({s, tau, kind}) => ({s: s + length, tau: tau + goal, kind}))];
}

/**
 * Merge neighbours, one a corner of the source and one of the target, into one pair where both gaps are small, unless
 * that would more than double a neighbouring gap.
 * @param {Pair[]} given
 * @param {number} length
 * @param {number} goal
 * @param {number} near
 */
function mergeCorners(given, length, goal, near) {
  const pairs = given.map((pair) => ({...pair})), count = pairs.length, keep = new Uint8Array(count).fill(1);
  const before = pairs.map((_, k) => (k + count - 1) % count), after = pairs.map((_, k) => (k + 1) % count);
  const gaps = pairs.map((_, k) => gapsAfter(pairs, k, length, goal)), ds = gaps.map((gap) => gap[0]), dt = gaps.map((gap) => gap[1]);
  const close = [...pairs.keys()].filter((k) => {
    const kind = pairs[k].kind, next = pairs[after[k]].kind;
    return kind !== next && kind !== BOTH && next !== BOTH && ds[k] < near && dt[k] < near;
  });
  close.sort((a, b) => ds[a] + dt[a] - ds[b] - dt[b]);
  for (const i of close) {
    const j = after[i];
    if (pairs[i].kind === BOTH || pairs[j].kind === BOTH || !(keep[i] && keep[j]) || j === 0) continue;
    const p = before[i], n = after[j], isSource = pairs[i].kind === SOURCE;
    const [ahead, behind] = isSource ? [ds[j], dt[p]] : [dt[j], ds[p]];
    const [first, second] = isSource ? [ds[i], dt[i]] : [dt[i], ds[i]];
    if (first > ahead || second > behind) continue;
    if (isSource) pairs[i].tau = pairs[j].tau;
    else pairs[i].s = pairs[j].s;
    pairs[i].kind = BOTH;
    keep[j] = 0;
    before[n] = i;
    after[i] = n;
    for (const v of [p, i]) {
      const lap = after[v] <= v ? 1 : 0;
      ds[v] = pairs[after[v]].s - pairs[v].s + lap * length;
      dt[v] = pairs[after[v]].tau - pairs[v].tau + lap * goal;
    }
  }
  return pairs.filter((_, k) => keep[k]);
}
