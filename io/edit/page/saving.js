// Writing files: pins and strokes, copies of the drawings, pictures and meshes; and the command that repeats the map.

import {button, byId, dialog, input, select} from './dom.js';
import {contentOf} from './history.js';
import {report} from './status.js';

/** @import {Editor} from './editor.js' */
/** @import {Link} from './link.js' */
/** @import {Hello} from './types.d.ts' */

const DEFAULT_SIZE = 1024;  // pixels of the longer side, as of `iccm map`
const SUFFIX = /(\.stmap)?\.[^.]*$/;

export class Saving {
  #editor;
  #link;
  #hello;

  /**
   * @param {Editor} editor
   * @param {Link} link
   * @param {Hello} hello
   */
  constructor(editor, link, hello) {
    this.#editor = editor;
    this.#link = link;
    this.#hello = hello;
    input('file').value = hello.constraints;
    input('picture').value = hello.picture;
    input('ending').value = hello.ending;
    input('file').disabled = hello.drawn;
    button('save-as').disabled = hello.drawn;
    this.#listen();
  }

  #listen() {
    button('save').onclick = () => this.save();
    button('more').onclick = () => {
      dialog('export').showModal();
      this.#showCommand();
    };
    dialog('export').onclose = () => {
      const chosen = dialog('export').returnValue;
      dialog('export').returnValue = '';
      if (chosen === 'save') this.save();
      if (chosen === 'export') this.#export();
      if (chosen === 'draw') this.#draw();
    };
    input('picture').oninput = () => this.#showCommand();
    input('size').oninput = () => this.#showCommand();
    select('format').onchange = () => {
      input('picture').value = input('picture').value.replace(SUFFIX, '') + select('format').value;
      this.#showCommand();
    };
    button('copy').onclick = async () => {
      await navigator.clipboard.writeText(byId('command').textContent ?? '');
      report(this.#editor.dirty ? 'Copied. The command reads the saved pins and strokes: save first.' : 'Copied.');
    };
    addEventListener('beforeunload', (event) => {
      if (this.#editor.dirty) event.preventDefault();
    });
  }

  /** Save pins and strokes where they came from: in a separate file, or drawn in the shapes' files. */
  save() {
    return this.#hello.drawn ? this.#draw() : this.#write({type: 'save', name: input('file').value});
  }

  #draw() {
    return this.#write({type: 'draw', name: input('ending').value});
  }

  #export() {
    return this.#write({type: 'export', name: input('picture').value, size: chosenSize()});
  }

  /**
   * Have the server write files, and ask the user whether to replace those that exist.
   * @param {{type: string, name: string, size?: number}} message
   */
  async #write(message) {
    const editor = this.#editor, question = {...message, scene: editor.scene}, content = contentOf(editor.scene);
    let answer = await this.#link.ask(question);
    if (answer.exists) {
      if (!confirm(`${answer.exists.join(', ')}: the file exists. Replace it?`)) return;
      answer = await this.#link.ask({...question, replace: true});
    }
    if (answer.error) {
      report(answer.error, true);
      return;
    }
    if (answer.command) byId('command').textContent = answer.command;
    if (message.type === (this.#hello.drawn ? 'draw' : 'save')) editor.saved = content;
    const sentences = [`Wrote ${(answer.written ?? []).join(', ')}.`, answer.message, ...(answer.notes ?? [])];
    report(sentences.filter(Boolean).join(' '));
    editor.changed();
  }

  /** Show the command that writes what the dialog would. */
  async #showCommand() {
    const name = input('picture').value;
    select('format').value = formatOf(name, [...select('format').options].map((option) => option.value));
    if (!name) return;
    const question = {type: 'export', scene: this.#editor.scene, name, size: chosenSize(), write: false};
    const answer = await this.#link.ask(question);
    byId('export-command').textContent = answer.command ?? answer.error ?? '';
  }
}

const chosenSize = () => Math.round(Number(input('size').value)) || DEFAULT_SIZE;

/**
 * The format that a file's name ends in, empty where it is none of them.
 * @param {string} name
 * @param {string[]} formats
 */
export const formatOf = (name, formats) => formats.find((each) => each && name.toLowerCase().endsWith(each)) ?? '';
