// The dialog that adds handles: rows and columns of pins where the map takes them, as one step of the history.

import {button, dialog, input} from './dom.js';
import {report} from './status.js';

/** @import {Editor} from './editor.js' */
/** @import {Link} from './link.js' */

/**
 * @param {Editor} editor
 * @param {Link} link
 */
export function listenToLattice(editor, link) {
  button('handles-show').onclick = () => {
    dialog('handles').returnValue = '';
    dialog('handles').showModal();
  };
  dialog('handles').onclose = async () => {
    if (dialog('handles').returnValue !== 'add') return;
    const rows = input('handle-rows').valueAsNumber, columns = input('handle-columns').valueAsNumber;
    const answer = await link.ask({type: 'handles', scene: editor.scene, rows, columns});
    if (!answer.pins) {
      report(answer.error ?? '', true);
      return;
    }
    editor.scene.pins.push(...answer.pins);
    report(`Added ${answer.pins.length} handles.`);
    editor.commit();
  };
}
