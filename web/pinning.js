// Pins of the demo: placed, dragged and removed on both sides, through the editor's panes.

import {carry} from '../io/edit/page/carry.js';
import {atRim, closest, distance, inside} from '../io/edit/page/geometry.js';
import {pointsOf} from './panes.js';

/** @import {Movement} from '../io/edit/page/preview.js' */
/** @import {Actions, Ends, Item, PaneScene, Pin, Point, Side} from '../io/edit/page/types.d.ts' */
/** @import {Shape} from './types.d.ts' */

const NEAR_OUTLINE_SHARE = 0.01;  // relative to the diagonal: pins stay this far from the outline
const NEAR_PIN_SHARE = 0.01;      // the same, from each other
const MOST_PINS = 12;
const DIGITS = 6;                 // significant digits of coordinates
const INNER_SAMPLES = 24;         // of a shape's box along each side, to find the point farthest from the outline

/**
 * Return why a pin cannot be at a point; empty if it can.
 * @param {Point} point
 * @param {Shape} shape
 * @param {Point[]} others the other pins on the same side
 */
function obstacle(point, {outline}, others) {
  const ring = pointsOf(outline), unit = diagonal(ring);
  if (!inside(ring, point)) return 'Place pins inside the shape.';
  if (closest(ring, point).away < NEAR_OUTLINE_SHARE * unit) return 'That is too close to the outline: on this page, pins lie inside the shape.';
  if (others.some((other) => distance(other, point) < NEAR_PIN_SHARE * unit)) return 'There is a pin already.';
  return '';
}

/**
 * Return a point with the digits that matter.
 * @param {Point} point
 */
const rounded = (point) => point.map((value) => Number(value.toPrecision(DIGITS)));

/** @param {Point[]} ring */
function diagonal(ring) {
  const [x, y] = [0, 1].map((axis) => ring.map((point) => point[axis]));
  return Math.hypot(Math.max(...x) - Math.min(...x), Math.max(...y) - Math.min(...y));
}

/** @typedef {'dragged' | 'dropped' | 'placed' | 'removed'} Change */

/** @param {Pin} pin */
const endsOf = ({source, target}) => JSON.stringify([source, target]);

/** The pins, as the editor's panes and handles see them. */
export class Pinning {
  /** @type {PaneScene} */
  scene = {
    pins: [], strokes: [], regions: [], rigid: [], unmapped: [], failed: false, balance: 1, turn: 0, fit: 'whole', wrong: {}, suggested: [], selected: new Set(), locked: () => false,
    wanted: (pin) => this.#wanted.get(endsOf(pin)) ?? null,
    patches: [], bent: [], active: null, pending: null, digits: {source: 0, target: 0},
  };
  /** Where pins that stopped short were dragged to, by their ends. @type {Map<string, Ends>} */
  #wanted = new Map();
  /** The triangles of the last map. @type {Float32Array} */
  floats = new Float32Array(0);

  /**
   * @param {object} page
   * @param {() => Record<Side, Shape>} page.shapes
   * @param {(change: Change) => void} page.changed called after each change
   * @param {(movement: Omit<Movement, 'seq'>) => void} page.moved called when an end of a pin has been moved, before `changed`
   * @param {(text: string) => void} page.refuse shows why something cannot be done
   */
  constructor({shapes, changed, moved, refuse}) {
    this.shapes = shapes;
    this.moved = moved;
    this.changed = changed;
    this.refuse = refuse;
  }

  /**
   * Return four numbers for each pin.
   * @param {boolean} wanted whether pins that stopped short are where they were dragged to
   */
  numbers(wanted) {
    const ends = this.scene.pins.map((pin) => (wanted && this.scene.wanted(pin)) || pin);
    return Float64Array.from(ends.flatMap(({source, target}) => [...(/** @type {number[]} */ (source)), ...(/** @type {number[]} */ (target))]));
  }

  /** Numbers of the pins that stopped short. */
  get short() {
    return [...this.scene.pins.keys()].filter((k) => this.scene.wanted(this.scene.pins[k]));
  }

  /**
   * Move pins that a map has not reached to where it takes them.
   * @param {Float32Array} floats
   * @param {number[]} numbers of these pins
   */
  stopShort(floats, numbers) {
    for (const number of numbers) {
      const pin = this.scene.pins[number], {source, target} = pin, image = carry(floats, /** @type {Point} */ (source), 'source');
      if (!image) continue;
      pin.target = rounded(image);
      this.#wanted.set(endsOf(pin), {source, target});
    }
  }

  /** Put the pins that stopped short where they were dragged to. */
  reach() {
    for (const pin of this.scene.pins) Object.assign(pin, this.scene.wanted(pin));
  }

  /** Remove all pins, which belong to other shapes. */
  clear() {
    this.scene.pins = [];
    this.scene.wrong = {};
  }

  /**
   * Place a pin at the farthest point of the source from its outline and from other pins, for those who use the keyboard.
   */
  add() {
    const {source} = this.shapes(), ring = pointsOf(source.outline), [x, y] = [0, 1].map((axis) => ring.map((point) => point[axis]));
    const [left, right, top, bottom] = [Math.min(...x), Math.max(...x), Math.min(...y), Math.max(...y)];
    let best = /** @type {Point | null} */ (null), most = 0;
    for (let i = 1; i < INNER_SAMPLES; i++) {
      for (let j = 1; j < INNER_SAMPLES; j++) {
        const point = [left + i / INNER_SAMPLES * (right - left), top + j / INNER_SAMPLES * (bottom - top)];
        if (!inside(ring, point)) continue;
        const away = Math.min(closest(ring, point).away, ...this.scene.pins.map((pin) => distance(/** @type {Point} */ (pin.source), point)));
        if (away > most) [best, most] = [point, away];
      }
    }
    if (best) this.place('source', best);
  }

  /**
   * Place a pin, with its other end where the map takes it.
   * @param {Side} side
   * @param {Point} point
   */
  place(side, point) {
    const other = side === 'source' ? 'target' : 'source', image = carry(this.floats, point, side);
    const [source, target] = side === 'source' ? [point, image] : [image, point];
    if (this.scene.pins.length === MOST_PINS) {
      this.refuse(`This page takes ${MOST_PINS} pins at most.`);
      return;
    }
    const problem = this.#problem(side, point) || (image ? this.#problem(other, image) : 'Place pins inside the shape, after its map has been found.');
    if (problem || !source || !target) {
      this.refuse(problem);
      return;
    }
    this.scene.pins.push({name: '', weight: 1, source: rounded(source), target: rounded(target), turn: null});
    this.changed('placed');
  }

  /**
   * @param {Side} side
   * @param {Point} point
   * @param {Pin} [pin] the one that is there, if any
   */
  #problem(side, point, pin) {
    const others = this.scene.pins.filter((other) => other !== pin).map((other) => /** @type {Point} */ (other[side]));
    return obstacle(point, this.shapes()[side], others);
  }

  /**
   * Move an end of a pin; beyond the outline, to the rim.
   * @param {Side} side
   * @param {number} number
   * @param {Point} point
   */
  drag(side, number, point) {
    const pin = this.scene.pins[number], ring = pointsOf(this.shapes()[side].outline);
    const place = this.#problem(side, point, pin) ? atRim(ring, point, 1.5 * NEAR_OUTLINE_SHARE * diagonal(ring)) : point;
    if (!place || this.#problem(side, place, pin)) return false;
    const from = /** @type {Point} */ (pin[side]), others = this.scene.pins.filter((other) => other !== pin).map((other) => /** @type {Point} */ (other[side]));
    const movement = {side, source: /** @type {Point} */ (pin.source), by: place.map((value, axis) => value - from[axis]), others};
    pin[side] = rounded(place);
    this.moved(movement);
    this.changed('dragged');
    return true;
  }

  /**
   * Move the places of pins with the target.
   * @param {(points: Float64Array) => Float64Array} move
   */
  moveTargets(move) {
    for (const pin of this.scene.pins) pin.target = rounded([...move(Float64Array.from(/** @type {number[]} */ (pin.target)))]);
  }

  /** @returns {Actions} */
  get actions() {
    const nothing = () => {};
    return {
      select: nothing, lock: nothing, accept: nothing, selectOnly: nothing, placeEnd: nothing, turn: nothing, hold: nothing, keep: nothing, rename: nothing, move: nothing,
      activate: nothing,
      place: async (side, place) => this.place(side, /** @type {Point} */ (place)),
      stroke: async () => {},
      drag: (side, {number}, place) => this.drag(side, number, /** @type {Point} */ (place)),
      drop: () => this.changed('dropped'),
      remove: ({number}) => {
        const focused = document.activeElement, pane = focused?.closest('.pane');
        this.scene.pins.splice(number, 1);
        this.changed('removed');
        // the button may be gone with its pin
        requestAnimationFrame(() => {
          if (!focused?.isConnected && pane instanceof HTMLElement) pane.focus();
        });
      },
      hover: (/** @type {Item | null} */ item) => {
        for (const element of document.querySelectorAll('#try .handle')) {
          element.classList.toggle('lit', item !== null && /** @type {HTMLElement} */ (element).dataset.key === `pin ${item.number}`);
        }
      },
    };
  }
}

/**
 * Return pins as options of the command.
 * @param {Pin[]} pins
 */
export const optionsOf = (pins) => pins.flatMap(({source, target}) => ['--pin', `${[source].flat().join(',')}:${[target].flat().join(',')}`]);
