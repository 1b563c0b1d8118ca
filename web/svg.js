// The outline of a drawing, and drawings of outlines. Curves become polylines; paths are read by svgpath.

import svgpath from 'svgpath';
import {moments} from './curve.js';

/** @import {Shape} from './types.d.ts' */

const CURVE_PARTS = 24;  // edges of a polyline for each segment of a path
const LEAST_POINTS = 3;
const NOT_DRAWN = 'defs, clipPath, mask, symbol, marker, pattern';
const DRAWN = 'path, rect, circle, ellipse, polygon, polyline';

/**
 * Return the outline with the largest area of a drawing.
 * @param {string} text of the file
 * @param {string} name of the file
 * @returns {Shape}
 */
export function shapeOf(text, name) {
  const root = new DOMParser().parseFromString(text, 'image/svg+xml').documentElement;
  if (root.nodeName !== 'svg') throw new Error(`${name}: not an SVG drawing`);
  let outline = new Float64Array(0), most = 0;
  for (const element of root.querySelectorAll(DRAWN)) {
    if (element.closest(NOT_DRAWN)) continue;
    for (const ring of ringsOf(pathOf(element), transformsOf(element))) {
      const area = Math.abs(moments(ring).area);
      if (area > most) {
        most = area;
        outline = ring;
      }
    }
  }
  if (!outline.length) throw new Error(`${name}: no shape that encloses an area; convert text and uses to paths`);
  return {name, outline, box: boxOfCanvas(root, outline)};
}

/**
 * @param {Element} root
 * @param {Float64Array} outline
 */
function boxOfCanvas(root, outline) {
  const [x, y, width, height] = (root.getAttribute('viewBox') ?? '').split(/[\s,]+/).map(Number);
  if (width > 0 && height > 0) return [x, y, x + width, y + height];
  const size = ['width', 'height'].map((name) => parseFloat(root.getAttribute(name) ?? ''));
  if (size[0] > 0 && size[1] > 0) return [0, 0, ...size];
  const [xs, ys] = [0, 1].map((axis) => outline.filter((_, k) => k % 2 === axis));
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}

/** @param {Element} element */
function transformsOf(element) {
  const transforms = [];
  for (let at = /** @type {Element | null} */ (element); at; at = at.parentElement) {
    const transform = at.getAttribute('transform');
    if (transform) transforms.unshift(transform);
  }
  return transforms.join(' ');
}

/**
 * Return a basic shape as a path.
 * @param {Element} element
 */
function pathOf(element) {
  const number = (/** @type {string} */ name) => parseFloat(element.getAttribute(name) ?? '0');
  if (element.nodeName === 'path') return element.getAttribute('d') ?? '';
  if (element.nodeName === 'rect') {
    const [x, y, width, height] = ['x', 'y', 'width', 'height'].map(number);
    const rx = Math.min(number('rx') || number('ry'), width / 2), ry = Math.min(number('ry') || rx, height / 2);
    if (!(rx > 0 && ry > 0)) return `M${x} ${y}h${width}v${height}h${-width}z`;
    const [w, h] = [width - 2 * rx, height - 2 * ry], arc = `a${rx} ${ry} 0 0 1`;
    return `M${x + rx} ${y}h${w}${arc} ${rx} ${ry}v${h}${arc} ${-rx} ${ry}h${-w}${arc} ${-rx} ${-ry}v${-h}${arc} ${rx} ${-ry}z`;
  }
  if (element.nodeName === 'circle' || element.nodeName === 'ellipse') {
    const [cx, cy] = [number('cx'), number('cy')], rx = number('rx') || number('r'), ry = number('ry') || number('r');
    return `M${cx - rx} ${cy}a${rx} ${ry} 0 0 1 ${2 * rx} 0a${rx} ${ry} 0 0 1 ${-2 * rx} 0z`;
  }
  return `M${element.getAttribute('points') ?? ''}z`;
}

/**
 * Return the closed polylines of a path.
 * @param {string} path
 * @param {string} transforms
 */
function ringsOf(path, transforms) {
  /** @type {number[][]} */
  const rings = [];
  svgpath(path).transform(transforms).abs().unarc().unshort().iterate((segment, _, x, y) => {
    const [command, ...values] = segment, points = /** @type {number[]} */ (values);
    if (command === 'M') rings.push([...points]);
    const ring = rings[rings.length - 1];
    if (!ring || command === 'M' || command === 'Z') return;
    if (command === 'H') ring.push(points[0], y);
    else if (command === 'V') ring.push(x, points[0]);
    else if (command === 'L') ring.push(...points);
    else ring.push(...curvePoints([x, y, ...points]));
  });
  return rings.map(withoutRepetitions).filter((ring) => ring.length >= 2 * LEAST_POINTS);
}

/**
 * Return points on a Bézier curve, without its first one, by de Casteljau's algorithm.
 * @param {number[]} control
 */
function curvePoints(control) {
  const points = [];
  for (let part = 1; part <= CURVE_PARTS; part++) {
    let left = control;
    while (left.length > 2) left = left.slice(2).map((value, k) => left[k] + part / CURVE_PARTS * (value - left[k]));
    points.push(...left);
  }
  return points;
}

/** @param {number[]} ring */
function withoutRepetitions(ring) {
  const distinct = ring.filter((_, k) => {
    const at = k - k % 2, before = (at + ring.length - 2) % ring.length;
    return Math.hypot(ring[at] - ring[before], ring[at + 1] - ring[before + 1]) > 1e-9;
  });
  return Float64Array.from(distinct);
}

/**
 * Return a drawing of a shape.
 * @param {Shape} shape
 */
export function drawingOf({outline, box: [left, top, right, bottom]}) {
  const points = [];
  for (let k = 0; k < outline.length; k += 2) points.push(`${outline[k].toFixed(3)} ${outline[k + 1].toFixed(3)}`);
  const viewBox = [left, top, right - left, bottom - top].join(' ');
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="${viewBox}">\n  <path d="M${points.join('L')}Z"/>\n</svg>\n`;
}
