// The dialog that shows the result of every fit as a thumbnail, to choose one by eye.

import {button, byId, dialog} from './dom.js';
import {rounded} from './figures.js';

/** @import {Editor} from './editor.js' */
/** @import {Figures, Scene} from './types.d.ts' */

const THUMBNAIL_SIZE = 256;  // pixels of the longer side
const ALL_SHARE = 0.995;     // from which all of a shape counts as seen
const SAME_DIGITS = 6;       // significant digits of figures that are equal only for the same result
const LANES = 2;             // results that are computed at the same time

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
  show({address, figures, text}) {
    if (address) {
      const image = new Image();
      image.src = address;
      image.alt = '';
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

/** The result of a fit: the address of its picture, and its figures; without a picture, the text says why. @typedef {{address: string, figures: Figures, text: string}} Result */

export class Fits {
  #editor;
  #tiles = [.../** @type {NodeListOf<HTMLButtonElement>} */ (document.querySelectorAll('[data-fit]'))].map((element) => new Tile(element));
  /** Stops the thumbnails that are not there yet. */
  #leaving = new AbortController();
  #present;
  /** The results of fits by their values, until something else changes. @type {{key: string, results: Map<string, Promise<Result>>}} */
  #known = {key: '', results: new Map()};

  /**
   * @param {Editor} editor
   * @param {(side: number) => Result | null} present returns what is seen, with so many pixels on the longer side
   */
  constructor(editor, present) {
    this.#editor = editor;
    this.#present = present;
    button('fits-show').onclick = () => this.show();
    dialog('fits').onclose = () => this.#leaving.abort();
    for (const {element, value} of this.#tiles) element.onclick = () => this.#choose(element, value);
  }

  /** Open the dialog, and show one result after the other, the automatic one first; fits with the same result share a tile. */
  async show() {
    const scene = structuredClone(this.#editor.scene), {signal} = this.#leaving = new AbortController();
    const results = this.#begin(scene, signal);
    /** Tiles by the figures of their results. @type {Map<string, Tile>} */
    const shown = new Map();
    for (const tile of this.#tiles) tile.clear(tile.value === scene.fit);
    byId('fits-said').textContent = 'Comparing…';
    dialog('fits').showModal();
    for (const tile of this.#tiles) {
      const result = /** @type {Result} */ (await results.get(tile.value)), key = result.address && figuresKey(result.figures);
      if (signal.aborted) return;
      const alike = shown.get(key);
      if (alike) {
        alike.share(tile);
      } else {
        tile.show(result);
        if (key) shown.set(key, tile);
      }
    }
    byId('fits-said').textContent = '';
  }

  /**
   * Begin to compute the results that are not known yet; what is seen need not be computed.
   * @param {Scene} scene
   * @param {AbortSignal} signal
   */
  #begin(scene, signal) {
    const key = JSON.stringify({...scene, fit: ''}), present = this.#present(THUMBNAIL_SIZE);
    if (key !== this.#known.key) {
      for (const result of this.#known.results.values()) result.then(({address}) => URL.revokeObjectURL(address));
      this.#known = {key, results: new Map()};
    }
    const {results} = this.#known, lanes = Array.from({length: LANES}, () => /** @type {Promise<unknown>} */ (Promise.resolve()));
    if (present) results.set(scene.fit, Promise.resolve(present));
    this.#tiles.filter(({value}) => !results.has(value)).forEach(({value}, k) => {
      const result = lanes[k % LANES].then(() => resultOf({...scene, fit: value}, signal));
      results.set(value, result);
      lanes[k % LANES] = result;
      let isDone = false;
      result.then(() => { isDone = !signal.aborted; });
      signal.addEventListener('abort', () => { if (!isDone) results.delete(value); });
    });
    return results;
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
 * Return a text that is the same for two results only if they are the same.
 * @param {Figures} figures
 */
function figuresKey({stretch, shown, covered, left_out: leftOut, uncovered}) {
  const numbers = [...Object.values(stretch ?? {}), shown, covered, leftOut, uncovered];
  return numbers.map((number) => number?.toPrecision(SAME_DIGITS) ?? '').join();
}

/**
 * Return the picture that a scene's map makes, or a text that says why there is none.
 * @param {object} scene
 * @param {AbortSignal} signal
 * @returns {Promise<Result>}
 */
async function resultOf(scene, signal) {
  const nothing = {address: '', figures: {}};
  try {
    const body = JSON.stringify({scene, name: 'thumbnail.png', size: THUMBNAIL_SIZE});
    const answer = await fetch('export', {method: 'POST', body, signal});
    if (!answer.headers.get('x-file-name')) return {...nothing, text: (await answer.json()).error ?? 'no result'};
    return {address: URL.createObjectURL(await answer.blob()), figures: JSON.parse(answer.headers.get('x-figures') ?? '{}'), text: ''};
  } catch {
    return {...nothing, text: 'no result'};  // the dialog was closed, or the server has ended
  }
}
