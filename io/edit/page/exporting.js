// The export dialog: format, name, size, a preview, and the download.

import {button, byId, dialog, input, select} from './dom.js';
import {report, shownNotes} from './status.js';

/** @import {Editor} from './editor.js' */
/** @import {Link} from './link.js' */
/** @import {Pane} from './pane.js' */
/** @import {Hello, Side} from './types.d.ts' */

const DEFAULT_SIZE = 1024;  // pixels of the longer side, as in `iccm map`
const PREVIEW_SIZE = 512;   // pixels of the longer side
const SUFFIX = /(\.stmap)?\.[^.]*$/;
const SHOWN = /\.(png|jpe?g|webp|svg)$/i;  // files that browsers can display

export class Exporting {
  #editor;
  #link;
  #hello;
  #panes;
  /** The number of the last preview requested. */
  #asked = 0;
  /** The number of the last command requested. */
  #named = 0;
  #address = '';
  #save;

  /**
   * @param {Editor} editor
   * @param {Link} link
   * @param {Hello} hello
   * @param {Record<Side, Pane>} panes
   * @param {() => Promise<boolean>} save saves pins and strokes; whether it has
   */
  constructor(editor, link, hello, panes, save) {
    this.#save = save;
    this.#editor = editor;
    this.#link = link;
    this.#hello = hello;
    this.#panes = panes;
    input('picture').value = hello.picture;
    offerFormats(hello.picture);
    button('more').onclick = () => {
      this.say('');
      dialog('export').showModal();
      this.#showCommand();
      this.#showPreview();
    };
    input('picture').oninput = () => this.#showCommand();
    input('picture').onchange = () => this.#showPreview();
    input('size').oninput = () => this.#showCommand();
    select('format').onchange = () => {
      input('picture').value = input('picture').value.replace(SUFFIX, '') + select('format').value;
      this.#showCommand();
      this.#showPreview();
    };
    button('download').onclick = () => this.#download();
    button('export-copy').onclick = () => this.#copy();
  }

  /**
   * Say in the dialog what was written, or why nothing was.
   * @param {string} text
   * @param {boolean} [bad]
   */
  say(text, bad = false) {
    byId('export-said').textContent = bad ? '' : text;
    byId('export-fault').textContent = bad ? text : '';
  }

  /** Copy the command; first save the pins and strokes that it reads. */
  async #copy() {
    if (!byId('export-unsaved').hidden) {
      if (!await this.#save()) return;
      await this.#showCommand();
    }
    await navigator.clipboard.writeText(byId('export-command').textContent ?? '');
    this.say(`${byId('export-said').textContent} Copied.`.trim());
  }

  /** The chosen file name and size. */
  get choice() {
    return {name: input('picture').value, size: Math.round(Number(input('size').value)) || DEFAULT_SIZE};
  }

  /** Show the command that writes the same file, and the size if the file has pixels; or why there can be no such file. */
  async #showCommand() {
    const {name, size} = this.choice, number = this.#named += 1;
    select('format').value = formatOf(name, [...select('format').options].map((option) => option.value));
    const answer = name ? await this.#link.ask({type: 'export', scene: this.#editor.scene, name, size, write: false}) : {error: 'Enter a file name.'};
    if (number !== this.#named) return;  // the name has changed meanwhile
    const fault = answer.error ?? '';
    for (const id of ['download', 'export-now']) button(id).disabled = fault !== '';
    byId('export-fault').textContent = fault;
    byId('export-same').hidden = fault !== '';
    byId('export-command').textContent = answer.command ?? '';
    const unsaved = answer.unsaved ?? [];
    byId('export-unsaved').hidden = unsaved.length === 0;
    byId('export-unsaved').textContent = `It reads ${unsaved.join(' and ')}, not saved yet.`;
    button('export-copy').textContent = unsaved.length ? 'Save pins and copy' : 'Copy';
    if (!fault) byId('size-field').hidden = answer.sized === false;
  }

  /**
   * Fetch what the server writes under a name, to show or download it, with notes that the page does not show yet.
   * @param {string} name
   * @param {number} size
   * @returns {Promise<{blob?: Blob, name: string, notes: string[], error?: string}>}
   */
  async #fetch(name, size) {
    const answer = await fetch('export', {method: 'POST', body: JSON.stringify({scene: this.#editor.scene, name, size})});
    const given = answer.headers.get('x-file-name');
    if (!given) return {name, notes: [], ...await answer.json()};
    /** @type {string[]} */
    const notes = JSON.parse(decodeURIComponent(answer.headers.get('x-notes') ?? '[]'));
    const known = shownNotes();
    return {blob: await answer.blob(), name: decodeURIComponent(given), notes: notes.filter((note) => !known.includes(note))};
  }

  async #showPreview() {
    this.#asked += 1;
    const number = this.#asked, {name} = this.choice;
    if (this.#hello.target.mesh) {
      this.#showPicture(this.#panes.target.picture(PREVIEW_SIZE, PREVIEW_SIZE), ['The mesh in the current view.']);
      return;
    }
    const isShown = SHOWN.test(name);
    const {blob, notes, error} = await this.#fetch(isShown ? name : 'preview.png', PREVIEW_SIZE);
    if (number !== this.#asked) return;  // another format was chosen meanwhile
    if (!blob) {
      showFault(error ?? '');
      return;
    }
    URL.revokeObjectURL(this.#address);
    this.#address = URL.createObjectURL(blob);
    const texts = isShown ? notes : ['Browsers cannot show this format; this is the same result as PNG.'];
    this.#showPicture(this.#address, texts);
  }

  /**
   * @param {string} address
   * @param {string[]} texts
   */
  #showPicture(address, texts) {
    const image = document.createElement('img');
    image.src = address;
    image.alt = 'the result';
    byId('preview').replaceChildren(image, ...texts.map(hint));
  }

  async #download() {
    button('download').disabled = true;
    const {blob, name, notes, error} = await this.#fetch(this.choice.name, this.choice.size);
    button('download').disabled = false;
    if (!blob) {
      showFault(error ?? '');
      return;
    }
    saveAs(blob, name);
    this.say([`Downloaded ${name}.`, ...notes].join(' '));
    report(`Downloaded ${name}.`);
  }
}

/**
 * Let the browser save a file.
 * @param {Blob} blob
 * @param {string} name
 */
export function saveAs(blob, name) {
  const link = document.createElement('a'), address = URL.createObjectURL(blob);
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address));
}

/**
 * Offer only formats of meshes if a mesh is written, and only others if not.
 * @param {string} name the default name of the file
 */
function offerFormats(name) {
  const options = [...select('format').options].filter(({value}) => value);
  const usual = options.find(({value}) => name.toLowerCase().endsWith(value));
  const writesMesh = !usual || 'mesh' in usual.dataset;
  for (const option of options) option.disabled = option.hidden = 'mesh' in option.dataset !== writesMesh;
}

/**
 * Show why there is no file in place of the preview.
 * @param {string} error
 */
function showFault(error) {
  const text = hint(error);
  text.classList.add('fault');
  text.setAttribute('role', 'alert');
  byId('preview').replaceChildren(text);
}

/** @param {string} text */
function hint(text) {
  const element = document.createElement('p');
  element.className = 'hint';
  element.textContent = text;
  return element;
}

/**
 * Return the format that a file's name ends in; empty if it is not one of these.
 * @param {string} name
 * @param {string[]} formats
 */
export const formatOf = (name, formats) => formats.find((each) => each && name.toLowerCase().endsWith(each)) ?? '';
