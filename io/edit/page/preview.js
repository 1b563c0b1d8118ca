// The map while a pin is dragged and the server has not answered yet: the last map from the server, with a smooth
// displacement around the pin for each movement since then. It costs a fraction of a frame, has no folds, and keeps the
// outlines and all other pins where they are. What is seen at rest is the server's map.

import {carry} from './carry.js';
import {closest, distance} from './geometry.js';

/** @import {Point, ShapeInfo, Side} from './types.d.ts' */

/** A movement of a pin, with the request that contains it. @typedef {{seq: number, side: Side, source: Point, by: Point, others: Point[]}} Movement */

const FLOATS = 18;          // of a triangle, as in carry.js
const CORNERS = 3;
/** First of the floats of a triangle's corners on each side. */
const FIRST = {target: 0, source: 6};
const MOST_RADIUS_SHARE = 0.35;  // of the displacement around a pin, relative to the diagonal of the shape
const LEAST_RADIUS_SHARE = 0.01; // with less room nothing is displaced
const CLEARANCE = 0.9;      // of the distances to the outlines and to the other pins
const STEP_RADII = 0.3;     // of one displacement; with more than 0.65 triangles fold

export class Preview {
  #shapes;
  /** The last map from the server. @type {Float32Array} */
  #map = new Float32Array(0);
  /** The same after the movements since then. @type {Float32Array} */
  #seen = new Float32Array(0);
  /** @type {Movement[]} */
  #since = [];

  /** @param {Record<Side, Pick<ShapeInfo, 'outline' | 'holes' | 'bounds'>>} shapes */
  constructor(shapes) {
    this.#shapes = shapes;
  }

  /**
   * Return what is seen once the server has sent a map.
   * @param {Float32Array} floats
   * @param {number} seq of the request that it answers: later movements are not in it
   */
  take(floats, seq) {
    this.#map = floats;
    this.#since = this.#since.filter((movement) => movement.seq > seq);
    this.#seen = floats;
    for (const movement of this.#since) this.#displace(movement);
    return this.#seen;
  }

  /** Return the last map from the server, without the movements since then. */
  withdraw() {
    this.#since = [];
    this.#seen = this.#map;
    return this.#map;
  }

  /**
   * Return what is seen after a movement of a pin; null if it is the same.
   * @param {Movement} movement
   */
  move(movement) {
    this.#since.push(movement);
    return this.#displace(movement) ? this.#seen : null;
  }

  /**
   * @param {Movement} movement
   * @returns {boolean} whether there was room for it
   */
  #displace({side, source, by, others}) {
    // where the pin is seen, which need not be its place
    let at = side === 'source' ? source : carry(this.#seen, source, 'source');
    if (!at) return false;
    let left = Math.hypot(...by), floats = this.#seen;
    const direction = by.map((value) => value / (left || 1));
    while (left > 0) {
      const radius = this.#room(side, at, others);
      if (radius === 0) break;
      const step = Math.min(left, STEP_RADII * radius), move = direction.map((value) => step * value);
      floats = displaced(floats, FIRST[side], at, move, radius);
      at = at.map((value, axis) => value + move[axis]);
      left -= step;
    }
    const hasMoved = floats !== this.#seen;
    this.#seen = floats;
    return hasMoved;
  }

  /**
   * Return the radius within which the picture may be displaced around a point; 0 if there is no room.
   * @param {Side} side
   * @param {Point} at
   * @param {Point[]} others the other pins
   */
  #room(side, at, others) {
    const {outline, holes, bounds: [left, top, right, bottom]} = this.#shapes[side], size = Math.hypot(right - left, bottom - top);
    const clear = [...[outline, ...holes].map((ring) => closest(ring, at).away), ...others.map((other) => distance(other, at))];
    const radius = Math.min(MOST_RADIUS_SHARE * size, ...clear.map((away) => CLEARANCE * away));
    return radius > LEAST_RADIUS_SHARE * size ? radius : 0;
  }
}

/**
 * Return a map whose corners on one side are displaced around a point.
 * @param {Float32Array} floats
 * @param {number} first of the floats of a triangle's corners
 * @param {Point} at
 * @param {Point} by
 * @param {number} radius
 */
export function displaced(floats, first, [x, y], [dx, dy], radius) {
  const moved = floats.slice(), square = radius * radius;
  for (let triangle = first; triangle < floats.length; triangle += FLOATS) {
    for (let k = triangle; k < triangle + 2 * CORNERS; k += 2) {
      const away = ((floats[k] - x) ** 2 + (floats[k + 1] - y) ** 2) / square;
      if (away >= 1) continue;
      const share = (1 - away) ** 2;
      moved[k] += share * dx;
      moved[k + 1] += share * dy;
    }
  }
  return moved;
}
