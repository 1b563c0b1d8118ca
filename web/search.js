// The search for the balanced map of two outlines, from correspondences to the final mesh; as in
// iccm/balanced/search (multilevel.py, candidates.py, final_mesh.py), without exact pins, holes, partial and symmetric maps.

import {
  AIMED_LIMITS, ALIKE, BACKWARD_STEPS, BLOCKED_ENERGY, BLOCKED_MISS, CLOSE, COARSE_EXACTNESS, COARSE_MESH_SIZE, COARSE_SIZE_BY_LENGTH,
  FINALISTS, FINE_BACKWARD, FINE_EXACTNESS, FINE_MESH_SIZE, FINE_POWER, FINE_ROUNDS, GOOD_ENOUGH, LAST_DECREASE, LAST_DECREASE_WITH_PINS,
  LAST_ROUNDS, LAST_STEPS, MOST_START_VERTICES, MOST_STIFFENED, PROMISING_ENERGY_RATIO, RELEASED_STEPS, RELEASE_GAIN_SHARE, RELEASE_ROUNDS,
  ROUNDS, SCREENING, SETTLING, STEEPEST, STEEPEST_FINE, STIFFENINGS, TRIANGLES_PER_AREA,
} from './constants.js';
import {Curve, take} from './curve.js';
import {inverseWeights, Level} from './map.js';
import {candidates} from './matching.js';
import {graded} from './mesh.js';
import {splitAtVertices} from './split.js';
import {Tangled} from './unfold.js';

/** @import {DiscreteMap, Weights} from './map.js' */
/** @import {Match} from './pairs.js' */

const FINENESS = 2e-4;  // of the given outlines, relative to their diagonals
const COARSE = {fineness: COARSE_EXACTNESS[0], corners: COARSE_EXACTNESS[1], steepest: STEEPEST};
const FINE = {fineness: FINE_EXACTNESS[0], corners: FINE_EXACTNESS[1], steepest: STEEPEST_FINE};
const LAST = {fineness: 0, corners: FINE_EXACTNESS[1], steepest: STEEPEST_FINE, smooth: true};
const LAST_WITH_ALL_CORNERS = {fineness: 0, corners: 0, steepest: STEEPEST_FINE, smooth: false};
const LEAST_COARSE_SHARE = 0.6;
const [ALIKE_ENERGY, ALIKE_TURN] = ALIKE;  // two maps this close converge to the same one
const LIVE_STEPS = 3;  // Newton steps for each movement of a drag, so that the picture follows the pointer

/** @typedef {(map: DiscreteMap, stage: 'coarse' | 'fine' | 'full') => void} Shown called with each map that is ready to be shown */

/**
 * Return the result of a function, or null if there is no map without folds.
 * @template T
 * @param {() => T} compute
 */
function attempt(compute) {
  try {
    return compute();
  } catch (error) {
    if (error instanceof Tangled) return null;
    throw error;
  }
}

/**
 * Return the balanced map of two outlines in unit coordinates, to continue from; the finished map is shown.
 * @param {Curve} source
 * @param {Curve} target
 * @param {Weights} weights
 * @param {number} triangles approximate number of triangles of the final mesh
 * @param {Shown} shown
 */
export function solve(source, target, weights, triangles, shown) {
  const simple = (/** @type {Curve} */ curve) => new Curve(take(curve.z, curve.keptVertices(FINENESS)));
  const given = simple(source), goal = simple(target), inverted = goal.length > given.length;
  // the longer outline is meshed first: triangles that fit its protrusions can be spread over a block
  for (const isInverse of [inverted, !inverted]) {
    /** @type {[Curve, Curve]} */
    const curves = isInverse ? [goal, given] : [given, goal], own = isInverse ? inverseWeights(weights) : weights;
    const show = (/** @type {DiscreteMap} */ map, /** @type {'coarse' | 'fine' | 'full'} */ stage) => shown(isInverse ? map.swapSides() : map, stage);
    const found = attempt(() => {
      const coarse = coarseMap(curves, own);
      show(coarse, 'coarse');
      const fine = attempt(() => Level.of(curves, FINE_MESH_SIZE, FINE, own).finer(coarse).alternated(FINE_POWER, FINE_ROUNDS, FINE_BACKWARD));
      if (!fine) return coarse;
      show(fine, 'fine');
      const last = (/** @type {typeof LAST} */ how) =>
        attempt(() => settled(Level.of(curves, Math.sqrt(TRIANGLES_PER_AREA / triangles), how, own).finer(fine)));
      const smooth = last(LAST);
      if (smooth && withAllVertices(smooth)) return smooth;
      return last(LAST_WITH_ALL_CORNERS) ?? smooth ?? fine;
    });
    if (!found) continue;
    const followed = withPinsMet(found);
    show(finished(followed), 'full');
    return isInverse ? followed.swapSides() : followed;
  }
  throw new Tangled('No map without folds was found: the shapes are too thin or too intricate for this page; the command tries more.');
}

/**
 * Return a map that has converged with a boundary vertex at every vertex of both outlines; without these if they
 * would fold triangles.
 * @param {DiscreteMap} map
 */
const finished = (map) => (withAllVertices(map) ?? map).eased(FINE_POWER);

/**
 * Return a map split at the vertices of both outlines, or null if that would fold triangles.
 * @param {DiscreteMap} map
 */
export const withAllVertices = (map) => attempt(() => splitAtVertices(map)) ?? attempt(() => splitAtVertices(map.swapSides()).swapSides());

/** @param {DiscreteMap} map on the final mesh */
function settled(map) {
  const decrease = map.weights.pins ? LAST_DECREASE_WITH_PINS : LAST_DECREASE;
  for (let round = 0, before = Infinity; round < LAST_ROUNDS; round++) {
    map = map.forward(FINE_POWER, LAST_STEPS, decrease);
    if (before - map.value < decrease * map.value) break;
    before = map.value;
    map = map.forward(FINE_POWER, LAST_STEPS, decrease, {inside: true});
    if (map.settled && before - map.value < decrease * before) break;
  }
  return map;
}

/**
 * Return a converged map with stiffer springs for pins that are beyond their limits, until these are met, or the worst
 * one is blocked by the outline or by other pins.
 * @param {DiscreteMap} map
 */
function withPinsMet(map) {
  const begun = map.value;
  for (let round = 0, before = Infinity; round < STIFFENINGS && map.weights.pins; round++) {
    const {pins} = map.weights, missed = pins.misses(map.mesh), worst = Math.max(...missed);
    if (worst <= 1 || (worst > BLOCKED_MISS * before && map.value > BLOCKED_ENERGY * begun)) break;
    before = worst;
    const factors = missed.map((miss) => Math.min(Math.max((miss / AIMED_LIMITS) ** 2, 1), MOST_STIFFENED));
    map = settled(map.withWeights({...map.weights, pins: pins.stiffer(factors)}));
  }
  return map;
}

/**
 * Return the best map of all starts on coarse meshes.
 * @param {[Curve, Curve]} curves
 * @param {Weights} weights
 */
function coarseMap(curves, weights) {
  const length = Math.max(curves[0].length, curves[1].length);
  const size = COARSE_MESH_SIZE * Math.min(Math.max(COARSE_SIZE_BY_LENGTH / (COARSE_MESH_SIZE * length), LEAST_COARSE_SHARE), 1);
  const level = Level.of(curves, size, COARSE, weights), matches = candidates(level.source.curve, level.target.curve, weights.upright === 0, weights.pins);
  const maps = screened(started(level, matches));
  /** @type {DiscreteMap[]} */
  const different = [];
  for (const map of maps) if (!different.some((other) => areAlike(map, other))) different.push(map);
  const converged = different.flatMap((map) => attempt(() => settledOnNewMesh(level, map, SETTLING)) ?? []);
  if (!converged.length) throw new Tangled();
  converged.sort((a, b) => a.value - b.value);
  const finalists = converged.slice(0, FINALISTS).filter((map) => map.value <= CLOSE * converged[0].value);
  const released = finalists.map((map) => withReleasedCorners(level, map));
  return released.reduce((best, map) => (map.value < best.value ? map : best));
}

/**
 * @param {Level} level
 * @param {Match[]} matches
 */
function started(level, matches) {
  const maps = [];
  let vertices = 0;
  for (const match of matches) {
    if (maps.length && vertices > MOST_START_VERTICES) break;
    const map = attempt(() => level.started(match));
    if (!map) continue;
    maps.push(map);
    vertices += map.mesh.z.length / 2;
  }
  if (!maps.length) throw new Tangled();
  return maps;
}

/** @param {DiscreteMap[]} maps */
function screened(maps) {
  let best = maps;
  for (const [steps, keep] of SCREENING) {
    best = best.map((map) => map.forward(1, steps, GOOD_ENOUGH, {corners: false}));
    best = best.sort((a, b) => a.value - b.value).slice(0, keep);
  }
  return best.filter((map) => map.value <= PROMISING_ENERGY_RATIO * best[0].value);
}

/**
 * @param {DiscreteMap} one
 * @param {DiscreteMap} other
 */
function areAlike(one, other) {
  const turned = one.turn - other.turn;
  return Math.abs(one.value / other.value - 1) < ALIKE_ENERGY && Math.abs(Math.atan2(Math.sin(turned), Math.cos(turned))) < ALIKE_TURN;
}

/**
 * @param {Level} level
 * @param {DiscreteMap} map
 */
function onNewMesh(level, map) {
  const {z, u, faces} = map.mesh;
  return attempt(() => level.started(map.match)) ?? attempt(() => level.refined(map)) ?? level.refined(map, graded(z, u, faces, 0.5 * level.size ** 2));
}

/**
 * @param {Level} level
 * @param {DiscreteMap} map
 * @param {number} rounds
 */
function settledOnNewMesh(level, map, rounds) {
  const found = (attempt(() => onNewMesh(level, map)) ?? map).alternated(1, rounds, BACKWARD_STEPS);
  if (!Number.isFinite(found.value)) throw new Tangled();
  return found;
}

/**
 * Return the best map of a few rounds: release corners, fix them again on a new mesh, converge.
 * @param {Level} level
 * @param {DiscreteMap} given
 */
function withReleasedCorners(level, given) {
  let best = given, map = given;
  for (let round = 0; round < RELEASE_ROUNDS; round++) {
    const released = map.forward(1, RELEASED_STEPS, GOOD_ENOUGH, {corners: false}), fresh = attempt(() => onNewMesh(level, released));
    if (!fresh) break;
    map = fresh.alternated(1, ROUNDS, BACKWARD_STEPS);
    const before = best.value;
    if (map.value < best.value) best = map;
    if (!(best.value < (1 - RELEASE_GAIN_SHARE) * before)) break;
  }
  return best;
}

/**
 * Return the map that a map converges to with other weights.
 * @param {DiscreteMap} map
 * @param {Weights} weights
 */
export const continued = (map, weights) => withPinsMet(settled(map.withWeights(weights)));

/**
 * Return the map onto a target that has been moved by a smooth function, after a few steps.
 * @param {DiscreteMap} map
 * @param {(z: Float64Array) => Float64Array} move
 * @param {(moved: DiscreteMap) => Weights} weights of the map onto the moved target
 */
export function followingTarget(map, move, weights) {
  const moved = map.withTargetMoved(move);
  return following(moved, weights(moved));
}

/**
 * Return the map after a few steps with other weights.
 * @param {DiscreteMap} map
 * @param {Weights} weights
 */
export const following = (map, weights) => map.withWeights(weights).forward(FINE_POWER, LIVE_STEPS, LAST_DECREASE);
