// The dialog that shows the result of every fit as a thumbnail, to choose one by eye.

import {button, byId, dialog, select} from './dom.js';

/** @import {Editor} from './editor.js' */

const THUMBNAIL_SIZE = 256;  // pixels of the longer side

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

  /** Open the dialog, and fill in one thumbnail after the other. */
  async show() {
    const scene = structuredClone(this.#editor.scene), {signal} = this.#leaving = new AbortController();
    const tiles = [...select('how').options].map(({value, text}) => this.#tile(value, text, scene.fit === value));
    byId('fits-shown').replaceChildren(...tiles.map(({element}) => element));
    dialog('fits').showModal();
    for (const {value, picture} of tiles) {
      if (signal.aborted) return;
      picture.replaceChildren(await thumbnail({...scene, fit: value}, signal));
    }
  }

  /**
   * @param {string} value of the fit
   * @param {string} text its name and description
   * @param {boolean} isChosen
   */
  #tile(value, text, isChosen) {
    const element = document.createElement('button'), picture = document.createElement('span'), name = document.createElement('span');
    element.type = 'button';
    element.setAttribute('aria-pressed', String(isChosen));
    picture.className = 'picture';
    picture.textContent = 'Computing…';
    name.textContent = text;
    element.append(picture, name);
    element.onclick = () => {
      dialog('fits').close();
      if (value === this.#editor.scene.fit) return;
      this.#editor.scene.fit = value;
      this.#editor.commit();
    };
    return {element, picture, value};
  }
}

/**
 * Return the picture that a scene's map makes, or a text that says why there is none.
 * @param {object} scene
 * @param {AbortSignal} signal
 * @returns {Promise<HTMLImageElement | Text>}
 */
async function thumbnail(scene, signal) {
  try {
    const body = JSON.stringify({scene, name: 'thumbnail.png', size: THUMBNAIL_SIZE});
    const answer = await fetch('export', {method: 'POST', body, signal});
    if (!answer.headers.get('x-file-name')) return document.createTextNode((await answer.json()).error ?? 'no result');
    const image = new Image(), address = URL.createObjectURL(await answer.blob());
    image.src = address;
    image.alt = '';
    await image.decode();
    URL.revokeObjectURL(address);
    return image;
  } catch {
    return document.createTextNode('no result');  // the dialog was closed, or the server has ended
  }
}
