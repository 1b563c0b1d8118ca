// Saving pins and strokes, or copies of the drawings, in iccm's folder; and the command that repeats the map.

import {button, byId, dialog, input} from './dom.js';
import {Exporting} from './exporting.js';
import {contentOf} from './history.js';
import {report} from './status.js';

/** @import {Editor} from './editor.js' */
/** @import {Link} from './link.js' */
/** @import {Pane} from './pane.js' */
/** @import {Hello, Side} from './types.d.ts' */

export class Saving {
  #editor;
  #link;
  #hello;
  #exporting;

  /**
   * @param {Editor} editor
   * @param {Link} link
   * @param {Hello} hello
   * @param {Record<Side, Pane>} panes
   */
  constructor(editor, link, hello, panes) {
    this.#editor = editor;
    this.#link = link;
    this.#hello = hello;
    this.#exporting = new Exporting(editor, link, hello, panes, () => this.save());
    input('file').value = hello.constraints;
    input('ending').value = hello.ending;
    byId('save-list').hidden = hello.drawn;  // pins are saved where they came from
    this.#listen();
  }

  #listen() {
    button('save').onclick = () => this.save();
    dialog('export').onclose = () => {
      const chosen = dialog('export').returnValue;
      dialog('export').returnValue = '';
      if (chosen === 'save') this.save();
      if (chosen === 'draw') this.#draw();
    };
    button('copy').onclick = async () => {
      await navigator.clipboard.writeText(byId('command').textContent ?? '');
      report(this.#editor.dirty ? 'Copied. The command reads the saved pins and strokes: save first.' : 'Copied.');
    };
    button('export-now').onclick = () => this.#export();
    addEventListener('beforeunload', (event) => {
      if (this.#editor.dirty) event.preventDefault();
    });
  }

  async #export() {
    button('export-now').disabled = true;
    await this.#write({type: 'export', ...this.#exporting.choice});
    button('export-now').disabled = false;
  }

  /**
   * Save pins and strokes where they came from: to a separate file, or drawn into copies of the shapes' files. Return
   * whether they were saved.
   */
  save() {
    return this.#hello.drawn ? this.#draw() : this.#write({type: 'save', name: input('file').value});
  }

  #draw() {
    return this.#write({type: 'draw', name: input('ending').value});
  }

  /**
   * Let the server write files, and ask the user whether to replace existing ones. Return whether they were written.
   * @param {{type: string, name: string, size?: number}} message
   */
  async #write(message) {
    const editor = this.#editor, question = {...message, scene: editor.scene}, content = contentOf(editor.scene);
    let answer = await this.#link.ask(question);
    if (answer.exists) {
      if (!confirm(`${answer.exists.join(', ')}: the file exists. Replace it?`)) return false;
      answer = await this.#link.ask({...question, replace: true});
    }
    if (answer.error) {
      this.#exporting.say(answer.error, true);
      report(answer.error, true);
      return false;
    }
    if (answer.command) byId('command').textContent = answer.command;
    if (message.type === (this.#hello.drawn ? 'draw' : 'save')) editor.saved = content;
    const written = `Saved ${(answer.written ?? []).join(', ')} in ${answer.folder}.`;
    this.#exporting.say([written, ...(answer.notes ?? [])].join(' '));
    report(written);
    editor.changed();
    return true;
  }
}
