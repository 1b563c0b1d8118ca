// The state that is edited: the scene, its history, selected and locked pins, and the map requested from the server.

import {inside} from './geometry.js';
import {contentOf} from './history.js';

/** @import {History} from './history.js' */
/** @import {Bent, Ends, MapMessage, Patch, Pin, PinEnd, Place, Region, Scene, Stroke, Wrong} from './types.d.ts' */

const DISC_CORNERS = 24;
const DISC_SHARE = 0.9;  // of a feature's radius: a rigid region keeps away from the outline
const REST = 150;  // milliseconds without movement after which the converged map is requested during a drag

export class Editor {
  /** @type {Scene} */
  scene = {pins: [], strokes: [], rigid: [], balance: 1, turn: 0, fit: 'auto'};
  /** The content of the scene when it was last saved. */
  saved = '';
  begun = false;
  /** @type {Pin[]} */
  suggested = [];
  /** @type {Region[]} */
  regions = [];
  /** Of each pin; null for exact ones. @type {(Patch | null)[]} */
  patches = [];
  /** Features of the picture that the map bends. @type {Bent[]} */
  bent = [];
  /** Index of the pin whose settings are shown. @type {number | null} */
  active = null;
  /** @type {Wrong} */
  wrong = {};
  /** The first end of a pin whose other end is still to be placed. @type {PinEnd | null} */
  pending = null;
  /** Indices of pins. @type {Set<number>} */
  selected = new Set();
  /** Ends of pins and strokes that cannot be moved, as JSON. @type {Set<string>} */
  locks = new Set();
  /** Where pins that stopped short were dragged to, by their ends as JSON. @type {Map<string, Ends>} */
  #wanted = new Map();
  /** Whether a map is searched that may differ from the one that is seen. */
  searching = false;
  /** Whether there has been a map, which stays on the page if a later one is not found. */
  hasMap = false;
  /** The kind of the last map. */
  kind = '';
  /** Sequence numbers of the last map requested, and of the last one received. */
  asked = 0;
  shown = 0;
  /** Whether the converged map is being computed. */
  busy = false;
  /** Whether the last map took the place of another one that had come to rest, although nothing had changed. */
  replaced = false;
  #solved = 0;
  /** Whether the converged map was requested while the hand rested during a drag. */
  #resting = false;
  /** Which of two known maps is not shown; empty if there is only one. */
  #other = '';
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #rest;
  #say;

  /**
   * @param {(message: object) => void} say sends a message to the server
   * @param {History} history called after every change
   * @param {() => void} changed is called after every change
   */
  constructor(say, history, changed) {
    this.#say = say;
    this.history = history;
    this.changed = changed;
  }

  /** @param {Scene} scene */
  begin(scene) {
    this.scene = scene;
    this.history.begin(scene);
    this.begun = true;
  }

  get dirty() {
    return this.begun && contentOf(this.scene) !== this.saved;
  }

  /** @param {Pin | Stroke} entry */
  isLocked(entry) {
    return this.locks.has(endsOf(entry));
  }

  /** @param {Pin | Stroke} entry */
  toggleLock(entry) {
    if (!this.locks.delete(endsOf(entry))) this.locks.add(endsOf(entry));
    this.changed();
  }

  /**
   * Return where a pin that stopped short was dragged to; null for other pins.
   * @param {Pin} pin
   */
  wanted(pin) {
    return this.#wanted.get(endsOf(pin)) ?? null;
  }

  /** Search for a map that takes the pins that stopped short to where they were dragged; a step of the history. */
  search() {
    for (const pin of this.scene.pins) Object.assign(pin, this.wanted(pin));
    this.history.push(this.scene);
    this.solve('search');
    this.searching = true;
  }

  /** Give up a search, and return to the map before. */
  stopSearch() {
    if (this.searching) this.travel(-1);
  }

  /** @param {number} number of the pin */
  toggleSelected(number) {
    if (!this.selected.delete(number)) this.selected.add(number);
    this.changed();
  }

  /**
   * Return the pins that move with one: all selected pins if it is selected, except locked ones.
   * @param {number} number
   */
  movedWith(number) {
    const numbers = this.selected.has(number) ? [...this.selected] : [number];
    return numbers.filter((k) => !this.isLocked(this.scene.pins[k]));
  }

  /**
   * Add the change to the history, and request its converged map.
   * @param {boolean} [solve]
   */
  commit(solve = true) {
    this.history.push(this.scene);
    if (solve) this.solve();
    else this.changed();
  }

  /**
   * End a drag. If nothing has moved since the converged map was shown, that map is still valid, and the server is
   * informed which one was seen: while the hand rests, it searches for a better one.
   */
  drop() {
    this.history.push(this.scene);
    if (this.busy || this.asked !== this.#solved || this.kind === 'blocked') this.solve('', 'released');
    else if (this.#resting && this.kind === 'full') this.solve(this.#other === 'kept' ? 'fresh' : 'kept', 'released');
    else this.changed();
  }

  /** @param {number} steps back (negative) or forward */
  travel(steps) {
    const scene = this.history.travel(steps);
    if (!scene) return;
    this.show(scene);
  }

  /**
   * Show another state without adding it to the history.
   * @param {Scene} scene
   */
  show(scene) {
    this.scene = scene;
    this.selected.clear();
    this.active = null;
    this.solve();
  }

  /**
   * Keep the features that the map bends as they are in the source: rigid, or with their form held by soft pins.
   * @param {'rigid' | 'pin'} how
   */
  unbend(how) {
    for (const {source, target, radius} of this.bent) {
      if (how === 'rigid') this.scene.rigid.push(discAround(source, radius));
      else this.scene.pins.push({name: '', weight: 1, source, target, turn: null, radius: Number(radius.toPrecision(3))});
    }
    this.commit();
  }

  /**
   * Keep the form of the area around a pin, or let it bend again.
   * @param {Pin} pin
   * @param {number} radius of the area, in file units of the source
   */
  keepRigid(pin, radius) {
    const number = rigidAround(this.scene, pin);
    if (number >= 0) this.scene.rigid.splice(number, 1);
    else this.scene.rigid.push(discAround(/** @type {[number, number]} */ (pin.source), radius));
    this.commit();
  }

  /** Request the coarse map while something is dragged, and the converged one once nothing moves. */
  follow() {
    this.#ask('follow');
    this.#rest = setTimeout(() => this.solve('', 'resting'), REST);
    this.changed();
  }

  /**
   * Request the converged map.
   * @param {string} [way] which of two known maps, or `search`
   * @param {'resting' | 'released'} [hand] what the hand that drags something is doing: the map stays where it is seen
   */
  solve(way, hand) {
    this.searching = false;
    this.#ask('solve', {way, hand});
    this.#solved = this.asked;
    this.#resting = hand === 'resting';
    this.busy = true;
    this.changed();
  }

  /**
   * @param {'follow' | 'solve'} type
   * @param {{way?: string, hand?: string}} [how]
   */
  #ask(type, how = {}) {
    clearTimeout(this.#rest);
    this.asked += 1;
    this.#say({type, seq: this.asked, scene: this.scene, ...how});
  }

  /**
   * Rigid regions as drawn, where the map that is shown does not have all of them.
   * @returns {Place[][]}
   */
  get unmapped() {
    const {rigid} = this.scene;
    return this.kind === 'error' || this.regions.length < rigid.length ? rigid.filter((region) => typeof region !== 'string') : [];
  }

  /**
   * Receive a map.
   * @param {MapMessage} message
   * @returns {boolean} whether it is still needed: a coarse map unless a newer one is shown, a converged one if it
   *   answers the last request
   */
  receive(message) {
    const wanted = message.kind === 'coarse' ? message.seq >= this.shown : message.seq === this.asked;
    if (!wanted) return false;
    const rested = this.kind === 'full' || this.kind === 'blocked';
    this.replaced = message.kind === 'full' && rested && message.seq === this.shown;
    this.shown = message.seq;
    this.kind = message.kind;
    this.wrong = message.wrong;
    if (message.kind !== 'coarse') {
      this.busy = false;
      this.searching = false;
    }
    if (message.pins) this.#stopShort(message.short ?? [], message.pins);
    if (message.kind === 'coarse' || message.kind === 'full') {
      this.hasMap = true;
      this.regions = message.figures.regions ?? [];
      this.patches = message.patches ?? [];
      this.#other = message.other ?? '';
      this.bent = message.bent ?? [];
    }
    return true;
  }

  /**
   * Move pins that the map could not follow to where it takes them, as part of the step that dragged them.
   * @param {number[]} numbers of these pins
   * @param {Pin[]} pins all pins of the map
   */
  #stopShort(numbers, pins) {
    for (const number of numbers) {
      const pin = this.scene.pins[number], {source, target} = pins[number];
      this.#wanted.set(endsOf(pins[number]), {source: pin.source, target: pin.target});
      Object.assign(pin, {source, target});
    }
    this.history.amend(this.scene);
  }
}

/**
 * Return the corners of a polygon in a disc.
 * @param {[number, number]} middle
 * @param {number} radius
 */
function discAround([x, y], radius) {
  const angles = Array.from({length: DISC_CORNERS}, (_, k) => 2 * Math.PI * k / DISC_CORNERS);
  return angles.map((angle) => [x + DISC_SHARE * radius * Math.cos(angle), y + DISC_SHARE * radius * Math.sin(angle)]);
}

/**
 * Return the number of the rigid region around the source's end of a pin; -1 if there is none.
 * @param {Scene} scene
 * @param {Pin} pin
 */
export function rigidAround({rigid}, {source}) {
  if (typeof source === 'string') return -1;
  const point = /** @type {[number, number]} */ (source);
  return rigid.findIndex((region) => typeof region !== 'string' && inside(/** @type {[number, number][]} */ (region), point));
}

/** @param {Pin | Stroke} entry */
const endsOf = ({source, target}) => JSON.stringify([source, target]);
