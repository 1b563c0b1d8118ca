// The solver in a worker of the page. It takes one request at a time, and answers with the maps that are ready to be shown.

import {FINAL_TRIANGLES, MOST_STIFFENED, NARROW_AIM, STILL_SHARE} from './constants.js';
import {load} from './core.js';
import {boxOf, fromUnit, moments, toUnit, unitCurve} from './curve.js';
import {brush} from './deformation.js';
import {stretches} from './mesh.js';
import {areasOf, Tangled} from './unfold.js';
import {DiscreteMap, weightsOf} from './map.js';
import {Pins} from './pins.js';
import {continued, following, followingTarget, solve, withAllVertices} from './search.js';

/** @import {Curve} from './curve.js' */
/** @import {Answer, Figures, Frame, Request, Stage, Wishes} from './types.d.ts' */

const FLOATS = 18;  // of a triangle: corners in the target, corners in the source, curvature (see io/edit/page/gl.js)

/** Resolves when the core has started. */
let loaded = Promise.resolve();
/**
 * A map that can be continued, in unit coordinates: with factors of the springs of pins that would miss their places.
 * @typedef {{map: DiscreteMap | null, frames: Record<'source' | 'target', Frame>, factors: Float64Array}} Continued
 */
/** @type {Continued} the map that the user sees */
let present = {map: null, frames: {source: {x: 0, y: 0, scale: 1}, target: {x: 0, y: 0, scale: 1}}, factors: new Float64Array(0)};

/**
 * Return points with y in the other direction: down in drawings, up in the solver.
 * @param {Float64Array} z
 */
const turned = (z) => z.map((value, k) => (k % 2 ? -value : value));

/**
 * Return triangles as the painter takes them.
 * @param {DiscreteMap} found
 * @param {Continued['frames']} frames
 */
function floatsOf(found, frames) {
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
  return {energy: found.distortion, within2: within / whole, folds, triangles: stretch.length, missed: [...misses.keys()].filter((k) => misses[k] > 1)};
}

/**
 * Return the weights of a map with the pins of a request.
 * @param {Wishes} wishes
 * @param {[Curve, Curve]} curves of source and target, in unit coordinates
 * @param {Continued} state
 */
function weightsFor({balance, pins}, curves, {frames, factors}) {
  const side = (/** @type {number} */ offset) => turned(pins.filter((_, k) => k % 4 - offset === 0 || k % 4 - offset === 1));
  const own = pins.length ? Pins.of(toUnit(side(0), frames.source), toUnit(side(2), frames.target), curves) : null;
  return weightsOf(balance, own?.stiffer(own.count === factors.length ? factors : new Float64Array(own.count).fill(1)) ?? null);
}

/** Choose the springs' stiffness for the next step, according to how far their pins miss; as in iccm/balanced/interactive.py. */
function stiffen() {
  const {map, factors} = present, misses = map?.weights.pins?.misses(map.mesh) ?? new Float64Array(0);
  present.factors = misses.map((miss, k) => {
    const missed = miss / NARROW_AIM, change = missed > 1 ? missed ** 2 : missed, factor = factors.length === misses.length ? factors[k] : 1;
    return Math.max(factor * Math.min(Math.max(change, 1 / MOST_STIFFENED), MOST_STIFFENED), 1);
  });
}

/**
 * Return whether a map looks like the one before a step.
 * @param {DiscreteMap} before
 * @param {DiscreteMap} after with the same vertices
 */
function isStill({mesh: {u}}, {mesh: {u: moved}, target}) {
  const [left, bottom, right, top] = boxOf(target.curve.z), most = STILL_SHARE * Math.hypot(right - left, top - bottom);
  return u.length === moved.length && u.every((_, k) => k % 2 || Math.hypot(moved[k] - u[k], moved[k + 1] - u[k + 1]) <= most);
}

/**
 * @param {Request} request
 * @param {(found: DiscreteMap, stage: Stage, state: Continued, isStill?: boolean) => void} shown
 */
function answer(request, shown) {
  const {map} = present;
  if (request.kind === 'solve') {
    const source = unitCurve(turned(request.source)), target = unitCurve(turned(request.target));
    /** @type {Continued} */
    const state = {map: null, frames: {source: source.frame, target: target.frame}, factors: new Float64Array(0)};
    let whole = /** @type {DiscreteMap | null} */ (null);
    state.map = solve(source.curve, target.curve, weightsFor(request, [source.curve, target.curve], state), FINAL_TRIANGLES, (found, stage) => {
      if (stage === 'full') whole = found;
      else if (!request.quiet) shown(found, stage, state);
    });
    if (!request.quiet) present = state;
    if (whole) shown(whole, request.quiet ? 'other' : 'full', state);
  } else if (request.kind === 'resume') {
    const {frames, factors} = request.state;
    present = {map: DiscreteMap.restored(request.state), frames, factors};
  } else if (map && request.kind === 'finish') {
    const weights = weightsFor(request, [map.source.curve, map.target.curve], present);
    const finished = request.settle ? continued(map, weights) : map.withWeights(weights);
    present.map = finished;
    shown(withAllVertices(finished) ?? finished, 'full', present);
  } else if (map && (request.kind === 'follow' || request.kind === 'drag')) {
    const next = request.kind === 'drag' ? dragged(map, request) : following(map, weightsFor(request, [map.source.curve, map.target.curve], present));
    present.map = next;
    stiffen();
    shown(next, 'live', present, isStill(map, next));
  }
}

/**
 * Return the map onto the target after a drag of its outline, scaled to area one again.
 * @param {DiscreteMap} found
 * @param {Request & {kind: 'drag'}} request
 */
function dragged(found, request) {
  const {centre, by, radius} = request, before = present.frames.target;
  const move = (/** @type {Float64Array} */ u) => turned(brush(turned(fromUnit(u, before)), centre, by, radius));
  const {area} = moments(move(found.target.curve.z)), after = {...before, scale: 1 / Math.sqrt(area)};
  const state = {...present, frames: {...present.frames, target: after}};
  const moved = followingTarget(found, (u) => toUnit(move(u), after), ({source, target}) => weightsFor(request, [source.curve, target.curve], state));
  present = state;
  return moved;
}

/**
 * Return a full map in the coordinates of the drawings.
 * @param {DiscreteMap} found
 * @param {Continued['frames']} frames
 */
function wholeMap({mesh: {z, u, faces}, border, energy}, frames) {
  return {source: fromUnit(z, frames.source), image: fromUnit(u, frames.target), faces, border, energy};
}

/**
 * Return plain data from which another worker continues.
 * @param {Continued} state
 */
const stateOf = ({map, frames, factors}) => (map ? {frames, factors, ...map.state} : undefined);

addEventListener('message', async (event) => {
  const /** @type {Request} */ request = event.data, {seq} = request, begin = performance.now();
  const send = (/** @type {Answer} */ reply, /** @type {Transferable[]} */ transfer = []) => postMessage(reply, {transfer});
  try {
    if (request.kind === 'load') {
      loaded = load(request.core);
      return;
    }
    await loaded;
    answer(request, (found, stage, state, rests = true) => {
      const floats = floatsOf(found, state.frames), map = stage === 'full' || stage === 'other' ? wholeMap(found, state.frames) : undefined;
      const more = {map, state: stateOf(state), isStill: rests};
      send({seq, stage, floats, figures: figuresOf(found), milliseconds: performance.now() - begin, ...more}, [floats.buffer]);
    });
    send({seq, stage: 'done', milliseconds: performance.now() - begin});
  } catch (error) {
    const message = error instanceof Tangled ? error.message || 'No map without folds was found.' : String(error instanceof Error ? error.message : error);
    send({seq, stage: 'error', message, milliseconds: performance.now() - begin});
  }
});
