// Comparisons: of two states A and B, and of the map with the files' own drawings.

import {button, input} from './dom.js';

/** @import {Editor} from './editor.js' */
/** @import {Pane} from './pane.js' */
/** @import {Side} from './types.d.ts' */

const BLINK = 700;        // milliseconds of the drawing, and of the map
const SHARE_STEP = 0.25;  // by which the key makes the drawing more visible

export class Comparison {
  #editor;
  #panes;
  #kept = '';
  /** @type {'A' | 'B'} the state that is visible */
  #letter = 'B';
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #blinking;

  /**
   * @param {Editor} editor
   * @param {Record<Side, Pane>} panes
   */
  constructor(editor, panes) {
    this.#editor = editor;
    this.#panes = panes;
    button('ab').onclick = () => this.swap();
    input('own').oninput = () => this.showDrawing(Number(input('own').value));
    button('blink').onclick = () => this.blink();
  }

  /** Keep the state as A; later exchange the state that is kept with the one that is visible. */
  swap() {
    const present = JSON.stringify(this.#editor.scene);
    if (this.#kept === '') {
      button('ab').textContent = 'A stored';
    } else {
      this.#letter = this.#letter === 'A' ? 'B' : 'A';
      button('ab').textContent = `Showing ${this.#letter}`;
      this.#editor.scene = JSON.parse(this.#kept);
      this.#editor.commit();
    }
    this.#kept = present;
  }

  /**
   * How much of the files' own drawings is visible.
   * @param {number} share from 0 to 1
   */
  showDrawing(share) {
    for (const pane of [this.#panes.source, this.#panes.target]) {
      pane.overlay.own = share;
      pane.redraw();
    }
  }

  /** Make the drawings more visible by a step; after all of them none. */
  step() {
    const share = Number(input('own').value);
    input('own').value = String(share >= 1 ? 0 : share + SHARE_STEP);
    this.showDrawing(Number(input('own').value));
  }

  /** Show drawing and map in turn, or stop that. */
  blink() {
    const on = button('blink').getAttribute('aria-pressed') !== 'true';
    button('blink').setAttribute('aria-pressed', String(on));
    clearInterval(this.#blinking);
    if (!on) {
      this.showDrawing(Number(input('own').value));
      return;
    }
    let share = 1;
    this.showDrawing(share);
    this.#blinking = setInterval(() => {
      share = 1 - share;
      this.showDrawing(share);
    }, BLINK);
  }
}
