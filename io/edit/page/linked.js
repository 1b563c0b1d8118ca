// Linked views that zoom and pan together, and a cross at the image of the pointer on the other side.

import {button} from './dom.js';
import {carry} from './carry.js';

/** @import {Pane} from './pane.js' */
/** @import {Point, Side} from './types.d.ts' */

export class Linked {
  #panes;
  /** @type {Float32Array | null} */
  #map = null;
  /** Zoom of the other side relative to that of the moved side at the time when the views were linked. */
  #ratio = 1;
  #on = false;

  /** @param {Record<Side, Pane>} panes */
  constructor(panes) {
    this.#panes = panes;
    const {source, target} = panes, isPlane = !source.surface && !target.surface;
    button('linked').disabled = !isPlane;
    button('linked').onclick = () => this.toggle();
    if (!isPlane) return;
    for (const [pane, other] of [[source, target], [target, source]]) {
      pane.viewed = () => this.#follow(pane, other);
      pane.element.addEventListener('pointermove', (event) => this.#point(pane, other, pane.pixelOf(event)));
      pane.element.addEventListener('pointerleave', () => this.#point(pane, other, null));
    }
  }

  /** @param {Float32Array} floats the map that is shown */
  take(floats) {
    this.#map = floats;
  }

  toggle() {
    if (button('linked').disabled) return;
    this.#on = !this.#on;
    button('linked').setAttribute('aria-pressed', String(this.#on));
    const {source, target} = this.#panes;
    this.#ratio = target.view.zoom / source.view.zoom;
    if (this.#on) this.#follow(source, target);
  }

  /**
   * Show the image of one side's centre in the middle of the other side, at the ratio of zooms when they were linked.
   * @param {Pane} pane
   * @param {Pane} other
   */
  #follow(pane, other) {
    if (!this.#on || !this.#map) return;
    if (pane.view.whole) {
      other.view.showAll(other.wholeBox());
      other.redraw();
      return;
    }
    const middle = carry(this.#map, [pane.view.x, pane.view.y], pane.side);
    if (middle) [other.view.x, other.view.y] = middle;
    other.view.zoom = pane.view.zoom * (pane.side === 'source' ? this.#ratio : 1 / this.#ratio);
    other.view.whole = false;
    other.redraw();
  }

  /**
   * @param {Pane} pane
   * @param {Pane} other
   * @param {Point | null} pixel
   */
  #point(pane, other, pixel) {
    const image = pixel && this.#map ? carry(this.#map, pane.at(pixel), pane.side) : null;
    if (!image && !other.cross) return;
    other.cross = image;
    other.redraw(false);
  }
}
