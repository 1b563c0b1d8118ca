// The dialog that shows the result of every fit as a thumbnail, to choose one by eye.

import {button, byId, dialog, select} from './dom.js';
import {rounded} from './figures.js';

/** @import {Editor} from './editor.js' */
/** @import {Figures} from './types.d.ts' */

const THUMBNAIL_SIZE = 256;  // pixels of the longer side
const ALL_SHARE = 0.995;     // from which all of a shape counts as seen

/** @typedef {{value: string, name: string}} Fit */
/** The result of a fit; the text says why there is none. @typedef {{blob?: Blob, bytes: string, figures: Figures, text: string}} Result */

export class Fits {
  #editor;
  /** Stops the thumbnails that are not there yet. */
  #leaving = new AbortController();

  /** @param {Editor} editor */
  constructor(editor) {
    this.#editor = editor;
    button('fits-show').onclick = () => this.show();
    dialog('fits').onclose = () => this.#leaving.abort();
  }

  /** Open the dialog, and show one tile for each result; fits with the same result share one. */
  async show() {
    const scene = structuredClone(this.#editor.scene), {signal} = this.#leaving = new AbortController();
    const fits = [...select('how').options].map(({value, text}) => ({value, name: text.replace(/:.*/, '')}));
    /** Tiles, with their fits, by the bytes of their pictures. @type {Map<string, {tile: HTMLButtonElement, shared: Fit[]}>} */
    const tiles = new Map();
    byId('fits-shown').replaceChildren();
    byId('fits-said').textContent = 'Comparing…';
    dialog('fits').showModal();
    await Promise.all(fits.map(async (fit) => {
      const result = await resultOf({...scene, fit: fit.value}, signal);
      if (signal.aborted) return;
      const key = result.bytes || fit.value, entry = tiles.get(key) ?? {tile: tileOf(result), shared: []};
      tiles.set(key, entry);
      entry.shared.push(fit);
      entry.shared.sort((a, b) => fits.indexOf(a) - fits.indexOf(b));
      this.#name(entry.tile, entry.shared, scene.fit);
      byId('fits-shown').append(entry.tile);
    }));
    if (signal.aborted) return;
    const inOrder = [...tiles.values()].sort((a, b) => fits.indexOf(a.shared[0]) - fits.indexOf(b.shared[0]));
    byId('fits-shown').replaceChildren(...inOrder.map(({tile}) => tile));
    byId('fits-said').textContent = '';
  }

  /**
   * Name the fits that have the result of a tile.
   * @param {HTMLButtonElement} tile
   * @param {Fit[]} shared in the order of the menu, in which the automatic one is the first
   * @param {string} present the fit of the scene
   */
  #name(tile, shared, present) {
    const isPresent = shared.some(({value}) => value === present);
    /** @type {HTMLElement} */ (tile.querySelector('.names')).textContent = shared.map(({name}) => name).join(', ');
    tile.classList.toggle('automatic', shared[0].value === 'auto');
    tile.setAttribute('aria-pressed', String(isPresent));
    tile.onclick = () => {
      dialog('fits').close();
      if (isPresent) return;
      this.#editor.scene.fit = shared[0].value;
      this.#editor.commit();
    };
  }
}

/** @param {Result} result */
function tileOf({blob, figures, text}) {
  const element = document.createElement('button'), [picture, names, words] = [0, 1, 2].map(() => element.appendChild(document.createElement('span')));
  element.type = 'button';
  element.setAttribute('aria-pressed', 'false');
  picture.className = 'picture';
  names.className = 'names';
  words.className = 'hint';
  if (blob) {
    const image = picture.appendChild(new Image());
    image.src = URL.createObjectURL(blob);
    image.alt = '';
    image.onload = () => URL.revokeObjectURL(image.src);
    words.textContent = inWords(figures);
  } else {
    picture.textContent = text;
  }
  return element;
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
