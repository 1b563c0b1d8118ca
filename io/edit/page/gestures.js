// Gestures on the shape: zoom, pan, rotate a mesh, draw a stroke, click to place a pin.

import {followPointer} from './dom.js';
import {clipped, distance, simplified} from './geometry.js';
import {ARROWS, CLICK_REACH} from './handles.js';

/** @import {Pane} from './pane.js' */
/** @import {Point} from './types.d.ts' */

const KEY_PAN = 40;              // pixels by which an arrow key moves the view
const WHEEL_BY_LINE = 0.05;      // logarithm of the zoom per line of scrolling
const WHEEL_BY_PIXEL = 0.0015;   // the same per pixel
const MIN_STROKE_LENGTH = 16;    // pixels: shorter strokes are accidental
const MAX_GAP = 16;              // pixels between the ends of a stroke that is considered closed
const MAX_GAP_SHARE = 0.25;      // the same, relative to its length
export const STROKE_TOLERANCE = 2;  // pixels: how far a drawn line may be from its simplified form

/**
 * @param {HTMLElement} element
 * @param {Pane} pane
 */
export function listen(element, pane) {
  element.addEventListener('wheel', (event) => {
    if (pane.scrolls && !event.ctrlKey) return;
    event.preventDefault();
    pane.zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? WHEEL_BY_LINE : WHEEL_BY_PIXEL)), pane.pixelOf(event));
  }, {passive: false});
  element.addEventListener('keydown', (event) => {
    const direction = ARROWS[event.key];
    if (!direction || event.target !== element || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    pane.move(KEY_PAN * direction[0], KEY_PAN * direction[1], !pane.surface || event.shiftKey);
  });
  element.addEventListener('pointerdown', (event) => press(event, element, pane));
  listenToFingers(element, pane);
}

/**
 * @param {PointerEvent} event
 * @param {HTMLElement} element
 * @param {Pane} pane
 */
function press(event, element, pane) {
  if (event.button > 1 || pane.pinched) return;
  const start = pane.pixelOf(event), pan = !pane.surface || event.shiftKey || event.button === 1;
  // the page, not the view
  const isMain = event.button === 0, scrolls = event.pointerType === 'touch' && !pane.surface;
  let moved = false, last = start;
  const draw = (/** @type {Point} */ pixel) => {
    const point = pane.surface ? pane.hit(pixel) : pane.at(pixel);
    if (point) pane.drawing?.push(point);
  };
  if (pane.tool === 'stroke' && isMain) pane.drawing = [];
  draw(start);
  followPointer(element, event, (next) => {
    if (pane.pinched) return;
    const now = pane.pixelOf(next);
    moved ||= distance(now, start) > CLICK_REACH;
    if (pane.drawing) draw(now);
    else if (moved && pane.tool === 'select' && isMain) pane.marquee = [start, now];
    else if (moved && !scrolls) pane.move(now[0] - last[0], now[1] - last[1], pan);
    last = now;
    pane.redraw(!pane.marquee);
  }, (end) => {
    if (pane.drawing) pane.drawn();
    else if (pane.marquee) pane.selected();
    else if (!moved && isMain && end.type === 'pointerup' && !pane.pinched) pane.click(start);
  });
}

/**
 * Zoom and pan with two fingers. One finger is left to the browser: it scrolls the page, or clicks.
 * @param {HTMLElement} element
 * @param {Pane} pane
 */
function listenToFingers(element, pane) {
  /** @type {Point[] | null} */
  let before = null;
  const read = (/** @type {TouchEvent} */ event) => {
    const touches = [...event.targetTouches], box = element.getBoundingClientRect();
    const isPinch = event.touches.length === 2 && touches.length === 2;
    return isPinch ? touches.map(({clientX, clientY}) => [clientX - box.left, clientY - box.top]) : null;
  };
  element.addEventListener('touchstart', (event) => {
    before = read(event);
    if (!before) return;
    event.preventDefault();  // else the browser scrolls with both fingers
    pane.pinched = true;
    pane.drawing = null;
    pane.marquee = null;
  }, {passive: false});
  element.addEventListener('touchmove', (event) => {
    const now = read(event);
    if (!before || !now) return;
    event.preventDefault();
    const [from, to] = [before, now].map(([a, b]) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]);
    pane.move(to[0] - from[0], to[1] - from[1]);
    pane.zoomBy(distance(now[0], now[1]) / Math.max(1, distance(before[0], before[1])), to);
    before = now;
  }, {passive: false});
  for (const end of /** @type {const} */ (['touchend', 'touchcancel'])) {
    element.addEventListener(end, (event) => {
      before = read(event);
      if (event.touches.length === 0) pane.pinched = false;
    });
  }
}

/**
 * Convert a drawn line to a stroke: clipped to the outline, with few points; null if it is too short.
 * @param {Point[]} drawn
 * @param {Point[] | null} outline null for lines on a mesh, which lie on it and are never closed
 * @param {number} zoom pixels per unit
 * @returns {{line: Point[], closed: boolean} | null}
 */
export function strokeOf(drawn, outline, zoom) {
  const whole = outline ? clipped(outline, drawn) : drawn;
  if (whole.length < 2) return null;
  const line = simplified(whole, STROKE_TOLERANCE / zoom);
  let length = 0;
  for (let k = 1; k < line.length; k++) length += distance(line[k], line[k - 1]);
  length *= zoom;
  if (length <= MIN_STROKE_LENGTH) return null;
  const gap = distance(line[0], line[line.length - 1]) * zoom;
  const closed = outline !== null && line.length > 3 && gap < Math.min(MAX_GAP, MAX_GAP_SHARE * length);
  return {line: closed ? line.slice(0, -1) : line, closed};
}
