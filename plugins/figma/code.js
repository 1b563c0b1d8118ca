// The part of the plug-in that Figma runs: it sends the selected layers to the window (web/figma.js), and places the result
// over the target.

/* global figma, __html__ -- of Figma */

const WINDOW = {width: 760, height: 720, themeColors: true};
const PICTURE_SIDE = 1024;  // pixels of the longer side of a layer that is filled by a picture
const SELECT = 'Select two layers: the source, and the shape into which it is to go.';

/** The two selected layers, source first; null if there are not two. */
let layers = null;
let isSwapped = false;

/** Whether a layer is filled by a picture. */
const hasPicture = (node) =>
  'fills' in node && Array.isArray(node.fills) && node.fills.some((fill) => fill.type === 'IMAGE' && fill.visible !== false);

/** Return what the window needs of a layer. */
async function exported(node) {
  const svg = await node.exportAsync({format: 'SVG_STRING'}), longer = node.width < node.height ? 'HEIGHT' : 'WIDTH';
  const png = hasPicture(node) ? await node.exportAsync({format: 'PNG', constraint: {type: longer, value: PICTURE_SIDE}}) : null;
  return {name: node.name, svg, png};
}

/** Send the selected layers to the window. */
async function send() {
  const {selection} = figma.currentPage;
  layers = null;
  if (selection.length !== 2) {
    figma.ui.postMessage({kind: 'refused', text: SELECT});
    return;
  }
  const [source, target] = isSwapped ? [selection[1], selection[0]] : selection;
  try {
    figma.ui.postMessage({kind: 'layers', source: await exported(source), target: await exported(target)});
    layers = {source, target};
  } catch (error) {
    figma.ui.postMessage({kind: 'refused', text: `Figma cannot export these layers: ${error.message || error}`});
  }
}

/** Place a new layer over the target, on its page, and select it. */
function place(node, target) {
  const box = target.absoluteRenderBounds || target.absoluteBoundingBox;
  figma.currentPage.appendChild(node);
  node.name = `${layers.source.name} in ${target.name}`;
  node.x = box.x;
  node.y = box.y;
  node.resize(box.width, box.height);
}

figma.showUI(__html__, WINDOW);
figma.on('selectionchange', send);
figma.ui.onmessage = async (message) => {
  if (message.kind === 'ready') {
    await send();
  } else if (message.kind === 'swap') {
    isSwapped = !isSwapped;
    await send();
  } else if (layers && message.kind === 'drawing') {
    place(figma.createNodeFromSvg(message.svg), layers.target);
  } else if (layers && message.kind === 'picture') {
    const node = figma.createRectangle();
    node.fills = [{type: 'IMAGE', scaleMode: 'FILL', imageHash: figma.createImage(message.png).hash}];
    place(node, layers.target);
  }
};
