// What is edited: the scene, its history, selected and locked pins, and the map that the server was asked for.

import {contentOf} from './history.js';

/** @import {History} from './history.js' */
/** @import {MapMessage, Patch, Pin, PinEnd, Region, Scene, Stroke, Wrong} from './types.d.ts' */

const REST = 250;  // milliseconds without movement after which a drag is solved as if the pin were released

export class Editor {
  /** @type {Scene} */
  scene = {pins: [], strokes: [], rigid: [], balance: 1, turn: 0, fit: 'auto'};
  /** The content of the scene as it was saved last. */
  saved = '';
  begun = false;
  /** @type {Pin[]} */
  suggested = [];
  /** @type {Region[]} */
  regions = [];
  /** Of each pin; null for exact ones. @type {(Patch | null)[]} */
  patches = [];
  /** The number of the pin whose settings are shown. @type {number | null} */
  active = null;
  /** @type {Wrong} */
  wrong = {};
  /** The end of a pin whose other end is placed next. @type {PinEnd | null} */
  pending = null;
  /** Numbers of pins. @type {Set<number>} */
  selected = new Set();
  /** Ends of pins and strokes that stay where they are, as JSON. @type {Set<string>} */
  locks = new Set();
  /** The kind of the last map. */
  kind = '';
  /** The numbers of the last map that was asked for, and of the last one that has come. */
  asked = 0;
  shown = 0;
  /** Whether the whole map is being computed. */
  busy = false;
  #failed = false;
  #solved = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #rest;
  #say;

  /**
   * @param {(message: object) => void} say sends a message to the server
   * @param {History} history
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

  /** @param {number} number of the pin */
  toggleSelected(number) {
    if (!this.selected.delete(number)) this.selected.add(number);
    this.changed();
  }

  /**
   * The pins that are moved with one: all that are selected, if it is; none that are locked.
   * @param {number} number
   */
  movedWith(number) {
    const numbers = this.selected.has(number) ? [...this.selected] : [number];
    return numbers.filter((k) => !this.isLocked(this.scene.pins[k]));
  }

  /**
   * Make what was changed a step that can be undone, and ask for the whole map of it.
   * @param {boolean} [solve]
   */
  commit(solve = true) {
    this.history.push(this.scene);
    if (solve) this.solve();
    else this.changed();
  }

  /** End a drag; the map that was requested while nothing moved is still that of the scene. */
  drop() {
    this.commit(this.asked !== this.#solved);
  }

  /** @param {number} steps back (negative) or forward */
  travel(steps) {
    const scene = this.history.travel(steps);
    if (!scene) return;
    this.show(scene);
  }

  /**
   * Show another state without a step in the history.
   * @param {Scene} scene
   */
  show(scene) {
    this.scene = scene;
    this.selected.clear();
    this.active = null;
    this.solve();
  }

  /** Ask for the coarse map, as something is dragged; and for the whole one when nothing moves any more. */
  follow() {
    this.#ask('follow');
    this.#rest = setTimeout(() => { if (!this.#failed) this.solve(); }, REST);
    this.changed();
  }

  /**
   * Ask for the whole map.
   * @param {string} [way] which of two that are known
   */
  solve(way) {
    this.#ask('solve', way);
    this.#solved = this.asked;
    this.busy = true;
    this.changed();
  }

  /**
   * @param {'follow' | 'solve'} type
   * @param {string} [way]
   */
  #ask(type, way) {
    clearTimeout(this.#rest);
    this.asked += 1;
    this.#say({type, seq: this.asked, scene: this.scene, way});
  }

  /**
   * Take a map that has come.
   * @param {MapMessage} message
   * @returns {boolean} whether it is still wanted: a coarse one unless a newer one is shown, a whole one if it is the last
   */
  receive(message) {
    const wanted = message.kind === 'coarse' ? message.seq > this.shown : message.seq === this.asked;
    if (!wanted) return false;
    this.shown = message.seq;
    this.kind = message.kind;
    this.wrong = message.wrong;
    this.#failed = !message.ok;
    if (message.kind !== 'coarse') this.busy = false;
    if (message.kind !== 'error') {
      this.regions = message.figures.regions ?? [];
      this.patches = message.patches ?? [];
    }
    return true;
  }
}

/** @param {Pin | Stroke} entry */
const endsOf = ({source, target}) => JSON.stringify([source, target]);
