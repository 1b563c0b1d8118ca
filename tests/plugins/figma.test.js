// The part of the plug-in that Figma runs, with a mock of Figma's API.

import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {test} from 'node:test';
import vm from 'node:vm';

const CODE = readFileSync(new URL('../../plugins/figma/code.js', import.meta.url), 'utf8');

/**
 * Return a layer.
 * @param {string} name
 * @param {object} [more]
 */
function layer(name, more = {}) {
  return {
    name, width: 40, height: 30, fills: /** @type {object[]} */ ([]), absoluteRenderBounds: null, absoluteBoundingBox: {x: 7, y: 9, width: 40, height: 30},
    /** @param {{format: string, constraint?: object}} settings */
    exportAsync: async (settings) => (settings.format === 'PNG' ? Uint8Array.of(1, 2, 3) : `<svg>${name}</svg>`), ...more,
  };
}

/**
 * Start the plug-in.
 * @param {object[]} selection
 */
function begun(selection) {
  /** @type {any[]} */
  const sent = [], made = /** @type {any[]} */ ([]);
  /** @type {Record<string, () => Promise<void>>} */
  const listeners = {};
  const node = (/** @type {object} */ more) => ({
    ...more, resize(/** @type {number} */ width, /** @type {number} */ height) { Object.assign(this, {width, height}); },
  });
  const figma = {
    currentPage: {selection, appendChild: (/** @type {any} */ child) => made.push(child)},
    ui: {postMessage: (/** @type {any} */ message) => sent.push(message), onmessage: /** @type {(message: any) => Promise<void>} */ (async () => {})},
    showUI: (/** @type {string} */ page) => assert.equal(page, 'the window'),
    on: (/** @type {string} */ name, /** @type {() => Promise<void>} */ call) => { listeners[name] = call; },
    createNodeFromSvg: (/** @type {string} */ svg) => node({svg}),
    createRectangle: () => node({fills: []}),
    createImage: (/** @type {Uint8Array} */ bytes) => ({hash: `hash of ${bytes.length}`}),
  };
  vm.runInNewContext(CODE, {figma, __html__: 'the window'});
  return {figma, sent, made, listeners};
}

test('two layers are sent to the window, and a drawing is placed over the target', async () => {
  const target = layer('shield', {absoluteRenderBounds: {x: -4, y: 2, width: 44, height: 34}}), {figma, sent, made} = begun([layer('face'), target]);
  await figma.ui.onmessage({kind: 'ready'});
  const [message] = sent;
  assert.equal(message.kind, 'layers');
  assert.equal(message.source.svg, '<svg>face</svg>');
  assert.equal(message.source.png, null);
  assert.equal(message.target.name, 'shield');
  await figma.ui.onmessage({kind: 'drawing', svg: '<svg>result</svg>'});
  const [{svg, name, x, y, width, height}] = made;
  assert.deepEqual({svg, name, x, y, width, height}, {svg: '<svg>result</svg>', name: 'face in shield', x: -4, y: 2, width: 44, height: 34});
});

test('a layer that is filled by a picture is sent as one, and the result is an image fill', async () => {
  const photo = layer('photo', {fills: [{type: 'IMAGE', visible: true}], width: 20, height: 50}), constraints = /** @type {any[]} */ ([]);
  const {exportAsync} = photo;
  photo.exportAsync = async (settings) => {
    if (settings.constraint) constraints.push(settings.constraint);
    return exportAsync(settings);
  };
  const {figma, sent, made} = begun([photo, layer('shield')]);
  await figma.ui.onmessage({kind: 'ready'});
  assert.equal(sent[0].source.png.length, 3);
  assert.equal(constraints[0].type, 'HEIGHT');
  await figma.ui.onmessage({kind: 'picture', png: Uint8Array.of(9, 9)});
  const [{fills: [fill], x, width}] = made;
  assert.equal(fill.type, 'IMAGE');
  assert.equal(fill.imageHash, 'hash of 2');
  assert.deepEqual([x, width], [7, 40]);
});

test('source and target are swapped, and other selections are refused', async () => {
  const {figma, sent, made, listeners} = begun([layer('one'), layer('two')]);
  await figma.ui.onmessage({kind: 'ready'});
  await figma.ui.onmessage({kind: 'swap'});
  assert.equal(sent[1].source.name, 'two');
  figma.currentPage.selection = [layer('one')];
  await listeners.selectionchange();
  assert.equal(sent[2].kind, 'refused');
  assert.match(sent[2].text, /two layers/);
  await figma.ui.onmessage({kind: 'drawing', svg: '<svg/>'});  // of layers that are no longer selected
  assert.equal(made.length, 0);
});

test('what Figma cannot export is reported', async () => {
  const broken = layer('broken', {exportAsync: async () => { throw new Error('no visible content'); }});
  const {figma, sent} = begun([broken, layer('two')]);
  await figma.ui.onmessage({kind: 'ready'});
  assert.equal(sent[0].kind, 'refused');
  assert.match(sent[0].text, /no visible content/);
});
