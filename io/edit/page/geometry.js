// Points of the page's own coordinates, polygons and lines, and the conversion to a file's units.

/** @import {Point} from './types.d.ts' */

const MAX_DIGITS = 15;         // that a number of JavaScript can have after its point
const PLACED_DIGITS = 4;       // of a length that is set by hand
const PARTS_OF_PIXEL = 10;     // that a hand can place
const BISECTIONS = 40;         // steps after which a crossing is exact to 1e-12 of a segment
const PARTS_OF_SEGMENT = 8;    // in which a segment is mapped: its image is curved

/**
 * @param {Point} a
 * @param {Point} b
 */
export const distance = (a, b) => Math.hypot(...a.map((value, k) => value - b[k]));

/**
 * The point at a share of the way from one to another.
 * @param {Point} a
 * @param {Point} b
 * @param {number} share
 */
export const between = (a, b, share) => a.map((value, k) => value + share * (b[k] - value));

/**
 * A length with as many digits as a hand can place.
 * @param {number} value
 */
export const significant = (value) => Number(value.toPrecision(PLACED_DIGITS));

/**
 * The name of a file without its folder, with the part that is meant.
 * @param {string} spec
 */
export const fileName = (spec) => spec.replace(/^[^#]*[\\/]/, '');

/** Conversion between a file's units and the page's coordinates, of the plane or of space. */
export class Units {
  /**
   * @param {{origin: number[], scale: number, signs: number[]}} shape
   * @param {number} digits that matter, relative to the shape's size
   */
  constructor({origin, scale, signs}, digits) {
    this.origin = origin;
    this.scale = scale;
    this.signs = signs;
    this.digits = Math.max(0, Math.min(MAX_DIGITS, digits - Math.floor(Math.log10(scale))));
  }

  /**
   * Coordinates of the file, rounded, so that the page, the file and the command line have the same ones.
   * @param {Point} point
   * @param {number} [digits] after the point, where fewer than all matter
   */
  file(point, digits = this.digits) {
    return point.map((value, k) => {
      const exact = this.origin[k] + this.signs[k] * this.scale * value;
      return Number(exact.toFixed(Math.min(digits, this.digits)));
    });
  }

  /**
   * The digits after the point of what a hand can place on a screen: of a tenth of a pixel.
   * @param {number} zoom pixels per unit of the page
   */
  placedDigits(zoom) {
    return Math.max(0, Math.min(this.digits, Math.ceil(Math.log10(PARTS_OF_PIXEL * zoom / this.scale))));
  }

  /**
   * @param {number[]} place
   * @returns {Point}
   */
  page(place) {
    return place.map((value, k) => this.signs[k] * (value - this.origin[k]) / this.scale);
  }
}

/**
 * Whether a point is inside of a closed polygon (even-odd rule).
 * @param {Point[]} ring
 * @param {Point} point
 */
export function inside(ring, [x, y]) {
  let odd = false;
  ring.forEach(([a, b], k) => {
    const [c, d] = ring[(k + 1) % ring.length];
    if ((b > y) !== (d > y) && x < a + (y - b) / (d - b) * (c - a)) odd = !odd;
  });
  return odd;
}

/**
 * The longest part of a line that is inside of a closed polygon.
 * @param {Point[]} ring
 * @param {Point[]} line
 */
export function clipped(ring, line) {
  /** @type {Point[][]} */
  const parts = [];
  let wasInside = false;
  line.forEach((point, k) => {
    const isInside = inside(ring, point);
    if (isInside && !wasInside) parts.push([]);
    const part = parts[parts.length - 1];
    if (k > 0 && isInside !== wasInside) part.push(crossing(ring, line[k - 1], point, wasInside));
    if (isInside) part.push(point);
    wasInside = isInside;
  });
  return parts.reduce((best, part) => (length(part) > length(best) ? part : best), parts[0] ?? []);
}

/** @param {Point[]} line */
export const length = (line) => line.reduce((sum, point, k) => sum + (k ? distance(point, line[k - 1]) : 0), 0);

/**
 * Where a segment crosses a closed polygon, by bisection.
 * @param {Point[]} ring
 * @param {Point} a
 * @param {Point} b
 * @param {boolean} startsInside
 */
function crossing(ring, a, b, startsInside) {
  let low = 0, high = 1;
  for (let k = 0; k < BISECTIONS; k++) {
    const middle = (low + high) / 2;
    if (inside(ring, between(a, b, middle)) === startsInside) low = middle;
    else high = middle;
  }
  return closest(ring, between(a, b, low)).point;
}

/**
 * The closest point of a closed polygon, its distance, the edge that it is on, and its share of that edge.
 * @param {Point[]} ring
 * @param {Point} point
 */
export function closest(ring, point) {
  /** @type {{point: Point, away: number, edge: number, share: number}} */
  let best = {point: ring[0], away: Infinity, edge: 0, share: 0};
  ring.forEach((start, edge) => {
    const foot = footOn(start, ring[(edge + 1) % ring.length], point), away = distance(foot.point, point);
    if (away < best.away) best = {point: foot.point, away, edge, share: foot.share};
  });
  return best;
}

/**
 * The closest point of an edge.
 * @param {Point} a
 * @param {Point} b
 * @param {Point} point
 */
function footOn(a, b, point) {
  let along = 0, square = 0;
  a.forEach((value, k) => {
    along += (point[k] - value) * (b[k] - value);
    square += (b[k] - value) ** 2;
  });
  const share = Math.min(1, Math.max(0, along / (square || 1)));
  return {point: between(a, b, share), share};
}

/**
 * A line with fewer points, within a tolerance of it (Ramer 1972; Douglas and Peucker 1973).
 * @param {Point[]} points
 * @param {number} tolerance
 * @returns {Point[]}
 */
export function simplified(points, tolerance) {
  const a = points[0], b = points[points.length - 1];
  let farthest = 0, at = 0;
  points.forEach((point, k) => {
    const away = distance(footOn(a, b, point).point, point);
    if (away > farthest) [farthest, at] = [away, k];
  });
  if (farthest <= tolerance || points.length < 3) return [a, b];
  const first = simplified(points.slice(0, at + 1), tolerance), second = simplified(points.slice(at), tolerance);
  return [...first, ...second.slice(1)];
}

/**
 * A line with further points on each of its segments.
 * @param {Point[]} points
 * @param {number} [parts] of each segment
 */
export function finer(points, parts = PARTS_OF_SEGMENT) {
  /** @type {Point[]} */
  const line = [];
  for (let k = 1; k < points.length; k++) {
    for (let part = 0; part < parts; part++) line.push(between(points[k - 1], points[k], part / parts));
  }
  line.push(points[points.length - 1]);
  return line;
}
