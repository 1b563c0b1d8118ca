// Points that attract a pin while it is placed or dragged: corners of the outline, mirror images of pins, the mirror
// axis.

import {closest, distance} from './geometry.js';

/** @import {Point} from './types.d.ts' */

const CORNER_REACH = 8;  // pixels
const MIRROR_REACH = 6;  // pixels

/**
 * The nearest of some points, if it is within reach of a pixel.
 * @param {Point[]} points
 * @param {Point} pixel
 * @param {number} reach in pixels
 * @param {(point: Point) => Point} toPixel
 * @returns {Point | null}
 */
function nearest(points, pixel, reach, toPixel) {
  let found = null, least = reach;
  for (const point of points) {
    const away = distance(toPixel(point), pixel);
    if (away < least) [found, least] = [point, away];
  }
  return found;
}

/**
 * Return the point that attracts a pin at a pixel, or null. On the outline this is a corner or the mirror image of
 * another pin; inside it may also lie on the mirror axis.
 * @param {Point} pixel where the pin is
 * @param {boolean} onOutline whether it stays on the outline
 * @param {{outline: Point[], corners?: Point[], axis?: number | null}} shape
 * @param {Point[]} others the other pins
 * @param {{pixel(point: Point): Point, at(pixel: Point): Point}} view
 * @returns {Point | null}
 */
export function attraction(pixel, onOutline, {outline, corners = [], axis}, others, view) {
  const toPixel = (/** @type {Point} */ point) => view.pixel(point);
  const corner = onOutline ? nearest(corners, pixel, CORNER_REACH, toPixel) : null;
  if (corner || typeof axis !== 'number') return corner;
  let images = others.map(([x, y]) => [2 * axis - x, y]);
  if (onOutline) images = images.map((image) => closest(outline, image).point);
  const image = nearest(images, pixel, MIRROR_REACH, toPixel);
  if (image || onOutline) return image;
  return nearest([[axis, view.at(pixel)[1]]], pixel, MIRROR_REACH, toPixel);
}
