// Closed polylines in the plane, and small helpers for arrays. Points are pairs of numbers in one array: x0, y0, x1, y1, …

/** @import {Frame} from './types.d.ts' */

/**
 * Return an array of numbers computed from their index.
 * @param {number} count
 * @param {(k: number) => number} value
 */
export const reals = (count, value) => Float64Array.from({length: count}, (_, k) => value(k));

/**
 * Return the index of the last of some ascending numbers that is not greater than a value; -1 if all are.
 * @param {ArrayLike<number>} ascending
 * @param {number} value
 */
export function lastUpTo(ascending, value) {
  let low = -1, high = ascending.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (ascending[middle] <= value) low = middle;
    else high = middle;
  }
  return low;
}

/**
 * Interpolate linearly between (x, y) with ascending x; constant beyond the ends.
 * @param {number} at
 * @param {ArrayLike<number>} x
 * @param {ArrayLike<number>} y
 */
export function interpolate(at, x, y) {
  const k = lastUpTo(x, at), last = x.length - 1;
  if (k < 0) return y[0];
  if (k >= last) return y[last];
  return x[k + 1] > x[k] ? y[k] + (at - x[k]) / (x[k + 1] - x[k]) * (y[k + 1] - y[k]) : y[k];
}

/**
 * The remainder with the sign of the divisor.
 * @param {number} a
 * @param {number} b
 */
export const modulo = (a, b) => a - b * Math.floor(a / b);

/** A closed polyline, counter-clockwise. */
export class Curve {
  /** @param {Float64Array} z its vertices, without repetition of the first one */
  constructor(z) {
    this.z = z;
    /** Number of vertices. */
    this.count = z.length / 2;
    /** Arclengths of the vertices, and the total length at the end. */
    this.knots = new Float64Array(this.count + 1);
    for (let k = 0; k < this.count; k++) {
      const [x, y] = this.edge(k);
      this.knots[k + 1] = this.knots[k] + Math.hypot(x, y);
    }
    this.length = this.knots[this.count];
  }

  /**
   * The vector from a vertex to the next one.
   * @param {number} k
   */
  edge(k) {
    const a = 2 * k, b = 2 * ((k + 1) % this.count);
    return [this.z[b] - this.z[a], this.z[b + 1] - this.z[a + 1]];
  }

  /** Signed angle in radians by which the polyline bends at each vertex. */
  get bends() {
    return reals(this.count, (k) => {
      const [ax, ay] = this.edge((k + this.count - 1) % this.count), [bx, by] = this.edge(k);
      return Math.atan2(ax * by - ay * bx, ax * bx + ay * by);
    });
  }

  /** Length of the diagonal of the bounding box. */
  get diagonal() {
    const [left, bottom, right, top] = boxOf(this.z);
    return Math.hypot(right - left, top - bottom);
  }

  /**
   * Return whether a point is inside (even-odd rule).
   * @param {number} x
   * @param {number} y
   */
  contains(x, y) {
    const {z, count} = this;
    let odd = false;
    for (let a = 0, b = 2 * (count - 1); a < 2 * count; b = a, a += 2) {
      if ((z[a + 1] > y) !== (z[b + 1] > y) && x < z[a] + (y - z[a + 1]) / (z[b + 1] - z[a + 1]) * (z[b] - z[a])) odd = !odd;
    }
    return odd;
  }

  /**
   * Return the distance of a point from the polyline.
   * @param {number} x
   * @param {number} y
   */
  distance(x, y) {
    const {z, count} = this;
    let least = Infinity;
    for (let a = 0, b = 2 * (count - 1); a < 2 * count; b = a, a += 2) {
      least = Math.min(least, distanceToSegment(x, y, z[a], z[a + 1], z[b], z[b + 1]));
    }
    return least;
  }

  /**
   * Return the points at arclengths, on any lap.
   * @param {ArrayLike<number>} s
   */
  at(s) {
    const points = new Float64Array(2 * s.length);
    for (let k = 0; k < s.length; k++) {
      const own = modulo(s[k], this.length), edge = Math.min(Math.max(lastUpTo(this.knots, own), 0), this.count - 1);
      const [x, y] = this.edge(edge), span = this.knots[edge + 1] - this.knots[edge];
      const share = span > 0 ? (own - this.knots[edge]) / span : 0;
      points[2 * k] = this.z[2 * edge] + share * x;
      points[2 * k + 1] = this.z[2 * edge + 1] + share * y;
    }
    return points;
  }

  /**
   * Return the indices of the vertices that Douglas and Peucker's method (1973) keeps.
   * @param {number} fineness largest distance of the others, relative to the diagonal
   */
  keptVertices(fineness) {
    const {z, count} = this, kept = new Uint8Array(count), most = fineness * this.diagonal;
    kept[0] = 1;
    /** @type {[number, number][]} */
    const ranges = [[0, count]];  // from a vertex to another one; count stands for the first vertex again
    for (let range = ranges.pop(); range; range = ranges.pop()) {
      const [first, last] = range, a = 2 * first, b = 2 * (last % count);
      let farthest = -1, away = most;
      for (let k = first + 1; k < last; k++) {
        const distance = distanceToSegment(z[2 * k], z[2 * k + 1], z[a], z[a + 1], z[b], z[b + 1]);
        if (distance > away) {
          away = distance;
          farthest = k;
        }
      }
      if (farthest < 0) continue;
      kept[farthest] = 1;
      ranges.push([first, farthest], [farthest, last]);
    }
    const indices = [];
    for (let k = 0; k < count; k++) if (kept[k]) indices.push(k);
    return indices;
  }
}

/**
 * @param {number} x
 * @param {number} y
 * @param {number} ax
 * @param {number} ay
 * @param {number} bx
 * @param {number} by
 */
function distanceToSegment(x, y, ax, ay, bx, by) {
  const dx = bx - ax, dy = by - ay, square = dx * dx + dy * dy;
  const share = square > 0 ? Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / square, 0), 1) : 0;
  return Math.hypot(x - ax - share * dx, y - ay - share * dy);
}

/**
 * Return left, bottom, right and top of points.
 * @param {Float64Array} z
 */
export function boxOf(z) {
  let left = Infinity, bottom = Infinity, right = -Infinity, top = -Infinity;
  for (let k = 0; k < z.length; k += 2) {
    left = Math.min(left, z[k]);
    right = Math.max(right, z[k]);
    bottom = Math.min(bottom, z[k + 1]);
    top = Math.max(top, z[k + 1]);
  }
  return [left, bottom, right, top];
}

/**
 * Return the points of some vertices.
 * @param {Float64Array} z
 * @param {ArrayLike<number>} vertices
 */
export function take(z, vertices) {
  const points = new Float64Array(2 * vertices.length);
  for (let k = 0; k < vertices.length; k++) {
    points[2 * k] = z[2 * vertices[k]];
    points[2 * k + 1] = z[2 * vertices[k] + 1];
  }
  return points;
}

/**
 * Return area and centroid of a polygon.
 * @param {Float64Array} z
 */
export function moments(z) {
  const count = z.length / 2, x0 = z[0], y0 = z[1];
  let area = 0, x = 0, y = 0;
  for (let k = 0; k < count; k++) {
    const n = (k + 1) % count, ax = z[2 * k] - x0, ay = z[2 * k + 1] - y0, bx = z[2 * n] - x0, by = z[2 * n + 1] - y0;
    const cross = ax * by - ay * bx;
    area += 0.5 * cross;
    x += cross * (ax + bx);
    y += cross * (ay + by);
  }
  return {area, x: x0 + x / (6 * area), y: y0 + y / (6 * area)};
}

/**
 * Return a shape in unit coordinates, counter-clockwise and beginning at its farthest vertex, and the frame.
 * @param {Float64Array} z with y up
 * @returns {{curve: Curve, frame: Frame}}
 */
export function unitCurve(z) {
  const distinct = [];
  for (let k = 0; k < z.length; k += 2) {
    const before = (k + z.length - 2) % z.length;
    if (z[k] !== z[before] || z[k + 1] !== z[before + 1]) distinct.push(z[k], z[k + 1]);
  }
  const {area, x, y} = moments(Float64Array.from(distinct));
  if (distinct.length < 6 || !(Math.abs(area) > 0)) throw new Error('The outline encloses no area.');
  const frame = {x, y, scale: 1 / Math.sqrt(Math.abs(area))}, unit = toUnit(Float64Array.from(distinct), frame);
  if (isCrossing(unit)) throw new Error('The outline crosses itself; draw one without crossings.');
  const count = unit.length / 2;
  let first = 0, most = 0;
  for (let k = 0; k < count; k++) {
    const away = Math.hypot(unit[2 * k], unit[2 * k + 1]);
    if (away > most + 1e-9) {
      most = away;
      first = k;
    }
  }
  const order = Array.from({length: count}, (_, k) => modulo(area > 0 ? first + k : first - k, count));
  return {curve: new Curve(take(unit, order)), frame};
}

/**
 * @param {Float64Array} z
 * @param {Frame} frame
 */
export const toUnit = (z, frame) => z.map((value, k) => (value - (k % 2 ? frame.y : frame.x)) * frame.scale);

/**
 * @param {Float64Array} z
 * @param {Frame} frame
 */
export const fromUnit = (z, frame) => z.map((value, k) => value / frame.scale + (k % 2 ? frame.y : frame.x));

/**
 * Return whether two edges of a polygon that are not neighbours cross or touch.
 * @param {Float64Array} z
 */
export function isCrossing(z) {
  const count = z.length / 2;
  const side = (/** @type {number} */ a, /** @type {number} */ b, /** @type {number} */ c) =>
    (z[2 * b] - z[2 * a]) * (z[2 * c + 1] - z[2 * a + 1]) - (z[2 * b + 1] - z[2 * a + 1]) * (z[2 * c] - z[2 * a]);
  for (let i = 0; i < count; i++) {
    const a = i, b = (i + 1) % count;
    const left = Math.min(z[2 * a], z[2 * b]), right = Math.max(z[2 * a], z[2 * b]);
    const bottom = Math.min(z[2 * a + 1], z[2 * b + 1]), top = Math.max(z[2 * a + 1], z[2 * b + 1]);
    for (let j = i + 2; j < count; j++) {
      const c = j, d = (j + 1) % count;
      if (d === a) continue;
      if (Math.max(z[2 * c], z[2 * d]) < left || Math.min(z[2 * c], z[2 * d]) > right) continue;
      if (Math.max(z[2 * c + 1], z[2 * d + 1]) < bottom || Math.min(z[2 * c + 1], z[2 * d + 1]) > top) continue;
      if (side(a, b, c) * side(a, b, d) <= 0 && side(c, d, a) * side(c, d, b) <= 0) return true;
    }
  }
  return false;
}
