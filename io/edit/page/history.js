// The undo history, which survives reloading the page, and a description of each step.

/** @import {Pin, Scene, Stroke} from './types.d.ts' */

/**
 * Return the part of a scene that is saved, as JSON for comparison.
 * @param {Scene} scene
 */
export const contentOf = ({pins, strokes, rigid}) => JSON.stringify([pins, strokes, rigid]);

export class History {
  /** @type {string[]} scenes as immutable JSON */
  #steps = [];
  #present = 0;
  #store;
  #key;
  /** Called after every change of the history. */
  changed = () => {};

  /**
   * @param {Pick<Storage, 'getItem' | 'setItem' | 'removeItem'>} store
   * @param {string} key
   */
  constructor(store, key) {
    this.#store = store;
    this.#key = key;
  }

  /**
   * Begin with a scene, and with its earlier steps if it is the one that was stored last.
   * @param {Scene} scene
   */
  begin(scene) {
    const kept = JSON.parse(this.#store.getItem(this.#key) ?? 'null');
    if (kept && contentOf(JSON.parse(kept.history[kept.present])) === contentOf(scene)) {
      this.#steps = kept.history;
      this.#present = kept.present;
    } else {
      this.#steps = [JSON.stringify(scene)];
      this.#present = 0;
    }
    this.changed();
  }

  /**
   * Add a step after the present one in place of undone steps, unless nothing has changed.
   * @param {Scene} scene
   */
  push(scene) {
    const text = JSON.stringify(scene);
    if (text === this.#steps[this.#present]) return;
    this.#steps = [...this.#steps.slice(0, this.#present + 1), text];
    this.#present += 1;
    this.#keep();
  }

  /**
   * Replace the scene of the present step.
   * @param {Scene} scene
   */
  amend(scene) {
    this.#steps[this.#present] = JSON.stringify(scene);
    this.#keep();
  }

  /**
   * Go back or forward in the history.
   * @param {number} steps
   * @returns {Scene | null} null if there are not as many steps
   */
  travel(steps) {
    const number = this.#present + steps;
    if (number < 0 || number >= this.#steps.length) return null;
    this.#present = number;
    this.#keep();
    return JSON.parse(this.#steps[number]);
  }

  get present() {
    return this.#present;
  }

  get canUndo() {
    return this.#present > 0;
  }

  get canRedo() {
    return this.#present < this.#steps.length - 1;
  }

  /** Describe what each step changed, the oldest first. */
  describe() {
    const scenes = this.#steps.map((text) => JSON.parse(text));
    return scenes.map((scene, k) => describeChange(scenes[k - 1], scene));
  }

  #keep() {
    try {
      this.#store.setItem(this.#key, JSON.stringify({history: this.#steps, present: this.#present}));
    } catch {
      this.#store.removeItem(this.#key);  // too long to store: a reloaded page starts without earlier steps
    }
    this.changed();
  }
}

/**
 * Describe the change from one scene to the next.
 * @param {Scene | undefined} before
 * @param {Scene} after
 */
export function describeChange(before, after) {
  if (!before) return 'initial state';
  return countChange('pin', 'placed', before.pins, after.pins)
    ?? countChange('stroke', 'drawn', before.strokes, after.strokes)
    ?? countChange('rigid region', 'drawn', before.rigid, after.rigid)
    ?? valueChange(before, after)
    ?? entryChange('pin', before.pins, after.pins)
    ?? entryChange('stroke', before.strokes, after.strokes)
    ?? 'no change';
}

/**
 * Describe what an earlier session on this computer left unsaved.
 * @param {Scene} scene
 * @param {Date} when it was last changed
 */
export function leftSentence({pins, strokes, rigid}, when) {
  const kinds = /** @type {[string, unknown[]][]} */ ([['pin', pins], ['stroke', strokes], ['rigid region', rigid]]);
  const counts = kinds.filter(([, items]) => items.length).map(([word, {length}]) => `${length} ${word}${length === 1 ? '' : 's'}`);
  const what = counts.join(', ').replace(/, ([^,]*)$/, ' and $1') || 'Settings', isOne = what.startsWith('1 ') && counts.length === 1;
  const date = when.toLocaleString([], {dateStyle: 'medium', timeStyle: 'short'});
  return `${what} of ${date} ${isOne ? 'was' : 'were'} not saved.`;
}

/**
 * @param {string} word
 * @param {string} made
 * @param {unknown[]} before
 * @param {unknown[]} after
 */
function countChange(word, made, before, after) {
  const more = after.length - before.length, count = Math.abs(more);
  if (more === 0) return null;
  return `${count === 1 ? word : `${count} ${word}s`} ${more > 0 ? made : 'removed'}`;
}

/**
 * @param {Scene} before
 * @param {Scene} after
 */
function valueChange(before, after) {
  if (before.balance !== after.balance) return `balance ${after.balance}`;
  if (before.turn !== after.turn) return `rotation ${after.turn}`;
  if (before.fit !== after.fit) return `fit ${after.fit}`;
  return null;
}

/**
 * @param {string} word
 * @param {(Pin | Stroke)[]} before
 * @param {(Pin | Stroke)[]} after as many entries
 */
function entryChange(word, before, after) {
  const changed = after.map((_, k) => k).filter((k) => JSON.stringify(after[k]) !== JSON.stringify(before[k]));
  if (changed.length === 0) return null;
  if (changed.length > 1) return `${changed.length} ${word}s moved`;
  const number = changed[0], was = before[number], is = after[number];
  if (is.name !== was.name) return `${word} ${number + 1} named`;
  const turned = 'turn' in is && 'turn' in was && is.turn !== was.turn;
  const moved = JSON.stringify([is.source, is.target]) !== JSON.stringify([was.source, was.target]);
  return `${word} ${number + 1} ${turned ? 'rotated' : moved ? 'moved' : 'changed'}`;
}

/**
 * Show the steps as a list of buttons, the newest first.
 * @param {HTMLElement} element
 * @param {History} history
 * @param {(steps: number) => void} travel
 */
export function showHistory(element, history, travel) {
  const items = history.describe().map((text, k) => {
    const item = document.createElement('li'), button = item.appendChild(document.createElement('button'));
    button.textContent = text;
    if (k === history.present) button.setAttribute('aria-current', 'step');
    button.onclick = () => travel(k - history.present);
    return item;
  });
  element.replaceChildren(...items.reverse());
}
