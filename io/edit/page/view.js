// The view of a pane: the point in its middle, and pixels per unit.

/** @import {Box, Point} from './types.d.ts' */

const MIN_ZOOM = 0.2;   // relative to the zoom at which everything is visible
const MAX_ZOOM = 2000;  // relative to the same
const FILLED = 0.92;    // share of the pane filled by the shape when everything is visible

export class View {
  x = 0;
  y = 0;
  zoom = 1;
  width = 1;
  height = 1;
  /** Whether everything is visible, and should stay so when the window is resized. */
  whole = false;
  #zoomOfAll = 1;

  /** The pixel in the middle of the pane. */
  get middle() {
    return [this.width / 2, this.height / 2];
  }

  /**
   * Show a box as large as possible.
   * @param {Box} box
   */
  showAll([left, top, right, bottom]) {
    this.x = (left + right) / 2;
    this.y = (top + bottom) / 2;
    this.zoom = FILLED * Math.min(this.width / (right - left), this.height / (bottom - top));
    this.#zoomOfAll = this.zoom;
    this.whole = true;
  }

  /**
   * Zoom about a pixel, which stays where it is.
   * @param {number} factor
   * @param {Point} pixel
   */
  zoomBy(factor, pixel) {
    const before = this.point(pixel);
    this.zoom = Math.min(MAX_ZOOM * this.#zoomOfAll, Math.max(MIN_ZOOM * this.#zoomOfAll, this.zoom * factor));
    const after = this.point(pixel);
    this.x += before[0] - after[0];
    this.y += before[1] - after[1];
    this.whole = false;
  }

  /**
   * Pan by pixels.
   * @param {number} right
   * @param {number} down
   */
  pan(right, down) {
    this.x -= right / this.zoom;
    this.y -= down / this.zoom;
    this.whole = false;
  }

  /**
   * Return the point under a pixel.
   * @param {Point} pixel
   * @returns {Point}
   */
  point([x, y]) {
    return [this.x + (x - this.width / 2) / this.zoom, this.y + (y - this.height / 2) / this.zoom];
  }

  /**
   * Return the pixel of a point.
   * @param {Point} point
   * @returns {Point}
   */
  pixel([x, y]) {
    return [(x - this.x) * this.zoom + this.width / 2, (y - this.y) * this.zoom + this.height / 2];
  }
}
