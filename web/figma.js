// The window of the plug-in for Figma: the demo with the layers that are selected there. plugins/figma/code.js is the other end.

import {button, byId} from '../io/edit/page/dom.js';
import {begin, pictureOf, pictureShape, report} from './demo.js';
import {shapeOf} from './svg.js';

/** @import {Demo} from './demo.js' */

/** A selected layer: its drawing, and a picture of it if it is filled by one. @typedef {{name: string, svg: string, png: Uint8Array | null}} Layer */
/** @typedef {{kind: 'layers', source: Layer, target: Layer} | {kind: 'refused', text: string}} Message */

const BAR = `<p class="figma-bar"><button type="button" id="figma-place" disabled>Place in Figma</button>
  <button type="button" id="figma-swap">Swap source and target</button></p>`;

/** @param {object} message */
const tell = (message) => parent.postMessage({pluginMessage: message}, '*');

/**
 * Do something, and show why if it fails.
 * @param {() => Promise<void>} work
 */
async function attempt(work) {
  try {
    await work();
  } catch (error) {
    report(error instanceof Error ? error.message : String(error), true);
  }
}

/**
 * Show the map of two layers. A source that is filled by a picture is a picture, other sources are drawings.
 * @param {Demo} demo
 * @param {Layer} source
 * @param {Layer} target
 * @returns {Promise<'svg' | 'png'>} the form of the result
 */
async function show(demo, source, target) {
  const goal = shapeOf(target.svg, `${target.name}.svg`);
  if (!source.png) {
    demo.replace(shapeOf(source.svg, `${source.name}.svg`), goal);
    return 'svg';
  }
  const picture = await pictureOf(new Blob([new Uint8Array(source.png)]), `${source.name}.png`);
  demo.replace(pictureShape(picture), goal, picture);
  return 'png';
}

async function main() {
  const demo = await begin();
  if (!demo) return;
  byId('try').insertAdjacentHTML('afterbegin', BAR);
  /** @type {'svg' | 'png'} */
  let format = 'svg';
  addEventListener('message', (event) => attempt(async () => {
    const message = /** @type {Message | undefined} */ (event.data?.pluginMessage);
    button('figma-place').disabled = message?.kind !== 'layers';
    if (message?.kind === 'refused') throw new Error(message.text);
    if (message?.kind === 'layers') format = await show(demo, message.source, message.target);
  }));
  button('figma-swap').addEventListener('click', () => tell({kind: 'swap'}));
  button('figma-place').addEventListener('click', () => attempt(async () => {
    const {blob, note} = await demo.result(format);
    if (format === 'svg') tell({kind: 'drawing', svg: await blob.text()});
    else tell({kind: 'picture', png: new Uint8Array(await blob.arrayBuffer())});
    if (note) report(note);
  }));
  tell({kind: 'ready'});
}

main();
