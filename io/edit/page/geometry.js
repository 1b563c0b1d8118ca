// Points in page coordinates, polygons and polylines, and conversion to file units.

/** @import {Point} from './types.d.ts' */

const MAX_DIGITS = 15;         // digits after the point that JavaScript can print
const PLACED_DIGITS = 4;       // significant digits of a length set by hand
const PARTS_OF_PIXEL = 10;     // parts of a pixel to which a point can be placed by hand
const BISECTIONS = 40;         // steps after which a crossing is exact to 1e-12 of a segment
const RIM_DIRECTIONS = 24;     // in which a point near a corner of an outline is sought
const CORNER_REACHES = [1, 1.5, 2, 3];  // distances from there, relative to that from the outline
const LEAST_RIM_SHARE = 0.7;   // of the distance from the outline, in narrow parts
const PARTS_OF_SEGMENT = 8;    // parts in which a segment is mapped, because its image is curved

/**
 * @param {Point} a
 * @param {Point} b
 */
export const distance = (a, b) => Math.hypot(...a.map((value, k) => value - b[k]));

/**
 * Return the point at a fraction of the way from a to b.
 * @param {Point} a
 * @param {Point} b
 * @param {number} share
 */
export const between = (a, b, share) => a.map((value, k) => value + share * (b[k] - value));

/**
 * Round a length to the digits that matter when it is set by hand.
 * @param {number} value
 */
export const significant = (value) => Number(value.toPrecision(PLACED_DIGITS));

/**
 * Return the name of a file without its folder, with the selected part.
 * @param {string} spec
 */
export const fileName = (spec) => spec.replace(/^[^#]*[\\/]/, '');

/** Conversion between file units and page coordinates, in the plane or in space. */
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
   * Convert to file coordinates, rounded, so that page, file and command line show the same numbers.
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
   * Return the number of decimals in file units that a tenth of a pixel corresponds to.
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
 * Return whether a point is inside a closed polygon (even-odd rule).
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
 * Return the longest part of a line inside a closed polygon.
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
 * Find where a segment crosses a closed polygon, by bisection.
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
 * Return the closest point of a closed polygon, its distance, its edge, and its position along that edge (0 to 1).
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
 * Return a point inside a closed polygon, as close as possible to one that is outside or too near to the rim; null where
 * the polygon is too narrow.
 * @param {Point[]} ring
 * @param {Point} point
 * @param {number} margin distance from the rim
 * @returns {Point | null}
 */
export function atRim(ring, point, margin) {
  const [x, y] = closest(ring, point).point, straight = Math.atan2(y - point[1], x - point[0]);
  const at = (/** @type {number} */ angle, reach = 1) => [x + reach * margin * Math.cos(angle), y + reach * margin * Math.sin(angle)];
  const isRoomy = (/** @type {Point} */ place) => inside(ring, place) && closest(ring, place).away >= LEAST_RIM_SHARE * margin;
  const foot = [at(straight), at(straight + Math.PI)].find(isRoomy);  // the second one for points inside
  if (foot) return foot;
  const angles = Array.from({length: RIM_DIRECTIONS}, (_, k) => 2 * Math.PI * k / RIM_DIRECTIONS);
  const places = CORNER_REACHES.flatMap((reach) => angles.map((angle) => at(angle, reach))).filter(isRoomy);
  return places.reduce((/** @type {Point | null} */ best, place) => (best && distance(best, point) <= distance(place, point) ? best : place), null);
}

/**
 * Return the closest point of an edge.
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
 * Simplify a line within a tolerance (Ramer 1972; Douglas and Peucker 1973).
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
 * Subdivide each segment of a line.
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
