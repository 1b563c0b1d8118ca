// Keys for the whole page; those for pins and shapes are in handles.js and gestures.js.

import {button, byId} from './dom.js';
import {toggleOverlay} from './controls.js';

/** @import {Comparison} from './compare.js' */
/** @import {Editor} from './editor.js' */
/** @import {Layout} from './layout.js' */
/** @import {Linked} from './linked.js' */
/** @import {Pane} from './pane.js' */
/** @import {Saving} from './saving.js' */
/** @import {Tools} from './tools.js' */
/** @import {Side} from './types.d.ts' */

const KEY_ZOOM = 1.25;  // zoom factor of the keys + and -

/**
 * @param {object} parts
 * @param {Editor} parts.editor
 * @param {Record<Side, Pane>} parts.panes
 * @param {Comparison} parts.comparison
 * @param {Saving} parts.saving
 * @param {Tools} parts.tools
 * @param {Linked} parts.linked
 * @param {Layout} parts.layout
 */
export function listenToKeys({editor, panes, comparison, saving, tools, linked, layout}) {
  const focused = () => (byId('source').contains(document.activeElement) ? panes.source : panes.target);

  /** @type {Record<string, (event: KeyboardEvent) => void>} */
  const withControl = {
    z: (event) => editor.travel(event.shiftKey ? 1 : -1),
    y: () => editor.travel(1),
    s: () => saving.save(),
    a: () => {
      editor.scene.pins.forEach((_, k) => editor.selected.add(k));
      editor.changed();
    },
  };
  /** @type {Record<string, (event: KeyboardEvent) => void>} */
  const plain = {
    v: () => tools.take('pin'),
    t: () => tools.toggle('pair'),
    s: () => tools.toggle('stroke'),
    m: () => tools.toggle('select'),
    escape: () => {
      tools.take('pin');
      editor.stopSearch();
      editor.pending = null;
      editor.selected.clear();
      editor.changed();
    },
    k: () => linked.toggle(),
    x: () => layout.toggle('swapped'),
    y: () => layout.toggle('both'),
    g: () => toggleOverlay(panes, 'grid'),
    h: () => toggleOverlay(panes, 'stretch'),
    a: () => comparison.swap(),
    b: () => comparison.blink(),
    d: () => comparison.step(),
    p: () => focused().click(),
    enter: () => { if (focused().drawing) focused().drawn(); },
    0: () => button('fit').click(),
    '?': () => button('help').click(),
    '+': () => focused().zoomBy(KEY_ZOOM),
    '-': () => focused().zoomBy(1 / KEY_ZOOM),
  };

  addEventListener('keydown', (event) => {
    if (document.querySelector('dialog[open]') || !(event.target instanceof Element)) return;
    const key = event.key.toLowerCase(), control = event.ctrlKey || event.metaKey;
    const typing = event.target.matches('input[type=text], input[type=number]');
    if (key === 'enter' && event.target.matches('button, input')) return;
    if (typing && !(control && key === 's')) return;
    const action = (control ? withControl : plain)[key];
    if (!action) return;
    event.preventDefault();
    action(event);
  });
}
