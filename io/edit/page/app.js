// iccm edit: connects the server, the editor, the two shapes and the controls.

import {actionsOf} from './actions.js';
import {Comparison} from './compare.js';
import {listenToControls, showControls} from './controls.js';
import {button, byId, dialog, input, select} from './dom.js';
import {Editor} from './editor.js';
import {Fits} from './fits.js';
import {showFigures} from './figures.js';
import {fileName} from './geometry.js';
import {contentOf, History, leftSentence, showHistory} from './history.js';
import {listenToKeys} from './keys.js';
import {listenToLandmarks} from './landmarks.js';
import {listenToLattice} from './lattice.js';
import {Layout} from './layout.js';
import {Link} from './link.js';
import {Linked} from './linked.js';
import {showList} from './list.js';
import {choose, welcome} from './open.js';
import {Pane} from './pane.js';
import {Preview} from './preview.js';
import {showPinSettings} from './pin_settings.js';
import {Saving} from './saving.js';
import {report, showNotes} from './status.js';
import {Tools} from './tools.js';
import {Tour} from './tour.js';

/** @import {Movement} from './preview.js' */
/** @import {Actions, ErrorMessage, Figures, Hello, MapMessage, PaneScene, Side, TakenMessage} from './types.d.ts' */

const GRID_LINES = 16;  // along the longer side of the source

/** Set once the server has reported the open shapes. */
/** @type {{hello: Hello, panes: Record<Side, Pane>, actions: Actions, comparison: Comparison, linked: Linked, preview: Preview} | null} */
let page = null;

/** The figures of the last full map. @type {Figures} */
let figures = {};

/** The paper below the drawing. */
let shownPaper = 'plain';

/** Whether another tab is editing. */
let taken = false;

const link = new Link(receive, () => {
  const again = page ? `Run this again to continue on this page: ${page.hello.restart}` : 'Run iccm edit again to continue.';
  report(`iccm has ended. ${again}`, true);
  document.body.classList.add('ended');
});
const history = new History(sessionStorage, location.pathname);
const editor = new Editor((message) => link.say(message), history, refresh);
history.changed = () => showHistory(byId('past'), history, (steps) => editor.travel(steps));

new Tour();
const layout = new Layout();
button('take').onclick = () => link.say({type: 'take'});
button('help').onclick = () => dialog('keys').showModal();
button('choose').onclick = () => choose(() => {
  editor.saved = contentOf(editor.scene);  // the server keeps unsaved changes
});

/**
 * @param {Hello | MapMessage | ErrorMessage | TakenMessage} message
 * @param {Float32Array | null} floats of a map
 */
function receive(message, floats) {
  if (message.type === 'hello') begin(message);
  else if (message.type === 'taken') giveAway();
  else if (message.type === 'error') report(message.message, true);
  else if (editor.receive(message)) showMap(message, floats);
}

/** @param {Hello} hello */
const namesOf = ({source, target}) => JSON.stringify([source.name, target.name]);

/** Leave the shapes to another tab until the user wants to edit here again. */
function giveAway() {
  taken = true;
  dialog('files').close();
  byId('taken').hidden = false;
  document.body.classList.add('ended');
}

// ---------------------------------------------------------------- begin

/**
 * Continue from what another tab has changed on the same shapes; reload the page if it has opened others.
 * @param {Hello} hello
 */
function takeBack(hello) {
  taken = false;
  byId('taken').hidden = true;
  document.body.classList.remove('ended');
  if (!page && hello.empty) return;
  if (!page || hello.empty || namesOf(hello) !== namesOf(page.hello)) {
    editor.saved = contentOf(editor.scene);  // the server has the unsaved changes
    location.reload();
    return;
  }
  editor.scene = hello.scene;
  history.push(hello.scene);
}

/** @param {Hello} hello */
async function begin(hello) {
  if (taken) takeBack(hello);
  if (hello.empty) {
    welcome();
    return;
  }
  if (page) {
    page.hello = hello;  // the server was restarted, or another tab has edited
  } else {
    try {
      page = await open(hello);
    } catch (error) {
      report(error instanceof Error ? error.message : String(error), true);
      return;
    }
  }
  document.body.classList.remove('ended');
  editor.saved = contentOf(hello.saved);
  byId('left').hidden = !hello.left || contentOf(hello.left) === contentOf(editor.scene);
  byId('left-what').textContent = hello.left ? leftSentence(hello.left, new Date(hello.left_when)) : '';
  button('go-on').onclick = () => {
    byId('left').hidden = true;
    if (!hello.left) return;
    editor.scene = hello.left;
    editor.commit();
  };
  button('forget').onclick = () => {
    byId('left').hidden = true;
    link.ask({type: 'forget'});
  };
  editor.solve();
}

/**
 * Create both halves of the page and everything that belongs to them.
 * @param {Hello} hello
 */
async function open(hello) {
  editor.begin(hello.scene);
  const panes = /** @type {Record<Side, Pane>} */ ({});
  const actions = actionsOf({editor, link, panes, hello, report, putDown: () => tools.take('pin'), moved: showMoved});
  panes.source = new Pane('source', byId('source'), hello.source, hello, actions);
  panes.target = new Pane('target', byId('target'), hello.target, hello, actions);
  await Promise.all([panes.source.load(), panes.target.load()]);
  resize(panes);
  loadTexture(hello, panes);
  const tools = new Tools(panes), linked = new Linked(panes), comparison = new Comparison(editor, panes);
  const saving = new Saving(editor, link, hello, panes);
  tools.changed = () => {
    editor.pending = null;
    editor.changed();
  };
  listenToControls({editor, link, panes, actions});
  listenToLandmarks(editor, link);
  listenToLattice(editor, link);
  new Fits(editor, (side) => presentResult(panes.target, side));
  listenToKeys({editor, panes, comparison, saving, tools, linked, layout});
  disableControls(hello, panes);
  showNotes(hello.notes);
  showTitle(hello);
  Object.assign(globalThis, {iccm: inspection(panes)});
  return {hello, panes, actions, comparison, linked, preview: new Preview({source: hello.source, target: hello.target})};
}

/**
 * Disable controls that do not apply to these shapes.
 * @param {Hello} hello
 * @param {Record<Side, Pane>} panes
 */
function disableControls(hello, panes) {
  const drawn = panes.source.hasDrawing || panes.target.hasDrawing;
  input('own').disabled = !drawn;
  button('blink').disabled = !drawn;
  for (const option of select('view').options) {
    if (option.value === 'onion') option.disabled = hello.target.mesh;
    else option.disabled = option.value !== 'result' && !drawn;
  }
  document.body.classList.toggle('deforming', hello.deforming);
  button('fits-show').hidden = hello.source.mesh || hello.target.mesh;
  input('any').disabled = hello.deforming;
  button('suggest').disabled = hello.deforming;
  button('draw').disabled = hello.deforming;
}

/** @param {Hello} hello */
function showTitle({source, target, deforming}) {
  const title = byId('title');
  title.textContent = deforming ? `${fileName(source.name)}, deformed` : `${fileName(source.name)} → ${fileName(target.name)}`;
  title.title = `${source.name} → ${target.name}`;
  document.title = `${title.textContent} · iccm edit`;
}

/**
 * The state of the page for tests and the console.
 * @param {Record<Side, Pane>} panes
 */
const inspection = (panes) => ({
  panes,
  get scene() { return editor.scene; },
  get kind() { return editor.kind; },
  get seq() { return [editor.asked, editor.shown]; },
});

/**
 * Paint at the screen's resolution, and again when the window moves to another screen.
 * @param {Record<Side, Pane>} panes
 */
function resize(panes) {
  panes.source.resized();
  panes.target.resized();
  matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener('change', () => resize(panes), {once: true});
}

/**
 * @param {Hello} hello
 * @param {Record<Side, Pane>} panes
 * @param {string} [paper] below a drawing: plain, or toned where a tone lies on it
 */
async function loadTexture(hello, panes, paper = 'plain') {
  shownPaper = paper;
  const answer = await fetch(`texture.png?side=${panes.source.painter.maxSide}&paper=${paper}`), {box, bounds} = hello.source;
  const image = await createImageBitmap(await answer.blob(), {colorSpaceConversion: 'none', premultiplyAlpha: 'none'});
  if (paper !== shownPaper) return;
  for (const pane of [panes.source, panes.target]) {
    pane.painter.texture(image, {box, edge: hello.edge, filter: hello.filter});
    pane.overlay.step = Math.max(bounds[2] - bounds[0], bounds[3] - bounds[1]) / GRID_LINES;
    pane.redraw();
  }
}

// ---------------------------------------------------------------- what is shown

/**
 * Show a map from the server, or why there is none.
 * @param {MapMessage} message
 * @param {Float32Array | null} floats
 */
function showMap(message, floats) {
  if (!page) return;
  const {target} = page.panes, failed = message.kind === 'error';
  target.hurry(message.kind === 'coarse');
  if (editor.replaced && floats) target.fade();
  if (message.outlines?.length) target.reshape(message.outlines);
  if (message.kind === 'full') {
    figures = message.figures;
    const paper = message.silhouette?.colors?.[1] ? 'toned' : 'plain';
    target.showSilhouette(message.silhouette ?? {});
    if (paper !== shownPaper) loadTexture(page.hello, page.panes, paper);
  }
  if (floats) {
    target.painter.map(page.preview.take(floats, message.seq));
    page.linked.take(floats);
    if (message.kind === 'full') page.comparison.take(floats);
    target.redraw();
  }
  if (message.kind === 'blocked' || failed) withdrawPreview();
  if (!failed && message.kind !== 'blocked') showFigures(/** @type {HTMLTableElement} */ (byId('figures')), message.kind, message.figures);
  if (message.kind === 'full') showNotes([...page.hello.notes, ...(message.figures.notes ?? [])]);
  showOtherMap(message.other ?? '');
  if (message.command) byId('command').textContent = message.command;
  const sentence = failed ? `${message.message.replace(/\.$/, '')}. The last valid map is shown.` : message.message;
  report(sentence, !message.ok);
  document.body.classList.toggle('short', Boolean(message.short?.length));
  refresh();
}

/**
 * Return what is seen, as a result to compare with others; null while it changes.
 * @param {Pane} pane
 * @param {number} side pixels of the longer side
 */
function presentResult(pane, side) {
  const [left, top, right, bottom] = pane.shape.box, zoom = side / Math.max(right - left, bottom - top);
  if (editor.kind !== 'full' || editor.busy) return null;
  return {address: pane.picture(Math.round(zoom * (right - left)), Math.round(zoom * (bottom - top))), figures, text: ''};
}

/**
 * Show a movement of a pin before the server has answered.
 * @param {Movement} movement
 */
function showMoved(movement) {
  if (!page || page.hello.target.mesh || page.hello.deforming) return;
  const floats = page.preview.move(movement);
  if (!floats) return;
  page.panes.target.hurry(true);
  showPreview(floats);
}

/** Show the server's last map where the map cannot follow. */
function withdrawPreview() {
  if (page && !page.hello.target.mesh && !page.hello.deforming) showPreview(page.preview.withdraw());
}

/** @param {Float32Array} floats */
function showPreview(floats) {
  if (!page || !floats.length) return;
  const {target} = page.panes;
  target.painter.map(floats);
  page.linked.take(floats);
  target.redraw();
}

/** @param {string} way to the other of two known maps; empty if there is only one */
function showOtherMap(way) {
  const element = button('other');
  element.hidden = !way;
  element.dataset.way = way;
  element.textContent = way === 'kept' ? 'Back to the continued map' : 'Recompute from scratch';
}

/** @param {Record<Side, Pane>} panes */
const digitsOf = ({source, target}) => ({
  source: source.units.placedDigits(source.view.zoom), target: target.units.placedDigits(target.view.zoom),
});

/** Show the state of the editor in both halves, in the list and in the controls. */
function refresh() {
  if (!page) return;
  const {wrong, suggested, selected, regions, patches, bent, active, pending} = editor;
  /** @type {PaneScene} */
  const scene = {
    ...editor.scene, wrong, suggested, selected, regions, patches, bent, active, pending, digits: digitsOf(page.panes), locked: (entry) => editor.isLocked(entry),
    wanted: (pin) => editor.wanted(pin), unmapped: editor.unmapped, failed: editor.kind === 'error',
  };
  for (const pane of [page.panes.source, page.panes.target]) {
    pane.scene = scene;
    pane.redraw(false);
  }
  showList(byId('list'), scene, page.actions);
  showPinSettings(scene, page.hello, page.actions);
  showControls(editor, page.hello);
}
