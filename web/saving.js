// Results as files: pictures, drawings, STMaps, maps and pins.

import {archived} from './archive.js';
import {MOST_TOLERANCES, TOLERANCE_SHARE} from './constants.js';
import {moments, toUnit, unitCurve} from './curve.js';
import {radiiOf} from './pins.js';
import {carriedDrawing, drawingOf} from './svg.js';
import {exrOf, stmapOf} from './stmap.js';

/** @import {Pin} from '../io/edit/page/types.d.ts' */
/** @import {Member} from './archive.js' */
/** @import {Shape, WholeMap} from './types.d.ts' */

const MAP_FORMAT = 'iccm.map/1';  // see docs/reference/map-file.md
const NEAR = 1e-3;                // relative to the diagonal: points this far outside belong to the outline
const RING_ARRAYS = [
  'source_rings', 'target_rings', 'stroke_sources', 'stroke_targets', 'source_holes', 'target_holes', 'passed_source_holes', 'passed_target_holes', 'filled',
  'rigid', 'source_drawing', 'target_drawing',
];

/**
 * @typedef {object} Result
 * @property {Shape} source
 * @property {Shape} target
 * @property {WholeMap | null} map
 * @property {Pin[]} pins
 * @property {number} balance
 * @property {number} width of pictures, in pixels
 * @property {number} height
 * @property {() => string} picture returns the picture as an address
 */

/**
 * Return a result as a file, and what the user should know about it.
 * @param {string} format
 * @param {Result} result
 * @returns {Promise<{blob: Blob, note?: string}>}
 */
export async function saved(format, {source, target, map, pins, balance, width, height, picture}) {
  if (format === 'target') return {blob: new Blob([drawingOf(target)], {type: 'image/svg+xml'})};
  if (format === 'json') return {blob: new Blob([constraintsOf(pins)], {type: 'application/json'})};
  if (!map) throw new Error('There is no map yet.');
  if (format === 'png') return {blob: await (await fetch(picture())).blob()};
  if (format === 'npz') return {blob: new Blob([archived(membersOf(map, source, target, pins, balance))])};
  if (format === 'exr') return {blob: new Blob([exrOf(stmapOf(map, source, target, width, height), width, height)])};
  const {text, left} = carriedDrawing(source, target, map);
  const note = left ? `${left} of the drawing's elements are not in the file: they are texts or images, or reach beyond the outline that is mapped.` : '';
  return {blob: new Blob([text], {type: 'image/svg+xml'}), note};
}

/**
 * Return pins as a file for --constraints.
 * @param {Pin[]} pins
 */
export const constraintsOf = (pins) => `${JSON.stringify({pins: pins.map(({source, target}) => ({source, target}))}, null, 2)}\n`;

/**
 * Return the arrays of a saved map.
 * @param {WholeMap} map
 * @param {Shape} source
 * @param {Shape} target
 * @param {Pin[]} pins
 * @param {number} balance
 * @returns {Record<string, Member>}
 */
function membersOf({source: z, image: u, faces, border, energy}, source, target, pins, balance) {
  const complex = (/** @type {ArrayLike<number>} */ values) => /** @type {Member} */ ({type: 'complex128', shape: [values.length / 2], values});
  const ints = (/** @type {ArrayLike<number>} */ values, columns = 0) =>
    /** @type {Member} */ ({type: 'int32', shape: columns ? [values.length / columns, columns] : [values.length], values});
  const text = (/** @type {string} */ values) => /** @type {Member} */ ({type: 'text', shape: [], values});
  const box = (/** @type {Shape} */ {box: [left, top, right, bottom]}) => complex([left, -bottom, right, -top]);  // y up
  const down = /** @type {Member} */ ({type: 'int32', shape: [], values: [-1]}), {sides, count} = edgesOf(faces);
  const points = pins.flatMap((pin) => [pin.source, pin.target].flatMap((place) => [Number(place[0]), -Number(place[1])]));
  const outline = (/** @type {Float64Array} */ w) => complex(w.subarray(0, 2 * border));
  const tolerance = TOLERANCE_SHARE * Math.sqrt(Math.abs(moments(target.outline).area)), free = pins.map(() => null);
  const softness = {radii: radiiFor(pins, source, target), tolerances: pins.map(() => tolerance), rotations: free, scales: free, limits: pins.map(() => MOST_TOLERANCES * tolerance)};
  const about = {
    ended: 'REACHED', notes: [], energies: [{total: energy}], names: [source.name, target.name], job: {fit: 'whole', balance}, ...pins.length ? {softness} : {},
  };
  /** @type {Record<string, Member>} */
  const members = {
    format: text(MAP_FORMAT), about: text(JSON.stringify(about)), vertices: complex(z), images: complex(u), faces: ints(faces, 3), sides: ints(sides, 3),
    bulges: complex(new Float64Array(2 * count)), loops: ints(Int32Array.from({length: border}, (_, k) => k)), loops_ends: ints([border]),
    near: {type: 'float64', shape: [], values: [NEAR]}, source: outline(z), source_box: box(source), source_y: down, target: outline(u), target_box: box(target),
    target_y: down, pins: {type: 'complex128', shape: [pins.length, 2], values: points}, hole_partners: ints([], 2),
  };
  for (const name of RING_ARRAYS) {
    members[name] = complex([]);
    members[`${name}_ends`] = ints([]);
  }
  return members;
}

/**
 * Return the radii of the patches of pins, in the source's drawing.
 * @param {Pin[]} pins
 * @param {Shape} source
 * @param {Shape} target
 */
function radiiFor(pins, source, target) {
  const [own, goal] = [source, target].map(({outline}) => unitCurve(outline.slice()));
  const places = (/** @type {'source' | 'target'} */ side) => Float64Array.from(pins.flatMap((pin) => [Number(pin[side][0]), Number(pin[side][1])]));
  const radii = radiiOf(toUnit(places('source'), own.frame), toUnit(places('target'), goal.frame), [own.curve, goal.curve]);
  return [...radii].map((radius) => radius / own.frame.scale);
}

/**
 * Return the edge opposite to each corner of triangles, numbered by their smaller vertex, then by the larger.
 * @param {Int32Array} faces
 */
function edgesOf(faces) {
  const most = faces.reduce((a, b) => Math.max(a, b), 0) + 1;
  const keys = Array.from(faces, (_, k) => {
    const first = k - k % 3, a = faces[first + (k + 1) % 3], b = faces[first + (k + 2) % 3];
    return Math.min(a, b) * most + Math.max(a, b);
  });
  const number = new Map([...new Set(keys)].sort((a, b) => a - b).map((key, k) => [key, k]));
  return {sides: Int32Array.from(keys, (key) => number.get(key) ?? 0), count: number.size};
}
