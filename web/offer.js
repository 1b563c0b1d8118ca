// The offer of another map: its picture next to the one that is seen.

import {button, byId} from '../io/edit/page/dom.js';
import {carry} from '../io/edit/page/carry.js';
import {MOST_POINTS_SHARE} from './constants.js';

/** @import {DemoPane} from './panes.js' */

const FLOATS = 18;           // of a triangle (see io/edit/page/gl.js)
const SAMPLES = 300;         // points at which two maps are compared
const PREVIEW_SIDE = 240;    // pixels of the longer side

/**
 * Return how far the images of most points are apart under two maps of the same shapes.
 * @param {Float32Array} one
 * @param {Float32Array} other
 */
export function displacement(one, other) {
  const count = one.length / FLOATS, distances = [];
  for (let k = 0; k < Math.min(SAMPLES, count); k++) {
    const triangle = one.subarray(FLOATS * Math.floor(k * count / Math.min(SAMPLES, count)));
    const [u, z] = [0, 6].map((first) => [0, 1].map((axis) => (triangle[first + axis] + triangle[first + 2 + axis] + triangle[first + 4 + axis]) / 3));
    const image = carry(other, z, 'source');
    if (image) distances.push(Math.hypot(image[0] - u[0], image[1] - u[1]));
  }
  distances.sort((a, b) => a - b);
  return distances[Math.floor(MOST_POINTS_SHARE * (distances.length - 1))] ?? Infinity;
}

/** The two pictures and their buttons. */
export class Offer {
  /**
   * @param {DemoPane} pane that shows the result
   */
  constructor(pane) {
    this.pane = pane;
    button('try-keep').addEventListener('click', () => this.hide());
  }

  /**
   * Show two pictures, of which the user may take the second.
   * @param {string} text what is better about it
   * @param {Float32Array} present triangles of the map that is seen
   * @param {Float32Array} other
   * @param {() => void} take called if the user wants the other one
   */
  show(text, present, other, take) {
    const {pane} = this, [left, top, right, bottom] = pane.shape.box, zoom = PREVIEW_SIDE / Math.max(right - left, bottom - top);
    byId('try-offer-text').textContent = text;
    for (const [name, floats] of /** @type {[string, Float32Array][]} */ ([['take', other], ['keep', present]])) {
      pane.painter.map(floats);
      const image = byId(`try-${name}`).querySelector('img');
      if (image) image.src = pane.picture(Math.round(zoom * (right - left)), Math.round(zoom * (bottom - top)));
    }
    pane.redraw();
    button('try-take').onclick = () => {
      this.hide();
      take();
    };
    byId('try-offer').hidden = false;
  }

  hide() {
    byId('try-offer').hidden = true;
  }
}
