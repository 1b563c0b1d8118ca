// The editor's panes, with the shapes of the demo: their coordinates are those of the drawings, with y down.

import {Pane} from '../io/edit/page/pane.js';
import {boxOf} from './curve.js';

/** @import {Actions, Point, ShapeInfo, Side} from '../io/edit/page/types.d.ts' */
/** @import {Shape} from './types.d.ts' */

const DIGITS = 6;       // significant digits of coordinates
const GRID_LINES = 12;  // along the longer side of the texture

/**
 * Return the points of an array of their coordinates.
 * @param {Float64Array} z
 * @returns {Point[]}
 */
export const pointsOf = (z) => Array.from({length: z.length / 2}, (_, k) => [z[2 * k], z[2 * k + 1]]);

/**
 * @param {Shape} shape
 * @returns {ShapeInfo}
 */
const infoOf = ({name, outline, box}) => ({
  name, outline: pointsOf(outline), box, bounds: boxOf(outline), canvas: box, holes: [], painted: null, mesh: false, axes: [], origin: [0, 0], scale: 1,
  signs: [1, 1],
});

/** A pane of the demo. */
export class DemoPane extends Pane {
  scrolls = true;
  hasRim = false;

  /**
   * @param {Side} side
   * @param {HTMLElement} element
   * @param {Shape} shape
   * @param {Actions} actions
   */
  constructor(side, element, shape, actions) {
    super(side, element, infoOf(shape), {digits: DIGITS, deforming: false, holes: false, mean: 1}, actions);
    this.watchSize();
  }

  /** @param {Shape} shape */
  showShape(shape) {
    this.show(infoOf(shape));
  }

  /**
   * Show the outline after a drag; the view stays.
   * @param {Shape} shape
   */
  moveOutline({name, outline}) {
    this.caption.textContent = `${this.side}: ${name}`;
    this.reshape([pointsOf(outline)]);
    this.redraw();
  }

  /**
   * @param {ImageBitmap} image
   * @param {number[]} box that it covers in the source
   */
  setTexture(image, box) {
    this.overlay.step = Math.max(box[2] - box[0], box[3] - box[1]) / GRID_LINES;
    this.painter.texture(image, {box, edge: 'clamp', filter: ''});
    this.redraw();
  }

  /**
   * @param {Float32Array} floats triangles, as the painter takes them
   * @param {number} mean length in the source for a length of one in the target
   */
  setMap(floats, mean) {
    this.overlay.mean = mean;
    this.painter.map(floats);
    this.redraw();
  }
}
