// Comparisons: of two states A and B, and of the result with the files' own drawings or with the map before.

import {button, input, select} from './dom.js';

/** @import {Editor} from './editor.js' */
/** @import {Pane} from './pane.js' */
/** @import {Scene, Side} from './types.d.ts' */

/** @typedef {'result' | 'overlay' | 'onion' | 'swipe'} ViewName what the target side shows */

const BLINK = 700;        // milliseconds of the drawing, and of the map
const SHARE_STEP = 0.25;  // by which the key makes the drawing more visible

/** @type {Record<ViewName, {share: number, label: string}>} what the slider is, and where it begins */
const VIEWS = {
  result: {share: 0, label: 'Opacity of the files\u2019 own drawings'},
  overlay: {share: 0.4, label: 'Opacity of the files\u2019 own drawings'},
  onion: {share: 0.5, label: 'Opacity of the previous map'},
  swipe: {share: 0.5, label: 'Position of the divider'},
};

export class Comparison {
  #editor;
  #panes;
  /** @type {{scene: Scene, map: Float32Array | null} | null} the state that is not visible */
  #kept = null;
  /** @type {'A' | 'B'} the state that is visible */
  #letter = 'B';
  /** @type {Float32Array | null} the last converged map */
  #map = null;
  /** The scene that it belongs to, as JSON. */
  #scene = '';
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
    select('view').onchange = () => this.show(/** @type {ViewName} */ (select('view').value));
    input('own').oninput = () => {
      if (select('view').value === 'result') select('view').value = 'overlay';
      this.#apply();
    };
    button('blink').onclick = () => this.blink();
    panes.target.divided = (share) => {
      input('own').value = String(share);
      this.#apply();
    };
    this.show('result');
  }

  /**
   * Take a converged map. Where the scene is another one, the last map is the previous map from now on.
   * @param {Float32Array} floats
   */
  take(floats) {
    const scene = JSON.stringify(this.#editor.scene), isSame = scene === this.#scene;
    const previous = this.#kept?.map ?? (isSame ? null : this.#map);
    this.#map = floats.slice();
    this.#scene = scene;
    if (previous) this.#panes.target.painter.ghost(previous);
  }

  /** Keep the state as A; later exchange the state that is kept with the one that is visible, without a step of history. */
  swap() {
    const present = {scene: structuredClone(this.#editor.scene), map: this.#map}, kept = this.#kept;
    this.#kept = present;
    if (kept) {
      this.#letter = this.#letter === 'A' ? 'B' : 'A';
      button('ab').textContent = `Showing ${this.#letter}`;
      this.#editor.show(kept.scene);
    } else {
      button('ab').textContent = 'A stored';
    }
  }

  /**
   * Change what the target side shows.
   * @param {ViewName} view
   */
  show(view) {
    const {share, label} = VIEWS[view];
    select('view').value = view;
    input('own').value = String(share);
    input('own').setAttribute('aria-label', label);
    input('own').title = `${label} (D, B)`;
    this.#apply();
  }

  /** Paint what is chosen. */
  #apply() {
    const view = select('view').value, share = Number(input('own').value);
    this.#panes.target.overlay.swipe = view === 'swipe' ? share : null;
    this.#panes.target.overlay.ghost = view === 'onion' ? share : 0;
    this.#showDrawing(view === 'swipe' || view === 'onion' ? 0 : share);
  }

  /**
   * How much of the files' own drawings is visible.
   * @param {number} share from 0 to 1
   */
  #showDrawing(share) {
    for (const pane of [this.#panes.source, this.#panes.target]) {
      pane.overlay.own = share;
      pane.redraw();
    }
  }

  /** Make the drawings more visible by a step; after all of them none. */
  step() {
    const isResult = select('view').value === 'result', share = isResult ? 0 : Number(input('own').value);
    if (isResult) select('view').value = 'overlay';
    input('own').value = String(share >= 1 ? 0 : share + SHARE_STEP);
    this.#apply();
  }

  /** Show drawing and map in turn, or stop that. */
  blink() {
    const on = button('blink').getAttribute('aria-pressed') !== 'true';
    button('blink').setAttribute('aria-pressed', String(on));
    clearInterval(this.#blinking);
    if (!on) {
      this.#apply();
      return;
    }
    let share = 1;
    this.#showDrawing(share);
    this.#blinking = setInterval(() => {
      share = 1 - share;
      this.#showDrawing(share);
    }, BLINK);
  }
}
