// The controls beside and above the shapes: settings of the map, undo, suggested pins and overlays.

import {button, byId, input, output} from './dom.js';
import {showFit} from './fits.js';
import {report} from './status.js';

/** @import {Editor} from './editor.js' */
/** @import {Link} from './link.js' */
/** @import {Pane} from './pane.js' */
/** @import {Actions, Hello, Side} from './types.d.ts' */

/**
 * @param {object} parts
 * @param {Editor} parts.editor
 * @param {Link} parts.link
 * @param {Record<Side, Pane>} parts.panes
 * @param {Actions} parts.actions
 */
export function listenToControls({editor, link, panes, actions}) {
  button('undo').onclick = () => editor.travel(-1);
  button('redo').onclick = () => editor.travel(1);
  button('fit').onclick = () => {
    panes.source.showAll();
    panes.target.showAll();
  };
  for (const name of /** @type {const} */ (['grid', 'stretch'])) {
    button(name).onclick = () => toggleOverlay(panes, name);
  }
  button('other').onclick = () => {
    editor.saved = '';  // the saved file determines which of the two maps the command makes
    editor.solve(button('other').dataset.way);
  };
  button('search').onclick = () => editor.search();
  button('yield').onclick = () => yieldPins(editor, link);
  button('bent-rigid').onclick = () => editor.unbend('rigid');
  button('bent-pin').onclick = () => editor.unbend('pin');
  listenToMapControls(editor);
  listenToSuggestions(editor, link, actions);
}

/**
 * Move the target's ends of the pins that the map cannot meet to where the picture is; of equal ones, one is left.
 * @param {Editor} editor
 * @param {Link} link
 */
async function yieldPins(editor, link) {
  const pins = (editor.wrong.pins ?? []).map((k) => editor.scene.pins[k]);
  const {points, error} = await link.ask({type: 'place', side: 'source', points: pins.map((pin) => pin.source)});
  if (error || !points) {
    report(error ?? '', true);
    return;
  }
  pins.forEach((pin, k) => { pin.target = points[k]; });
  const all = editor.scene.pins, ends = all.map(({source, target}) => JSON.stringify([source, target]));
  editor.scene.pins = all.filter((_, k) => ends.indexOf(ends[k]) === k);
  editor.commit();
}

/** @param {Editor} editor */
function listenToMapControls(editor) {
  input('balance').oninput = () => {
    editor.scene.balance = Number((10 ** Number(input('balance').value)).toFixed(2));
    editor.follow();
  };
  input('balance').onchange = () => editor.drop();
  for (const preset of document.querySelectorAll('[data-balance]')) {
    const element = /** @type {HTMLButtonElement} */ (preset);
    element.onclick = () => {
      editor.scene.balance = Number(element.dataset.balance);
      editor.commit();
    };
  }
  input('turn').oninput = () => {
    editor.scene.turn = Number(input('turn').value);
    editor.solve();
  };
  input('turn').onchange = () => editor.commit();
  input('any').onchange = () => {
    editor.scene.turn = input('any').checked ? 'any' : Number(input('turn').value);
    editor.commit();
  };
}

/**
 * @param {Editor} editor
 * @param {Link} link
 * @param {Actions} actions
 */
function listenToSuggestions(editor, link, actions) {
  button('suggest').onclick = async () => {
    const answer = await link.ask({type: 'suggest', scene: editor.scene});
    if (answer.error) {
      report(answer.error, true);
      return;
    }
    editor.suggested = answer.pins ?? [];
    const count = editor.suggested.length;
    report(count ? `${count} suggested: click those you want.` : 'The drawings have no corners or names in common.');
    editor.changed();
  };
  button('accept').onclick = () => actions.accept(...editor.suggested.keys());
  button('dismiss').onclick = () => {
    editor.suggested = [];
    editor.changed();
  };
}

/**
 * Show the state of the editor in the controls.
 * @param {Editor} editor
 * @param {Hello} hello
 */
export function showControls(editor, hello) {
  const {scene, suggested, history} = editor, anyTurn = scene.turn === 'any';
  byId('accept').hidden = suggested.length === 0;
  byId('dismiss').hidden = suggested.length === 0;
  const isEmpty = scene.pins.length + scene.strokes.length + scene.rigid.length === 0;
  byId('none').hidden = !isEmpty;
  button('save').hidden = isEmpty && !editor.dirty;
  const shortCount = scene.pins.filter((pin) => editor.wanted(pin)).length;
  button('search').hidden = shortCount === 0;
  button('search').textContent = `Search for a map that reaches ${shortCount > 1 ? 'these places' : 'that place'}`;
  const missed = editor.kind === 'error' && !editor.busy ? editor.wrong.pins ?? [] : [];
  button('yield').hidden = missed.length === 0 || !editor.hasMap;
  button('yield').textContent = `Put pin${missed.length > 1 ? 's' : ''} ${missed.map((k) => k + 1).join(', ')} where the picture is`;
  for (const id of ['bent-rigid', 'bent-pin']) button(id).hidden = editor.bent.length === 0 || editor.busy;
  button('undo').disabled = !history.canUndo;
  button('redo').disabled = !history.canRedo;
  input('balance').value = String(Math.log10(scene.balance));
  output('balance-value').value = scene.balance.toFixed(2);
  input('any').checked = anyTurn;
  input('turn').disabled = anyTurn || hello.deforming;
  if (!anyTurn) input('turn').value = String(scene.turn);
  output('turn-value').value = anyTurn ? 'any' : `${scene.turn}°`;
  showFit(scene.fit);
  document.body.classList.toggle('dirty', editor.dirty);
  document.body.classList.toggle('busy', editor.busy);
}

/**
 * @param {Record<Side, Pane>} panes
 * @param {'grid' | 'stretch'} name
 */
export function toggleOverlay(panes, name) {
  const on = !panes.source.overlay[name];
  button(name).setAttribute('aria-pressed', String(on));
  if (name === 'stretch') byId('legend').hidden = !on;
  for (const pane of [panes.source, panes.target]) {
    pane.overlay[name] = on;
    pane.redraw();
  }
}
