// Correspondences of two outlines to start from: elastic matches, and arclength with shifts; as in
// iccm/balanced/search/initial_matches.py, with the same constants.

import {
  ANY_TURN, ARCLENGTH_SHIFTS, CYCLIC_SHIFTS, DIFFERENT_MATCH_DISTANCE, MATCH_STEPS, MOST_TURNED, OUTLINE_SAMPLES, POSITION_WEIGHT,
  TANGENT_CHORD_SHARE, TURNED_STARTS, TURNS,
} from './constants.js';
import {modulo, reals} from './curve.js';
import {matchAt} from './pairs.js';

/** @import {Curve} from './curve.js' */
/** @import {Match} from './pairs.js' */
/** @import {Pins} from './pins.js' */


/**
 * Return unit tangents and midpoints of equal pieces of an outline; the latter in units of the radius of gyration.
 * @param {Curve} curve
 * @param {number} turn rotation in radians
 */
function samples(curve, turn) {
  const {length} = curve, step = length / OUTLINE_SAMPLES, reach = TANGENT_CHORD_SHARE * length;
  const start = curve.at(reals(OUTLINE_SAMPLES, (k) => k * step)), end = curve.at(reals(OUTLINE_SAMPLES, (k) => (k + 1) * step));
  const before = curve.at(reals(OUTLINE_SAMPLES, (k) => k * step - reach)), after = curve.at(reals(OUTLINE_SAMPLES, (k) => (k + 1) * step + reach));
  const c = Math.cos(turn), s = Math.sin(turn), tangents = new Float64Array(2 * OUTLINE_SAMPLES), middles = new Float64Array(2 * OUTLINE_SAMPLES);
  let square = 0;
  for (let k = 0; k < 2 * OUTLINE_SAMPLES; k += 2) {
    const x = after[k] - before[k], y = after[k + 1] - before[k + 1], size = Math.max(Math.hypot(x, y), 1e-12);
    tangents.set([(c * x - s * y) / size, (s * x + c * y) / size], k);
    const mx = 0.5 * (start[k] + end[k]), my = 0.5 * (start[k + 1] + end[k + 1]);
    middles.set([c * mx - s * my, s * mx + c * my], k);
    square += (mx * mx + my * my) / OUTLINE_SAMPLES;
  }
  return {tangents, middles: middles.map((value) => value / Math.sqrt(square))};
}

/**
 * Return elastic matches of the source, rotated, with the target, best first (Sebastian, Klein, Kimia, On aligning
 * curves, 2003): monotone paths of samples that maximise the agreement of tangents and positions, by dynamic
 * programming over cyclic shifts.
 * @param {Curve} source
 * @param {Curve} target
 * @param {number} turn
 * @returns {Match[]}
 */
function elasticMatches(source, target, turn) {
  const own = samples(source, turn), goal = samples(target, 0), n = OUTLINE_SAMPLES;
  const score = new Float64Array(n * n);
  for (let i = 0; i < n; i++) {
    for (let j = 0; j < n; j++) {
      const angle = own.tangents[2 * i] * goal.tangents[2 * j] + own.tangents[2 * i + 1] * goal.tangents[2 * j + 1];
      const x = own.middles[2 * i] - goal.middles[2 * j], y = own.middles[2 * i + 1] - goal.middles[2 * j + 1];
      score[n * i + j] = angle - POSITION_WEIGHT * (x * x + y * y);
    }
  }
  const found = [];
  for (let shift = 0; shift < n; shift += n / CYCLIC_SHIFTS) found.push(bestPath(score, shift));
  found.sort((a, b) => b.score - a.score);
  return found.map(({rows, columns, shift}) => ({
    s: rows.map((row) => row / n * source.length), tau: columns.map((column) => (column + shift) / n * target.length),
  }));
}

/**
 * @param {Float64Array} score (n, n) gain of matching two samples
 * @param {number} shift of the target's samples
 */
function bestPath(score, shift) {
  const n = OUTLINE_SAMPLES, width = n + 1, best = new Float64Array(width * width).fill(-Infinity), step = new Int8Array(width * width);
  best[0] = 0;
  for (let i = 1; i <= n; i++) {
    for (let j = 1; j <= n; j++) {
      MATCH_STEPS.forEach(([a, b], k) => {
        if (a > i || b > j) return;
        const before = best[width * (i - a) + j - b];
        if (before === -Infinity) return;
        const count = Math.max(a, b);
        let gain = 0;
        for (let m = 0; m < count; m++) {
          gain += score[n * ((i - a + Math.floor(m * a / count)) % n) + (j - b + Math.floor(m * b / count) + shift) % n];
        }
        const total = before + gain * Math.sqrt(a * b) / count;
        if (total > best[width * i + j]) {
          best[width * i + j] = total;
          step[width * i + j] = k;
        }
      });
    }
  }
  const rows = [n], columns = [n];
  for (let i = n, j = n; i > 0;) {
    const [a, b] = MATCH_STEPS[step[width * i + j]];
    i -= a;
    j -= b;
    rows.unshift(i);
    columns.unshift(j);
  }
  return {score: best[width * width - 1], rows, columns, shift};
}

/**
 * Return the rotation in radians of the similarity that fits a match best.
 * @param {Match} match
 * @param {Curve} source
 * @param {Curve} target
 */
function impliedTurn(match, source, target) {
  const s = reals(OUTLINE_SAMPLES, (k) => source.length * k / OUTLINE_SAMPLES), own = source.at(s), goal = target.at(s.map((at) => matchAt(match, at)));
  let x = 0, y = 0;
  for (let k = 0; k < 2 * OUTLINE_SAMPLES; k += 2) {
    x += own[k] * goal[k] + own[k + 1] * goal[k + 1];
    y += own[k] * goal[k + 1] - own[k + 1] * goal[k];
  }
  return Math.atan2(y, x);
}

/** A list of matches that rejects matches similar to those it has. */
class Different {
  /** @type {Match[]} */
  matches = [];
  /** Places of samples of the source on the target, as angles. @type {Float64Array[]} */
  #kept = [];

  /**
   * @param {Curve} source
   * @param {Curve} target
   */
  constructor(source, target) {
    this.source = source;
    this.target = target;
  }

  /**
   * Add the best elastic matches at a rotation.
   * @param {number} turn
   * @param {number} most number of matches
   */
  add(turn, most) {
    const {source, target} = this, at = reals(OUTLINE_SAMPLES, (k) => source.length * k / OUTLINE_SAMPLES);
    let count = most;
    for (const match of elasticMatches(source, target, turn)) {
      if (!count) break;
      const places = at.map((s) => 2 * Math.PI * matchAt(match, s) / target.length);
      const isOld = this.#kept.some((other) => {
        const mean = places.reduce((sum, angle, k) => sum + 2 * Math.abs(Math.sin(0.5 * (angle - other[k]))), 0) / OUTLINE_SAMPLES;
        return mean < DIFFERENT_MATCH_DISTANCE;
      });
      if (isOld) continue;
      this.#kept.push(places);
      this.matches.push(match);
      count--;
    }
  }
}

/**
 * Return the matches to start from: if rotations cost, none that turns the picture upside down, unless there are no others.
 * @param {Curve} source
 * @param {Curve} target
 * @param {boolean} isFree whether all rotations cost the same
 * @param {Pins | null} pins
 * @returns {Match[]}
 */
export function candidates(source, target, isFree, pins) {
  const found = new Different(source, target);
  for (const [turn, most] of isFree ? ANY_TURN : TURNS) found.add(turn, most);
  const matches = found.matches.slice();
  for (let k = 0; k < ARCLENGTH_SHIFTS; k++) {
    const shift = target.length * k / ARCLENGTH_SHIFTS;
    matches.push({s: [0, source.length], tau: [shift, shift + target.length]});
  }
  const upright = isFree ? matches : matches.filter((match) => {
    const angle = modulo(impliedTurn(match, source, target) + Math.PI, 2 * Math.PI) - Math.PI;
    return Math.abs(angle) < MOST_TURNED;
  });
  return [...upright.length ? upright : matches, ...pinAligned(source, target, pins)];
}

/**
 * Return elastic matches at the rotation that fits the pins best; none for fewer than two pins.
 * @param {Curve} source
 * @param {Curve} target
 * @param {Pins | null} pins
 */
function pinAligned(source, target, pins) {
  if (!pins || pins.count < 2) return [];
  const {points, places} = pins, found = new Different(source, target);
  const mean = (/** @type {Float64Array} */ z, /** @type {number} */ axis) => z.reduce((sum, value, k) => sum + (k % 2 === axis ? value : 0), 0) / pins.count;
  const [mx, my, nx, ny] = [mean(points, 0), mean(points, 1), mean(places, 0), mean(places, 1)];
  let x = 0, y = 0;
  for (let k = 0; k < 2 * pins.count; k += 2) {
    const [ax, ay, bx, by] = [points[k] - mx, points[k + 1] - my, places[k] - nx, places[k + 1] - ny];
    x += ax * bx + ay * by;
    y += ax * by - ay * bx;
  }
  found.add(Math.atan2(y, x), TURNED_STARTS);
  return found.matches;
}
