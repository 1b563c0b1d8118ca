// Comparisons of two states A and B, and of the result with the files' own drawings or with the previous map.

import {button, input, select} from './dom.js';

/** @import {Editor} from './editor.js' */
/** @import {Pane} from './pane.js' */
/** @import {Scene, Side} from './types.d.ts' */

/** @typedef {'result' | 'overlay' | 'onion' | 'swipe'} ViewName what the target side shows */

const BLINK = 700;        // milliseconds for which the drawing and the map are shown in turn
const SHARE_STEP = 0.25;  // by which the key increases the opacity of the drawing

/** @type {Record<ViewName, {share: number, label: string}>} label and initial value of the slider */
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
  /** The scene of that map, as JSON. */
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
   * Store a converged map. If the scene has changed, the last map becomes the previous map.
   * @param {Float32Array} floats
   */
  take(floats) {
    const scene = JSON.stringify(this.#editor.scene), isSame = scene === this.#scene;
    const previous = this.#kept?.map ?? (isSame ? null : this.#map);
    this.#map = floats.slice();
    this.#scene = scene;
    if (previous) this.#panes.target.painter.ghost(previous);
  }

  /**
   * Store the present state as A; from then on, exchange the stored state and the visible one without a history step.
   */
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

  /** Apply the chosen view to the panes. */
  #apply() {
    const view = select('view').value, share = Number(input('own').value);
    this.#panes.target.overlay.swipe = view === 'swipe' ? share : null;
    this.#panes.target.overlay.ghost = view === 'onion' ? share : 0;
    this.#showDrawing(view === 'swipe' || view === 'onion' ? 0 : share);
  }

  /**
   * Set the opacity of the files' own drawings.
   * @param {number} share from 0 to 1
   */
  #showDrawing(share) {
    for (const pane of [this.#panes.source, this.#panes.target]) {
      pane.overlay.own = share;
      pane.redraw();
    }
  }

  /** Increase the opacity of the drawings by a step; after 1 it starts again from 0. */
  step() {
    const isResult = select('view').value === 'result', share = isResult ? 0 : Number(input('own').value);
    if (isResult) select('view').value = 'overlay';
    input('own').value = String(share >= 1 ? 0 : share + SHARE_STEP);
    this.#apply();
  }

  /** Start or stop showing drawing and map alternately. */
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
