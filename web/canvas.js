// One half of the demo: a shape painted by the editor's WebGL renderer, and its outline.

import {Painter} from '../io/edit/page/gl.js';
import {View} from '../io/edit/page/view.js';
import {boxOf} from './curve.js';

/** @import {Overlay, ShapeInfo} from '../io/edit/page/types.d.ts' */
/** @import {Shape} from './types.d.ts' */

const GRID_LINES = 12;  // along the longer side of the texture

export class Canvas {
  view = new View();
  /** @type {Overlay} */
  overlay = {grid: false, stretch: false, own: 0, ghost: 0, swipe: null, mapped: false, holes: false, mean: 1, step: 1};
  /** @type {Painter | null} */
  #painter = null;
  /** @type {Shape | null} */
  #shape = null;
  /** @type {ShapeInfo | null} */
  #info = null;
  /** @type {{image: ImageBitmap, box: number[]} | null} */
  #texture = null;

  /**
   * @param {HTMLElement} element
   * @param {boolean} mapped whether it shows the map, rather than the texture in the source
   */
  constructor(element, mapped) {
    this.element = element;
    this.canvas = /** @type {HTMLCanvasElement} */ (element.querySelector('canvas'));
    this.overlay.mapped = mapped;
    new ResizeObserver(() => this.resized()).observe(element);
  }

  /** The paths that show the outline. */
  get #paths() {
    return this.element.querySelectorAll('path');
  }

  resized() {
    const {clientWidth, clientHeight} = this.element, ratio = devicePixelRatio || 1;
    this.view.width = clientWidth;
    this.view.height = clientHeight;
    this.canvas.width = Math.round(clientWidth * ratio);
    this.canvas.height = Math.round(clientHeight * ratio);
    if (this.#shape) this.view.showAll(this.#bounds());
    this.paint();
  }

  /** The box of the outline and of the drawing's canvas. */
  #bounds() {
    const {outline, box} = /** @type {Shape} */ (this.#shape), [left, top, right, bottom] = boxOf(outline);
    return [Math.min(left, box[0]), Math.min(top, box[1]), Math.max(right, box[2]), Math.max(bottom, box[3])];
  }

  /**
   * Show another shape; its map is not known yet.
   * @param {Shape} shape
   */
  show(shape) {
    this.#shape = shape;
    const outline = points(shape.outline), bounds = this.#bounds();
    if (this.#painter && this.#info) {
      Object.assign(this.#info, {outline, bounds, box: shape.box});
      this.#painter.outlines([outline]);
      this.#painter.map(new Float32Array(0));
    } else {
      this.#info = /** @type {ShapeInfo} */ (/** @type {unknown} */ ({outline, holes: [], painted: null, bounds, box: shape.box}));
      this.#painter = new Painter(this.canvas, this.#info);
    }
    this.#setTexture();
    this.view.showAll(bounds);
    this.paint();
  }

  /**
   * Show the outline after a drag; the view stays.
   * @param {Shape} shape
   */
  reshape(shape) {
    this.#shape = shape;
    this.paint();
  }

  /**
   * @param {ImageBitmap} image
   * @param {number[]} box that it covers in the source
   */
  texture(image, box) {
    this.#texture = {image, box};
    this.overlay.step = Math.max(box[2] - box[0], box[3] - box[1]) / GRID_LINES;
    this.#setTexture();
    this.paint();
  }

  #setTexture() {
    if (this.#texture) this.#painter?.texture(this.#texture.image, {box: this.#texture.box, edge: 'clamp', filter: ''});
  }

  /**
   * @param {Float32Array} floats
   * @param {number} mean length in the source for a length of one in the target
   */
  map(floats, mean) {
    this.overlay.mean = mean;
    this.#painter?.map(floats);
    this.paint();
  }

  paint() {
    if (!this.#shape) return;
    const {x, y, zoom} = this.view, ratio = this.canvas.width / this.view.width;
    this.#painter?.draw({x, y, zoom: zoom * ratio, width: this.canvas.width, height: this.canvas.height}, this.overlay);
    this.line(this.#shape.outline);
  }

  /**
   * Show a closed line.
   * @param {Float64Array} z
   */
  line(z) {
    const pixels = points(z).map((point) => this.view.pixel(point).map((value) => value.toFixed(1)).join(' '));
    for (const path of this.#paths) path.setAttribute('d', pixels.length ? `M${pixels.join('L')}Z` : '');
  }

  /**
   * Return the point of the drawing under the pointer.
   * @param {PointerEvent} event
   */
  at(event) {
    const {left, top} = this.element.getBoundingClientRect();
    return this.view.point([event.clientX - left, event.clientY - top]);
  }

  /**
   * Return a PNG, as an address, of the drawing's canvas.
   * @param {number} longer side in pixels
   */
  picture(longer) {
    const [left, top, right, bottom] = /** @type {Shape} */ (this.#shape).box, zoom = longer / Math.max(right - left, bottom - top);
    this.canvas.width = Math.round(zoom * (right - left));
    this.canvas.height = Math.round(zoom * (bottom - top));
    const {width, height} = this.canvas;
    this.#painter?.draw(
      {x: (left + right) / 2, y: (top + bottom) / 2, zoom, width, height}, {...this.overlay, grid: false, stretch: false, plain: true});
    const address = this.canvas.toDataURL();
    this.resized();
    return address;
  }
}

/** @param {Float64Array} z */
const points = (z) => Array.from({length: z.length / 2}, (_, k) => [z[2 * k], z[2 * k + 1]]);
