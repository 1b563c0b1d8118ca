// A map on a mesh that Newton's method moves, and one level of the search; as in
// iccm/balanced/model/discrete_map.py and iccm/balanced/search/levels.py, without exact pins, holes and surfaces.

import {
  BADLY_STRETCHED, BOTH_AREAS, EASED, EASING_STEPS, FORWARD, GOOD_ENOUGH, HELD, MOST_PAIRS, OUTLINE_WEIGHT, PATIENT_STEPS, SETTLED, SLIDING,
  SMOOTHED_RINGS, SMOOTHINGS, SPACING_MESH_SIZES, UNTANGLE_STEPS, UPRIGHT,
} from './constants.js';
import {declare} from './core.js';
import {Curve, lastUpTo, modulo, reals} from './curve.js';
import {energyOf, geometry, restOf, System} from './energy.js';
import {patternOf} from './linear.js';
import {transfer} from './locate.js';
import {even, finerAtPins, graded, stretches, triangulate} from './mesh.js';
import {boundaryPairs, limitSlope, Outline} from './pairs.js';
import {termsOf, totalOf} from './pins.js';
import {areasOf, springs, Tangled, unfoldLocally, untangle} from './unfold.js';

/** @import {Pattern} from './linear.js' */
/** @import {Sizes} from './mesh.js' */
/** @import {Match, Pairs} from './pairs.js' */
/** @import {Pins} from './pins.js' */

/** Weights of areas against angles, and of rotations; and the pins. @typedef {{theta: number, upright: number, pins: Pins | null}} Weights */

/**
 * Return the weights of a map. Rotations cost nothing if pins determine them.
 * @param {number} theta
 * @param {Pins | null} pins
 * @returns {Weights}
 */
export const weightsOf = (theta, pins) => ({theta, upright: pins && pins.count > 1 ? 0 : UPRIGHT, pins});

/**
 * Return the weights for the inverse map.
 * @param {Weights} weights
 * @returns {Weights}
 */
export const inverseWeights = (weights) => ({...weights, pins: weights.pins?.inverse() ?? null});


const MOVED_EDGE = 0.02;       // largest edge of an outline that is moved

const neighbours = declare('int64_t iccm_maps_neighbours(const int64_t *faces, int64_t m, int64_t vertices, int64_t *across)');
const flipToLowerEnergy = declare(`int64_t iccm_model_flip_to_lower_energy(
  const Complex *z, const Complex *u, int64_t *faces, int64_t *across, int64_t *stack, int64_t stack_size,
  const bool *fixed, int64_t border, const int64_t *links, int64_t link_count, double theta, double q,
  double share)`);

export class DiscreteMap {
  /** Energy after the last step, with the outline's term and the cost of rotation. */
  value = Infinity;
  /** Whether the last descent converged before its steps were used up. */
  settled = false;

  /**
   * @param {Outline} source
   * @param {Outline} target
   * @param {Pairs} pairs the boundary vertices, which come first
   * @param {Weights} weights
   * @param {{z: Float64Array, u: Float64Array, faces: Int32Array, pattern: Pattern, cores?: number[][]}} mesh with the
   *   vertices of each pin's core that have entries in the pattern
   */
  constructor(source, target, pairs, weights, mesh) {
    this.source = source;
    this.target = target;
    this.pairs = pairs;
    this.weights = weights;
    this.mesh = mesh;
    /** Number of boundary vertices. */
    this.border = pairs.s.length;
  }

  /**
   * Mesh the source for a match of the outlines; images are given on the boundary only.
   * @param {Level} level
   * @param {Match} match
   * @param {Sizes} [sizes]
   */
  static on(level, match, sizes = even(0.5 * level.size ** 2)) {
    const {source, target, size, steepest, weights} = level, spacing = SPACING_MESH_SIZES * size;
    if (Math.max(source.length, target.length) > MOST_PAIRS * spacing) throw new Tangled();
    const pairs = boundaryPairs(source, target, limitSlope(match, steepest), spacing), {pins} = weights;
    const limits = pins ? finerAtPins(sizes, source.curve, pins.points, pins.given.radii) : sizes;
    const {z, faces} = triangulate(source.curve.at(pairs.s), limits), u = new Float64Array(z.length);
    u.set(target.curve.at(pairs.tau));
    return new DiscreteMap(source, target, pairs, weights, {z, u, faces, pattern: patternOf(faces, followingOn(pairs.s.length), z.length / 2)});
  }

  get match() {
    const {s, tau} = this.pairs;
    return {s: [...s, s[0] + this.source.length], tau: [...tau, tau[0] + this.target.length]};
  }

  /** Mean rotation of the picture in radians. */
  get turn() {
    const {z, u, faces} = this.mesh, {gradients, areas} = geometry(z, faces);
    let x = 0, y = 0;
    faces.forEach((vertex, k) => {
      const area = areas[Math.floor(k / 3)];
      x += area * (gradients[2 * k] * u[2 * vertex] - gradients[2 * k + 1] * u[2 * vertex + 1]);
      y += area * (gradients[2 * k] * u[2 * vertex + 1] + gradients[2 * k + 1] * u[2 * vertex]);
    });
    return Math.atan2(y, x);
  }

  /** Energy of the distortion alone, at q = 1. */
  get distortion() {
    const {z, u, faces} = this.mesh;
    return energyOf(z, u, faces, this.weights.theta);
  }

  /** Energy at q = 1 with the springs of pins, without the outline's term and the cost of rotation. */
  get energy() {
    const {pins} = this.weights;
    return this.distortion + (pins ? totalOf(pins.springs(this.mesh, pins.cores(this.mesh), 1, true), this.mesh.u) : 0);
  }

  /** Return the inverse map. */
  swapSides() {
    const {s, tau, atSource, atTarget} = this.pairs, {z, u} = this.mesh;
    const pairs = {s: tau, tau: s, atSource: atTarget, atTarget: atSource};
    return new DiscreteMap(this.target, this.source, pairs, inverseWeights(this.weights), {...this.mesh, z: u, u: z});
  }

  /** Return plain data from which `restored` makes the same map. */
  get state() {
    const outline = (/** @type {Outline} */ {curve: {z}, origins, vertices}) => ({z, origins, vertices}), {z, u, faces} = this.mesh;
    return {source: outline(this.source), target: outline(this.target), pairs: this.pairs, mesh: {z, u, faces}, theta: this.weights.theta};
  }

  /**
   * Return a map without its pins.
   * @param {DiscreteMap['state']} state
   */
  static restored({source, target, pairs, mesh: {z, u, faces}, theta}) {
    const outline = (/** @type {{z: Float64Array, origins: Float64Array, vertices: number[]}} */ {z: points, origins, vertices}) =>
      new Outline(new Curve(points), origins, vertices);
    const pattern = patternOf(faces, followingOn(pairs.s.length), z.length / 2);
    return new DiscreteMap(outline(source), outline(target), pairs, weightsOf(theta, null), {z, u, faces, pattern});
  }

  /** @param {Weights} weights */
  withWeights(weights) {
    return new DiscreteMap(this.source, this.target, this.pairs, weights, this.mesh);
  }

  /** @param {Float64Array} u */
  #withImages(u) {
    return new DiscreteMap(this.source, this.target, this.pairs, this.weights, {...this.mesh, u});
  }

  /**
   * Return the map with inner vertices moved so that no triangle is folded.
   * @param {boolean} [harmonic] whether to start from the harmonic map; else vertices near folds are moved first
   * @param {number} [steps]
   */
  unfolded(harmonic = true, steps = UNTANGLE_STEPS) {
    const {z, faces, pattern} = this.mesh, u = this.mesh.u.slice();
    if (!harmonic) {
      try {
        return this.#withImages(unfoldLocally(z, u, faces, this.border));
      } catch (error) {
        if (!(error instanceof Tangled)) throw error;
      }
    }
    const least = untangle(pattern, restOf(pattern, z), u, this.border, {harmonic, steps, polish: 0});
    if (!(least > 0) || areasOf(u, faces).some((area) => !(area > 0))) throw new Tangled();
    return this.#withImages(u);
  }

  /**
   * Make Newton steps on the image.
   * @param {number} q power of the density
   * @param {number} steps
   * @param {number} tolerance
   * @param {{corners?: boolean, inside?: boolean}} [how] whether corners of the target hold their vertices, and
   *   whether only the inside moves
   */
  forward(q, steps, tolerance, {corners = true, inside = false} = {}) {
    const held = this.pairs.atTarget.map((at) => Number(inside || (corners && at)));
    const {moving, tau, mesh, energy, settled} = this.#descend(true, held, q, steps, tolerance);
    const atTarget = corners ? this.pairs.atTarget : new Uint8Array(this.border);
    return this.#moved({...this.pairs, tau, atTarget}, {...mesh, u: moving}, energy, settled);
  }

  /**
   * Make Newton steps on the source with the images fixed.
   * @param {number} q
   * @param {number} steps
   * @param {number} tolerance
   */
  backward(q, steps, tolerance) {
    const {moving, tau, mesh, energy, settled} = this.#descend(false, this.pairs.atSource, q, steps, tolerance);
    return this.#moved({...this.pairs, s: tau}, {...mesh, z: moving}, energy, settled);
  }

  /**
   * @param {Pairs} pairs
   * @param {DiscreteMap['mesh']} mesh
   * @param {number} energy
   * @param {boolean} settled
   */
  #moved(pairs, mesh, energy, settled) {
    const map = new DiscreteMap(this.source, this.target, pairs, this.weights, mesh);
    map.value = energy;
    map.settled = settled;
    return map;
  }

  /**
   * @param {boolean} forward whether the image moves, rather than the source
   * @param {Uint8Array} held boundary vertices that do not move
   * @param {number} q
   * @param {number} steps
   * @param {number} tolerance
   */
  #descend(forward, held, q, steps, tolerance) {
    const mesh = this.#meshWithCores(), {z, u, faces, pattern} = mesh, {s, tau} = this.pairs, {border} = this;
    const moving = (forward ? u : z).slice(), along = (forward ? tau : s).slice(), fixed = forward ? s : tau;
    const [rail, other] = forward ? [this.target, this.source] : [this.source, this.target];
    const laps = new Float64Array(border);
    laps[border - 1] = rail.length;
    const constraints = {
      kinds: Int32Array.from(held, (at) => (at ? HELD : SLIDING)), goals: moving.slice(0, 2 * border),
      rail: {knots: rail.curve.knots, vertices: rail.curve.z, corners: rail.sharp}, following: followingOn(border),
      spans: reals(border, (k) => (k < border - 1 ? fixed[k + 1] : fixed[0] + other.length) - fixed[k]), stiffness: OUTLINE_WEIGHT, laps,
    };
    const {theta, upright, pins} = this.weights, rest = restOf(pattern, forward ? z : u);
    let terms = null;
    if (pins) {
      const multipliers = pins.multipliers(mesh);
      rest.areas = rest.areas.map((area, t) => area * multipliers[t]);
      terms = termsOf(pins.springs(mesh, mesh.cores ?? [], q, forward), pattern, z.length / 2);
    }
    const system = new System(pattern, faces, rest, constraints, upright, terms);
    const {energy, done} = system.descend({theta, q, forward}, moving, along, steps, tolerance);
    return {moving, tau: along, mesh, energy, settled: done < steps};
  }

  /** Return the mesh with entries in the pattern for the cores of pins, which change as vertices move. */
  #meshWithCores() {
    const {mesh, border, weights: {pins}} = this;
    if (!pins) return mesh;
    const cores = pins.coresOnMesh(mesh, mesh.cores ?? null);
    return cores === mesh.cores ? mesh : {...mesh, cores, pattern: patternOf(mesh.faces, followingOn(border), mesh.z.length / 2, cores)};
  }

  /**
   * Alternate Newton steps on the map and on its inverse, so that neither shape's corners are privileged.
   * @param {number} q
   * @param {number} rounds
   * @param {number} backward most steps on the inverse per round
   */
  alternated(q, rounds, backward) {
    /** @type {DiscreteMap} */
    let map = this;
    for (let round = 0, before = Infinity; round < rounds; round++) {
      map = map.forward(q, FORWARD, 0.5 * GOOD_ENOUGH).backward(q, backward, 0.5 * GOOD_ENOUGH);
      if (before - map.value < SETTLED * map.value) break;
      before = map.value;
    }
    return map;
  }

  /** Make a few steps at q = 1 if a triangle is badly stretched. */
  relaxed() {
    const {z, u, faces} = this.mesh;
    if (Math.max(...stretches(z, u, faces).stretch) < BADLY_STRETCHED) return this;
    return this.forward(1, EASING_STEPS, EASED, {inside: true}).forward(1, EASING_STEPS, EASED);
  }

  /**
   * Return the map after a few steps, with its triangulation adapted to it.
   * @param {number} q
   */
  eased(q) {
    return this.#flipped(q).forward(q, EASING_STEPS, EASED).#flipped(q).backward(q, EASING_STEPS, EASED);
  }

  /**
   * Return the map with edges flipped where that lowers the energy of the two adjacent triangles.
   * @param {number} q
   */
  #flipped(q) {
    const {z, u} = this.mesh, faces = this.mesh.faces.slice(), m = faces.length / 3, across = new Int32Array(faces.length);
    const stack = new Int32Array(8 * m), links = followingOn(this.border), {theta} = this.weights;
    neighbours(faces, m, z.length / 2, across);
    stack[0] = m;
    for (let t = 0; t < m; t++) stack[t + 1] = t;
    flipToLowerEnergy(z, u, faces, across, stack, stack.length, new Uint8Array(m), this.border, links, links.length, theta, q, BOTH_AREAS);
    return this.#moved(this.pairs, {z, u, faces, pattern: patternOf(faces, links, z.length / 2)}, this.value, this.settled);
  }

  /**
   * Return the map onto a target that has been moved by a smooth function, which also moves the images.
   * @param {(z: Float64Array) => Float64Array} move of points of the target
   */
  withTargetMoved(move) {
    const outline = this.target.subdivided(MOVED_EDGE), before = outline.curve;  // so that straight edges can bend
    const target = outline.movedTo(move(before.z)), after = target.curve;
    const tau = this.pairs.tau.map((at) => {
      const laps = Math.floor(at / before.length), own = at - laps * before.length, edge = Math.min(lastUpTo(before.knots, own), before.count - 1);
      const share = (own - before.knots[edge]) / (before.knots[edge + 1] - before.knots[edge]);
      return laps * after.length + after.knots[edge] + share * (after.knots[edge + 1] - after.knots[edge]);
    });
    const u = move(this.mesh.u);
    u.set(after.at(tau));
    return new DiscreteMap(this.source, target, {...this.pairs, tau}, this.weights, {...this.mesh, u}).unfolded(false);
  }

  /**
   * Return the map with images u, changed so that boundary vertices are where they belong; their displacement fades
   * within a few rings of triangles.
   * @param {Float64Array} u
   */
  movedToBorder(u) {
    const {z, faces} = this.mesh, n = z.length / 2, {border} = this, weights = springs(geometry(z, faces));
    const near = new Uint8Array(n).fill(1, 0, border);
    for (let ring = 0; ring < SMOOTHED_RINGS; ring++) {
      const before = near.slice();
      for (let t = 0; t < faces.length; t += 3) {
        if (before[faces[t]] || before[faces[t + 1]] || before[faces[t + 2]]) for (let k = t; k < t + 3; k++) near[faces[k]] = 1;
      }
    }
    near.fill(0, 0, border);
    let displacement = new Float64Array(2 * n);
    for (let k = 0; k < 2 * border; k++) displacement[k] = this.mesh.u[k] - u[k];
    for (let sweep = 0; sweep < SMOOTHINGS; sweep++) {
      const sums = new Float64Array(2 * n), totals = new Float64Array(n);
      for (let t = 0; t < faces.length; t += 3) {
        for (let k = 0; k < 3; k++) {
          const i = faces[t + (k + 1) % 3], j = faces[t + (k + 2) % 3], w = weights[t + k];
          totals[i] += w;
          totals[j] += w;
          for (let axis = 0; axis < 2; axis++) {
            sums[2 * i + axis] += w * displacement[2 * j + axis];
            sums[2 * j + axis] += w * displacement[2 * i + axis];
          }
        }
      }
      displacement = displacement.map((value, k) => (near[k >> 1] ? sums[k] / totals[k >> 1] : value));
    }
    return this.#withImages(u.map((value, k) => (k < 2 * border ? this.mesh.u[k] : value + displacement[k])));
  }
}

/**
 * Return the next vertex of each vertex on a closed outline.
 * @param {number} border
 */
export const followingOn = (border) => Int32Array.from({length: border}, (_, k) => modulo(k + 1, border));

/** A problem with outlines of one fineness, and one size of triangles. */
export class Level {
  /**
   * @param {Outline} source
   * @param {Outline} target
   * @param {number} size edge length of the triangles
   * @param {number} steepest largest slope of a match, relative to the mean
   * @param {Weights} weights
   */
  constructor(source, target, size, steepest, weights) {
    this.source = source;
    this.target = target;
    this.size = size;
    this.steepest = steepest;
    this.weights = weights;
  }

  /**
   * @param {[Curve, Curve]} curves
   * @param {number} size
   * @param {{fineness: number, corners: number, steepest: number, smooth?: boolean}} how
   * @param {Weights} weights
   */
  static of([source, target], size, {fineness, corners, steepest, smooth = false}, weights) {
    const spacing = smooth ? SPACING_MESH_SIZES * size : Infinity;
    return new Level(Outline.of(source, fineness, corners, spacing), Outline.of(target, fineness, corners, spacing), size, steepest, weights);
  }

  inverse() {
    return new Level(this.target, this.source, this.size, this.steepest, inverseWeights(this.weights));
  }

  /**
   * Return a map without folds for a match; the inverse is tried if the harmonic map cannot be unfolded.
   * @param {Match} match
   */
  started(match) {
    try {
      return DiscreteMap.on(this, match).unfolded();
    } catch (error) {
      if (!(error instanceof Tangled)) throw error;
    }
    return DiscreteMap.on(this.inverse(), {s: match.tau, tau: match.s}).unfolded().swapSides();
  }

  /**
   * Return a map on a mesh of this level, without folds.
   * @param {DiscreteMap} map
   * @param {Sizes} [sizes]
   */
  refined(map, sizes) {
    const {s, tau} = map.pairs, {z, u, faces} = map.mesh;
    const own = Array.from(s, (at) => this.source.simplifiedFrom(map.source.original(at)));
    const goal = Array.from(tau, (at) => this.target.simplifiedFrom(map.target.original(at)));
    const match = {s: [...own, own[0] + this.source.length], tau: [...goal, goal[0] + this.target.length]};
    const plain = DiscreteMap.on(this, match, sizes), fine = plain.movedToBorder(transfer(z, faces, u, plain.mesh.z));
    for (const unfold of [() => fine.unfolded(false), () => fine.unfolded()]) {
      try {
        return unfold();
      } catch (error) {
        if (!(error instanceof Tangled)) throw error;
      }
    }
    return fine.unfolded(false, PATIENT_STEPS);
  }

  /**
   * Return a map on the mesh of this finer level, with smaller triangles where it magnifies.
   * @param {DiscreteMap} map
   */
  finer(map) {
    const {z, u, faces} = map.mesh;
    return this.refined(map, graded(z, u, faces, 0.5 * this.size ** 2)).relaxed();
  }
}
