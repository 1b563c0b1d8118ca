// The states of the page to which undo and redo return.

/** @import {Step} from './types.d.ts' */

const MOST_STEPS = 60;  // each has a map of about a megabyte

export class Steps {
  /** @type {Step[]} */
  #steps = [];
  #present = -1;

  /**
   * Add a step after the present one, in place of undone steps.
   * @param {Step} step
   */
  push(step) {
    this.#steps = [...this.#steps.slice(0, this.#present + 1), step].slice(-MOST_STEPS);
    this.#present = this.#steps.length - 1;
  }

  /** The present step; null before the first one. */
  get present() {
    return this.#steps[this.#present] ?? null;
  }

  /**
   * Change the present step.
   * @param {Partial<Step>} change
   */
  amend(change) {
    if (this.present) Object.assign(this.present, change);
  }

  /**
   * Go back or forward, and return the step; null if there are not as many.
   * @param {number} by
   */
  travel(by) {
    if (!this.#steps[this.#present + by]) return null;
    this.#present += by;
    return this.present;
  }

  get canUndo() {
    return this.#present > 0;
  }

  get canRedo() {
    return this.#present < this.#steps.length - 1;
  }
}
