// The lasso: the user draws an outline on a photograph, and everything beyond it becomes transparent.

import {button, byId, dialog, followPointer} from './dom.js';
import {simplified} from './geometry.js';

/** @import {Point} from './types.d.ts' */

const SIDE = 720;          // largest side of the picture on the page, in pixels
const TOLERANCE = 1;       // pixels on the page: largest distance of the outline from the drawn line
const MIN_POINTS = 3;      // fewest points of an outline that encloses an area

/** @type {Point[]} the outline, in page pixels */
let outline = [];
const canvas = /** @type {HTMLCanvasElement} */ (byId('lasso-picture'));
const image = new Image();
/** @type {(cut: Blob) => void} */
let take = () => {};

/**
 * Let the user draw an outline on a picture.
 * @param {string} address of the picture
 * @param {(cut: Blob) => void} use called with the picture as PNG, transparent beyond the outline
 */
export async function lasso(address, use) {
  take = use;
  outline = [];
  image.src = address;
  await image.decode();
  const scale = Math.min(1, SIDE / Math.max(image.naturalWidth, image.naturalHeight));
  canvas.width = Math.round(scale * image.naturalWidth);
  canvas.height = Math.round(scale * image.naturalHeight);
  draw();
  dialog('lasso').showModal();
}

/** @param {CanvasRenderingContext2D} context */
function addOutline(context) {
  const [[x0, y0], ...rest] = outline;
  context.moveTo(x0, y0);
  for (const [x, y] of rest) context.lineTo(x, y);
}

/**
 * @param {HTMLCanvasElement} element
 * @returns {CanvasRenderingContext2D}
 */
function contextOf(element) {
  const context = element.getContext('2d');
  if (!context) throw new Error('The browser has no memory for the picture.');
  return context;
}

function draw() {
  const context = contextOf(canvas);
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  button('lasso-use').disabled = outline.length < MIN_POINTS;
  if (outline.length < 2) return;
  context.save();
  context.beginPath();
  context.rect(0, 0, canvas.width, canvas.height);
  addOutline(context);
  context.fillStyle = '#0008';
  context.fill('evenodd');
  context.beginPath();
  addOutline(context);
  context.closePath();
  for (const [style, width] of /** @type {[string, number][]} */ ([['#fff', 3], ['#1f6fb2', 1.5]])) {
    context.strokeStyle = style;
    context.lineWidth = width;
    context.stroke();
  }
  context.restore();
}

/** Return the picture at its own resolution, transparent beyond the outline. @returns {Promise<Blob | null>} */
function cut() {
  const whole = document.createElement('canvas');
  whole.width = image.naturalWidth;
  whole.height = image.naturalHeight;
  const context = contextOf(whole);
  context.save();
  context.scale(whole.width / canvas.width, whole.height / canvas.height);
  context.beginPath();
  addOutline(context);
  context.restore();
  context.clip('evenodd');
  context.drawImage(image, 0, 0);
  return new Promise((give) => whole.toBlob(give, 'image/png'));
}

/** @param {PointerEvent} event */
function place(event) {
  const box = canvas.getBoundingClientRect();
  outline.push([(event.clientX - box.left) * canvas.width / box.width, (event.clientY - box.top) * canvas.height / box.height]);
}

canvas.onpointerdown = (/** @type {PointerEvent} */ event) => {
  outline = [];
  place(event);
  followPointer(canvas, event, (next) => {
    place(next);
    draw();
  }, () => {
    if (outline.length >= MIN_POINTS) outline = simplified(outline, TOLERANCE);
    draw();
  });
};
button('lasso-use').onclick = async () => {
  const picture = await cut();
  dialog('lasso').close();
  if (picture) take(picture);
};
button('lasso-cancel').onclick = () => dialog('lasso').close();
