// Landmarks of other programs: import pins from a file, and export them.

import {input} from './dom.js';
import {saveAs} from './exporting.js';
import {report} from './status.js';

/** @import {Editor} from './editor.js' */
/** @import {Link} from './link.js' */
/** @import {Pin} from './types.d.ts' */

/** @param {Pin} pin */
const placesOf = ({source, target}) => JSON.stringify([source, target]);

/**
 * Return the pins of a file that are not there yet. Pins whose places are the same on both sides are the same.
 * @param {Pin[]} pins
 * @param {Pin[]} read
 */
export function newPins(pins, read) {
  const known = new Set(pins.map(placesOf));
  return read.filter((pin) => !known.has(placesOf(pin)));
}

/**
 * @param {Editor} editor
 * @param {Link} link
 */
export function listenToLandmarks(editor, link) {
  const field = input('landmarks');
  field.onchange = async () => {
    const file = field.files?.[0];
    if (!file) return;
    const answer = await link.ask({type: 'read-pins', name: file.name, text: await file.text()});
    field.value = '';  // so that the same file can be chosen again
    if (!answer.pins) {
      report(answer.error ?? '', true);
      return;
    }
    const {pins} = editor.scene, added = newPins(pins, answer.pins), known = answer.pins.length - added.length;
    pins.push(...added);
    report(`Added ${added.length} pins from ${file.name}${known ? `; ${known} are there already` : ''}.`);
    if (added.length) editor.commit();
  };
  for (const element of document.querySelectorAll('[data-landmarks]')) {
    const button = /** @type {HTMLButtonElement} */ (element);
    button.onclick = async () => {
      const answer = await link.ask({type: 'write-pins', scene: editor.scene, suffix: button.dataset.landmarks});
      if (answer.text === undefined) {
        report(answer.error ?? '', true);
        return;
      }
      saveAs(new Blob([answer.text], {type: 'text/plain'}), answer.name ?? 'landmarks');
      report(`Downloaded ${answer.name}.`);
    };
  }
}
