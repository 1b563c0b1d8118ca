// Keys of the whole page; those of pins and of the shapes are in handles.js and gestures.js.

import {button, byId, input} from './dom.js';
import {setOverlay, setPen} from './controls.js';

/** @import {Comparison} from './compare.js' */
/** @import {Editor} from './editor.js' */
/** @import {Pane} from './pane.js' */
/** @import {Saving} from './saving.js' */
/** @import {Side} from './types.d.ts' */

const KEY_ZOOM = 1.25;  // by which + enlarges, and - shrinks

/**
 * @param {object} parts
 * @param {Editor} parts.editor
 * @param {Record<Side, Pane>} parts.panes
 * @param {Comparison} parts.comparison
 * @param {Saving} parts.saving
 */
export function listenToKeys({editor, panes, comparison, saving}) {
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
    s: () => setPen(panes, !panes.source.pen),
    escape: () => setPen(panes, false),
    g: () => setOverlay(panes, 'grid', !input('grid').checked),
    h: () => setOverlay(panes, 'stretch', !input('stretch').checked),
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
