// The solver in a worker of the page. It takes one request at a time, and answers with the maps that are ready to be shown.

import {load} from './core.js';
import {fromUnit, moments, toUnit, unitCurve} from './curve.js';
import {brush} from './deformation.js';
import {stretches} from './mesh.js';
import {areasOf, Tangled} from './unfold.js';
import {DiscreteMap, weightsOf} from './map.js';
import {Pins} from './pins.js';
import {following, followingTarget, solve} from './search.js';

/** @import {Curve} from './curve.js' */
/** @import {Answer, Figures, Frame, Request, Stage, Wishes} from './types.d.ts' */

const FLOATS = 18;  // of a triangle: corners in the target, corners in the source, curvature (see io/edit/page/gl.js)
const TRIANGLES = 6000;  // of the final mesh, as in the command
const NARROW_AIM = 0.99;  // distance of pins aimed at while they are dragged, relative to that up to which they count as met
const MOST_STIFFENED = 10;  // largest factor by which a step changes the stiffness of a spring

/** Resolves when the core has started. */
let loaded = Promise.resolve();
/** @type {DiscreteMap | null} the last map, in unit coordinates */
let map = null;
/** Factors of the springs of pins that would miss their places. */
let factors = new Float64Array(0);
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
  const misses = found.weights.pins?.misses(found.mesh) ?? new Float64Array(0);
  return {energy: found.energy, within2: within / whole, folds, triangles: stretch.length, missed: [...misses.keys()].filter((k) => misses[k] > 1)};
}

/**
 * Return the weights of a map with the pins of a request.
 * @param {Wishes} wishes
 * @param {[Curve, Curve]} curves of source and target, in unit coordinates
 */
function weightsFor({balance, pins}, curves) {
  const side = (/** @type {number} */ offset) => turned(pins.filter((_, k) => k % 4 - offset === 0 || k % 4 - offset === 1));
  const own = pins.length ? Pins.of(toUnit(side(0), frames.source), toUnit(side(2), frames.target), curves) : null;
  return weightsOf(balance, own?.stiffer(springFactors(own.count)) ?? null);
}

/**
 * Return factors by which the springs of pins are stiffer; 1 after the number of pins has changed.
 * @param {number} count
 */
function springFactors(count) {
  if (factors.length !== count) factors = new Float64Array(count).fill(1);
  return factors;
}

/** Choose the springs' stiffness for the next step, according to how far their pins miss; as in iccm/balanced/interactive.py. */
function stiffen() {
  const misses = map?.weights.pins?.misses(map.mesh);
  if (!misses) return;
  factors = factors.map((factor, k) => {
    const missed = misses[k] / NARROW_AIM, change = missed > 1 ? missed ** 2 : missed;
    return Math.max(factor * Math.min(Math.max(change, 1 / MOST_STIFFENED), MOST_STIFFENED), 1);
  });
}

/**
 * @param {Request} request
 * @param {(found: DiscreteMap, stage: Stage) => void} shown
 */
function answer(request, shown) {
  if (request.kind === 'solve') {
    const source = unitCurve(turned(request.source)), target = unitCurve(turned(request.target));
    Object.assign(frames, {source: source.frame, target: target.frame});
    factors = new Float64Array(0);
    map = solve(source.curve, target.curve, weightsFor(request, [source.curve, target.curve]), TRIANGLES, (found, stage) => {
      if (stage === 'full' || !request.quiet) shown(found, stage);
    });
  } else if (request.kind === 'resume') {
    Object.assign(frames, request.state.frames);
    map = DiscreteMap.restored(request.state);
  } else if (map && (request.kind === 'follow' || request.kind === 'drag')) {
    map = request.kind === 'drag' ? dragged(map, request) : following(map, weightsFor(request, [map.source.curve, map.target.curve]));
    stiffen();
    shown(map, 'live');
  }
}

/**
 * Return the map onto the target after a drag of its outline, scaled to area one again.
 * @param {DiscreteMap} found
 * @param {Request & {kind: 'drag'}} request
 */
function dragged(found, request) {
  const {centre, by, radius} = request, before = frames.target;
  const move = (/** @type {Float64Array} */ u) => turned(brush(turned(fromUnit(u, before)), centre, by, radius));
  const {area} = moments(move(found.target.curve.z)), after = {...before, scale: 1 / Math.sqrt(area)};
  try {
    return followingTarget(found, (u) => toUnit(move(u), after), (moved) => {
      frames.target = after;
      return weightsFor(request, [moved.source.curve, moved.target.curve]);
    });
  } catch (error) {
    frames.target = before;
    throw error;
  }
}

/**
 * Return a full map in the coordinates of the drawings.
 * @param {DiscreteMap} found
 */
function wholeMap({mesh: {z, u, faces}, border, energy, weights: {pins}}) {
  const radii = [...pins?.given.radii ?? []].map((radius) => radius / frames.source.scale);
  return {source: fromUnit(z, frames.source), image: fromUnit(u, frames.target), faces, border, energy, radii};
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
      const floats = floatsOf(found), more = stage === 'full' ? {map: wholeMap(found)} : stage === 'live' ? {state: {frames, ...found.state}} : {};
      send({seq, stage, floats, figures: figuresOf(found), milliseconds: performance.now() - begin, ...more}, [floats.buffer]);
    });
    send({seq, stage: 'done', milliseconds: performance.now() - begin});
  } catch (error) {
    const message = error instanceof Tangled ? error.message || 'No map without folds was found.' : String(error instanceof Error ? error.message : error);
    send({seq, stage: 'error', message, milliseconds: performance.now() - begin});
  }
});
