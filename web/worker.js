// The solver in a worker of the page. It takes one request at a time, and answers with the maps that are ready to be shown.

import {load} from './core.js';
import {fromUnit, moments, toUnit, unitCurve} from './curve.js';
import {brush} from './deformation.js';
import {stretches} from './mesh.js';
import {areasOf, Tangled} from './unfold.js';
import {continued, finished, following, solve} from './search.js';

/** @import {Frame} from './curve.js' */
/** @import {DiscreteMap} from './map.js' */
/** @import {Answer, Figures, Request, Stage} from './types.d.ts' */

const FLOATS = 18;  // of a triangle: corners in the target, corners in the source, curvature (see io/edit/page/gl.js)
const UPRIGHT = 2;  // cost of a rotation, as in the command
const TRIANGLES = 6000;  // of the final mesh, as in the command

/** Resolves when the core has started. */
let loaded = Promise.resolve();
/** @type {DiscreteMap | null} the last map, in unit coordinates */
let map = null;
/** @type {Record<'source' | 'target', Frame>} */
const frames = {source: {x: 0, y: 0, scale: 1}, target: {x: 0, y: 0, scale: 1}};

/**
 * Return points with y in the other direction: down in drawings, up in the solver.
 * @param {Float64Array} z
 */
const turned = (z) => z.map((value, k) => (k % 2 ? -value : value));

/**
 * Return triangles as the painter takes them.
 * @param {DiscreteMap} found
 */
function floatsOf(found) {
  const {z, u, faces} = found.mesh, floats = new Float32Array(FLOATS * faces.length / 3);
  const places = [turned(fromUnit(u, frames.target)), turned(fromUnit(z, frames.source))];
  faces.forEach((vertex, k) => {
    const at = FLOATS * Math.floor(k / 3) + 2 * (k % 3);
    places.forEach((place, side) => floats.set(place.subarray(2 * vertex, 2 * vertex + 2), at + 6 * side));
  });
  return floats;
}

/**
 * @param {DiscreteMap} found
 * @returns {Figures}
 */
function figuresOf(found) {
  const {z, u, faces} = found.mesh, {stretch} = stretches(z, u, faces), areas = areasOf(z, faces), images = areasOf(u, faces);
  let within = 0, whole = 0, folds = 0;
  stretch.forEach((value, t) => {
    const area = areas[t] + images[t];
    whole += area;
    if (value <= 2) within += area;
    if (!(areas[t] > 0 && images[t] > 0)) folds++;
  });
  return {energy: found.energy, within2: within / whole, folds, triangles: stretch.length};
}

/**
 * @param {Request} request
 * @param {(found: DiscreteMap, stage: Stage) => void} shown
 */
function answer(request, shown) {
  if (request.kind === 'solve') {
    const weights = {theta: request.balance, upright: UPRIGHT};
    const source = unitCurve(turned(request.source)), target = unitCurve(turned(request.target));
    Object.assign(frames, {source: source.frame, target: target.frame});
    map = solve(source.curve, target.curve, weights, TRIANGLES, shown);
  } else if (request.kind === 'balance') {
    if (!map) return;
    map = continued(map, {theta: request.balance, upright: UPRIGHT});
    shown(map, 'dragged');
    shown(finished(map), 'full');
  } else if (request.kind === 'drag') {
    if (!map) return;
    map = dragged(map, request.centre, request.by, request.radius);
    shown(map, 'dragged');
  }
}

/**
 * Return the map onto the target after a drag of its outline, scaled to area one again.
 * @param {DiscreteMap} found
 * @param {number[]} centre of the brush, in the drawing
 * @param {number[]} by
 * @param {number} radius
 */
function dragged(found, centre, by, radius) {
  const before = frames.target, move = (/** @type {Float64Array} */ u) => turned(brush(turned(fromUnit(u, before)), centre, by, radius));
  const {area} = moments(move(found.target.curve.z)), after = {...before, scale: 1 / Math.sqrt(area)};
  const moved = following(found, (u) => toUnit(move(u), after));
  frames.target = after;
  return moved;
}

addEventListener('message', async (event) => {
  const /** @type {Request} */ request = event.data, {seq} = request, begin = performance.now();
  const send = (/** @type {Answer} */ reply, /** @type {Transferable[]} */ transfer = []) => postMessage(reply, {transfer});
  try {
    if (request.kind === 'load') {
      loaded = load(request.core);
      return;
    }
    await loaded;
    answer(request, (found, stage) => {
      const floats = floatsOf(found);
      send({seq, stage, floats, figures: figuresOf(found), milliseconds: performance.now() - begin}, [floats.buffer]);
    });
    send({seq, stage: 'done', milliseconds: performance.now() - begin});
  } catch (error) {
    const message = error instanceof Tangled ? error.message || 'No map without folds was found.' : String(error instanceof Error ? error.message : error);
    send({seq, stage: 'error', message, milliseconds: performance.now() - begin});
  }
});

