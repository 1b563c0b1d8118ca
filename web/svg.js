// The outline of a drawing, and drawings of outlines. Curves become polylines; paths are read by svgpath.

import svgpath from 'svgpath';
import {inside} from '../io/edit/page/geometry.js';
import {boxOf, Curve, moments} from './curve.js';
import {transferrer} from './locate.js';

/** @import {Shape, WholeMap} from './types.d.ts' */

const CURVE_PARTS = 24;  // edges of a polyline for each segment of a path
const LEAST_POINTS = 3;
const NOT_DRAWN = 'defs, clipPath, mask, symbol, marker, pattern';
const DRAWN = 'path, rect, circle, ellipse, polygon, polyline, line';
const NOT_CARRIED = 'text, image, use, foreignObject';
const GEOMETRY = ['d', 'x', 'y', 'width', 'height', 'rx', 'ry', 'cx', 'cy', 'r', 'points', 'x1', 'y1', 'x2', 'y2', 'transform'];
const CARRIED_TOLERANCE = 2e-4;  // relative to the target's diagonal: how far a carried line may be from the image of a curve
const CARRIED_STEP = 0.02;       // relative to the source's diagonal: longest edge of a line before it is carried
const OUTSIDE = 2e-3;            // relative to the source's diagonal: lines may reach this far beyond the outline
const MOST_HALVINGS = 8;         // of an edge of a carried line

/**
 * Return the outline with the largest area of a drawing.
 * @param {string} text of the file
 * @param {string} name of the file
 * @returns {Shape}
 */
export function shapeOf(text, name) {
  const root = new DOMParser().parseFromString(text, 'image/svg+xml').documentElement;
  if (root.nodeName !== 'svg') throw new Error(`${name}: not an SVG drawing`);
  const rings = [...root.querySelectorAll(DRAWN)].filter((element) => !element.closest(NOT_DRAWN))
    .flatMap((element) => linesOf(pathOf(element), transformsOf(element)).map(({points}) => ({element, points: Float64Array.from(points)})))
    .map((ring) => ({...ring, area: ring.points.length >= 2 * LEAST_POINTS ? moments(ring.points).area : 0})).filter(({area}) => area);
  const largest = rings.reduce((best, ring) => (Math.abs(ring.area) > Math.abs(best.area) ? ring : best), rings[0]);
  if (!largest) throw new Error(`${name}: no shape that encloses an area; convert text and uses to paths`);
  return {name, outline: largest.points, box: boxOfCanvas(root, largest.points), drawing: text, left: leftOut(rings, largest)};
}

/** A closed line of an element. @typedef {{element: Element, points: Float64Array, area: number}} Ring */

/**
 * Count the holes of an outline, and the rings outside of it. What other elements paint inside is neither.
 * @param {Ring[]} rings
 * @param {Ring} largest
 */
function leftOut(rings, largest) {
  const curve = new Curve(largest.points), isEvenOdd = Boolean(largest.element.closest('[fill-rule=evenodd], [style*="evenodd"]'));
  let holes = 0, parts = 0;
  for (const {element, points, area} of rings) {
    if (points === largest.points) continue;
    if (!curve.contains(points[0], points[1])) parts++;
    else if (element === largest.element && (isEvenOdd || area * largest.area < 0)) holes++;
  }
  return {holes, parts};
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
  if (element.nodeName === 'line') return `M${number('x1')} ${number('y1')}L${number('x2')} ${number('y2')}`;
  return `M${element.getAttribute('points') ?? ''}${element.nodeName === 'polygon' ? 'z' : ''}`;
}

/**
 * Return the lines of a path, without repeated points, and whether each is closed.
 * @param {string} path
 * @param {string} transforms
 */
function linesOf(path, transforms) {
  /** @type {{points: number[], isClosed: boolean}[]} */
  const lines = [];
  svgpath(path).transform(transforms).abs().unarc().unshort().iterate((segment, _, x, y) => {
    const [command, ...values] = segment, points = /** @type {number[]} */ (values), last = lines[lines.length - 1];
    if (command === 'M') lines.push({points: [...points], isClosed: false});
    if (!last || command === 'M') return;
    if (command === 'Z') last.isClosed = true;
    else if (command === 'H') last.points.push(points[0], y);
    else if (command === 'V') last.points.push(x, points[0]);
    else if (command === 'L') last.points.push(...points);
    else last.points.push(...curvePoints([x, y, ...points]));
  });
  return lines.map(({points, isClosed}) => ({points: withoutRepetitions(points), isClosed})).filter(({points}) => points.length > 2);
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
  return distinct;
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

/**
 * Return the source's drawing carried through a map, with lines instead of curves, and the number of elements that are left
 * out: texts, images, and what reaches beyond the outline.
 * @param {Shape} source
 * @param {Shape} target
 * @param {WholeMap} map
 */
export function carriedDrawing(source, target, map) {
  const root = new DOMParser().parseFromString(source.drawing ?? '', 'image/svg+xml').documentElement, [left, top, right, bottom] = target.box;
  const carry = carrier(source, target, map), outline = Array.from({length: source.outline.length / 2}, (_, k) => [...source.outline.subarray(2 * k, 2 * k + 2)]);
  const curve = new Curve(source.outline), reach = OUTSIDE * curve.diagonal;
  const [own, goal] = [source, target].map((shape) => Math.abs(moments(shape.outline).area));
  let dropped = 0;
  for (const element of root.querySelectorAll(NOT_CARRIED)) {
    if (!element.closest(NOT_DRAWN)) dropped++;
    element.remove();
  }
  for (const element of [...root.querySelectorAll(DRAWN)]) {
    if (element.closest(NOT_DRAWN)) continue;
    const transforms = transformsOf(element), lines = linesOf(pathOf(element), transforms);
    const isWithin = lines.every(({points}) => points.every((x, k) => k % 2 || inside(outline, [x, points[k + 1]]) || curve.distance(x, points[k + 1]) <= reach));
    if (!lines.length || !isWithin) {
      element.remove();
      dropped++;
      continue;
    }
    const path = document.createElementNS(root.namespaceURI, 'path');
    for (const {name, value} of element.attributes) if (!GEOMETRY.includes(name)) path.setAttribute(name, value);
    path.setAttribute('d', lines.map(({points, isClosed}) => `M${carry(points, isClosed).map((value) => value.toFixed(3)).join(' ')}${isClosed ? 'Z' : ''}`).join(''));
    scaleStroke(path, Math.sqrt(goal / own));
    element.replaceWith(path);
  }
  for (const group of root.querySelectorAll('g, a, svg')) group.removeAttribute('transform');
  root.setAttribute('viewBox', [left, top, right - left, bottom - top].join(' '));
  root.removeAttribute('width');
  root.removeAttribute('height');
  return {text: `${new XMLSerializer().serializeToString(root)}\n`, left: dropped};
}

/**
 * Scale the width of an element's stroke as the map scales areas.
 * @param {Element} element
 * @param {number} scale
 */
function scaleStroke(element, scale) {
  const width = element.getAttribute('stroke-width');
  if (width && parseFloat(width)) element.setAttribute('stroke-width', String(Number((scale * parseFloat(width)).toPrecision(4))));
}

/**
 * Return a function that carries lines, with as many points as their images need.
 * @param {Shape} source
 * @param {Shape} target
 * @param {WholeMap} map
 */
function carrier(source, target, {source: z, image: u, faces}) {
  const up = (/** @type {Float64Array} */ points) => points.map((value, k) => (k % 2 ? -value : value));
  const at = transferrer(z, faces, u), imageOf = (/** @type {number[]} */ points) => up(at(up(Float64Array.from(points))));
  const [left, bottom, right, top] = boxOf(target.outline), most = CARRIED_TOLERANCE * Math.hypot(right - left, top - bottom);
  const step = CARRIED_STEP * new Curve(source.outline).diagonal;
  /**
   * @param {number[]} a
   * @param {number[]} b
   * @param {number} halvings
   * @returns {number[]} images of points after a, up to b
   */
  const between = (a, b, halvings) => {
    const middle = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], image = imageOf([...a, ...middle, ...b]);
    const away = Math.hypot(image[2] - (image[0] + image[4]) / 2, image[3] - (image[1] + image[5]) / 2);
    const isShort = Math.hypot(b[0] - a[0], b[1] - a[1]) <= step;
    if (halvings === MOST_HALVINGS || (isShort && away <= most)) return [image[4], image[5]];
    return [...between(a, middle, halvings + 1), ...between(middle, b, halvings + 1)];
  };
  return (/** @type {number[]} */ points, /** @type {boolean} */ isClosed) => {
    const line = [...imageOf(points.slice(0, 2))], count = points.length / 2;
    for (let k = 0; k < (isClosed ? count : count - 1); k++) {
      const n = (k + 1) % count;
      line.push(...between(points.slice(2 * k, 2 * k + 2), points.slice(2 * n, 2 * n + 2), 0));
    }
    return isClosed ? line.slice(0, -2) : line;
  };
}
