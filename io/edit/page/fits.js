// The dialog that shows the result of every fit as a thumbnail, to choose one by eye.

import {button, byId, dialog} from './dom.js';
import {rounded} from './figures.js';

/** @import {Editor} from './editor.js' */
/** @import {Figures} from './types.d.ts' */

const THUMBNAIL_SIZE = 256;  // pixels of the longer side
const ALL_SHARE = 0.995;     // from which all of a shape counts as seen

/** The button of a fit: its value, its name, and where its picture and figures go. */
class Tile {
  /** @param {HTMLButtonElement} element */
  constructor(element) {
    this.element = element;
    this.value = element.dataset.fit ?? '';
    this.picture = childOf(element, '.picture');
    this.title = childOf(element, '.names');
    this.figures = childOf(element, '.figures');
    this.name = this.title.textContent ?? '';
    /** The names of the fits with the same result. */
    this.names = [this.name];
  }

  /** @param {boolean} isPresent whether it is the fit of the scene */
  clear(isPresent) {
    this.names = [this.name];
    this.title.textContent = this.name;
    this.picture.replaceChildren();
    this.figures.textContent = '';
    this.element.hidden = false;
    this.element.setAttribute('aria-pressed', String(isPresent));
  }

  /** @param {Result} result */
  show({blob, figures, text}) {
    if (blob) {
      const image = new Image();
      image.src = URL.createObjectURL(blob);
      image.alt = '';
      image.onload = () => URL.revokeObjectURL(image.src);
      this.picture.replaceChildren(image);
      this.figures.textContent = inWords(figures);
    } else {
      this.picture.textContent = text;
    }
  }

  /**
   * Show that another fit has the same result, in place of its own tile.
   * @param {Tile} other
   */
  share(other) {
    this.names.push(other.name);
    this.title.textContent = this.names.join(', ');
    other.element.hidden = true;
    if (other.element.getAttribute('aria-pressed') === 'true') this.element.setAttribute('aria-pressed', 'true');
  }
}

/**
 * @param {HTMLElement} element
 * @param {string} selector
 */
const childOf = (element, selector) => /** @type {HTMLElement} */ (element.querySelector(selector));

/** The result of a fit; the text says why there is none. @typedef {{blob?: Blob, bytes: string, figures: Figures, text: string}} Result */

export class Fits {
  #editor;
  #tiles = [.../** @type {NodeListOf<HTMLButtonElement>} */ (document.querySelectorAll('[data-fit]'))].map((element) => new Tile(element));
  /** Stops the thumbnails that are not there yet. */
  #leaving = new AbortController();

  /** @param {Editor} editor */
  constructor(editor) {
    this.#editor = editor;
    button('fits-show').onclick = () => this.show();
    dialog('fits').onclose = () => this.#leaving.abort();
    for (const {element, value} of this.#tiles) element.onclick = () => this.#choose(element, value);
  }

  /** Open the dialog, and show one result after the other, the automatic one first; fits with the same result share a tile. */
  async show() {
    const scene = structuredClone(this.#editor.scene), {signal} = this.#leaving = new AbortController();
    /** Tiles by the bytes of their pictures. @type {Map<string, Tile>} */
    const shown = new Map();
    for (const tile of this.#tiles) tile.clear(tile.value === scene.fit);
    byId('fits-said').textContent = 'Comparing…';
    dialog('fits').showModal();
    for (const tile of this.#tiles) {
      const result = await resultOf({...scene, fit: tile.value}, signal);
      if (signal.aborted) return;
      const alike = shown.get(result.bytes);
      if (alike) {
        alike.share(tile);
      } else {
        tile.show(result);
        if (result.bytes) shown.set(result.bytes, tile);
      }
    }
    byId('fits-said').textContent = '';
  }

  /**
   * @param {HTMLButtonElement} element
   * @param {string} value
   */
  #choose(element, value) {
    dialog('fits').close();
    if (element.getAttribute('aria-pressed') === 'true') return;
    this.#editor.scene.fit = value;
    this.#editor.commit();
  }
}

/**
 * Name the present fit on the button that opens the dialog.
 * @param {string} value
 */
export function showFit(value) {
  byId('fit-name').textContent = document.querySelector(`[data-fit=${value}] .names`)?.textContent?.replace(/,.*/, '') ?? value;
}

/**
 * Return the figures by which fits differ: how much is stretched, and what is not seen.
 * @param {Figures} figures
 */
export function inWords({stretch, shown, covered, left_out: leftOut, uncovered}) {
  const seen = shown ?? 1 - (leftOut ?? 0), filled = covered ?? 1 - (uncovered ?? 0);
  const losses = [[seen, 'hidden'], [filled, 'bare']].filter(([share]) => Number(share) < ALL_SHARE);
  const lost = losses.map(([share, word]) => `${Math.round(100 * (1 - Number(share)))} % ${word}`);
  return [...(stretch ? [`stretch ${rounded(stretch.p95)}`] : []), ...(lost.length ? lost : ['all shown'])].join(' · ');
}

/**
 * Return the picture that a scene's map makes, or a text that says why there is none.
 * @param {object} scene
 * @param {AbortSignal} signal
 * @returns {Promise<Result>}
 */
async function resultOf(scene, signal) {
  const nothing = {bytes: '', figures: {}};
  try {
    const body = JSON.stringify({scene, name: 'thumbnail.png', size: THUMBNAIL_SIZE});
    const answer = await fetch('export', {method: 'POST', body, signal});
    if (!answer.headers.get('x-file-name')) return {...nothing, text: (await answer.json()).error ?? 'no result'};
    const blob = await answer.blob(), bytes = new Uint8Array(await blob.arrayBuffer());
    return {blob, bytes: bytes.join(), figures: JSON.parse(answer.headers.get('x-figures') ?? '{}'), text: ''};
  } catch {
    return {...nothing, text: 'no result'};  // the dialog was closed, or the server has ended
  }
}
