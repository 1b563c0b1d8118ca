// The energy of a balanced map, and Newton's method for it, both in the core; as in iccm/balanced/minimise.

import {BOTH_AREAS, HELD} from './constants.js';
import {declare, Scratch, struct} from './core.js';

/** @import {Pattern} from './linear.js' */
/** @import {Terms} from './pins.js' */

/** @typedef {{theta: number, q: number, epsilon?: number, forward?: boolean}} Objective */
/** @typedef {{corners: Int32Array, slots: Int32Array, gradients: Float64Array, areas: Float64Array}} Rest triangles in the rest shape */
/**
 * Constraints on the first vertices of a mesh.
 * @typedef {object} Constraints
 * @property {Int32Array} kinds
 * @property {Float64Array} goals positions of held vertices
 * @property {{knots: Float64Array, vertices: Float64Array, corners: Float64Array}} rail on which vertices slide
 * @property {Int32Array} following the next vertex on the outline
 * @property {Float64Array} spans arclengths of the edges on the fixed side
 * @property {number} stiffness of the edges
 * @property {Float64Array} laps
 */

const NO_RAIL = {knots: Float64Array.of(0, 1), vertices: Float64Array.of(0, 0), corners: new Float64Array(0)};

const hatGradients = declare(`int64_t iccm_minimise_hat_gradients(
  const int64_t *corners, const Complex *z, Complex *gradients, double *areas, int64_t m)`);
const totalOf = declare('double iccm_minimise_total(const RestShapes *rest, const Complex *u, const Objective *objective)');
const leastDeterminantOf = declare('double iccm_minimise_least_determinant(const RestShapes *rest, const Complex *u)');
const descendOf = declare(`int64_t iccm_minimise_descend(
  System *system, const Objective *objective, Complex *u, double *tau, bool factorised, int64_t steps,
  double tolerance, double reach, double *energy, int64_t *counts)`);
const quadraticStepOf = declare('int64_t iccm_minimise_quadratic_step(System *system, Complex *u, double *tau)');
const objectiveRecord = struct('struct Objective { double theta; double q; double share; double epsilon; bool forward; }');
const restRecord = struct(`struct RestShapes {
  const int64_t *corners; const int64_t *slots; const Complex *gradients; const double *weights;
  const Complex *aims; int64_t m; bool aimed; }`);
const railsRecord = struct(`struct Rails {
  const double *knots; const Complex *vertices; const double *corners; const int64_t *starts;
  const int64_t *own; const double *ends; }`);
const borderRecord = struct(`struct Border {
  const int64_t *following; const double *spans; const double *stiffness; const double *laps; int64_t count; }`);
const constraintsRecord = struct('struct Constraints { const int64_t *kinds; const Complex *goals; Rails rails; Border border; }');
const uprightRecord = struct('struct Upright { const Complex *moments; double weight; }');
const termsRecord = struct('struct Terms { TotalCallback total; DerivativesCallback derivatives; }');
const workspaceRecord = struct(`struct Workspace {
  double *matrix; Factor factor; Complex *gradient; Complex *step; Complex *way; Complex *new_u;
  Complex *turning; Complex *answer; Complex *directions; double *new_tau; double *slope; double *curvature;
  double *slide; double *low; double *high; }`);
const systemRecord = struct(`struct System {
  BlockPattern pattern; const int64_t *faces; int64_t m; RestShapes rest; Constraints constraints;
  Upright upright; Terms terms; Workspace workspace; }`);

/**
 * Return the Wirtinger gradients of the hat functions, and the areas, of triangles.
 * @param {Float64Array} z
 * @param {Int32Array} corners (m, 3)
 */
export function geometry(z, corners) {
  const m = corners.length / 3, gradients = new Float64Array(6 * m), areas = new Float64Array(m);
  hatGradients(corners, z, gradients, areas, m);
  return {gradients, areas};
}

/**
 * @param {Pattern} pattern
 * @param {Float64Array} z
 * @returns {Rest}
 */
export const restOf = ({corners, slots}, z) => ({corners, slots, ...geometry(z, corners)});

/** @param {Rest} rest */
const restStruct = ({corners, slots, gradients, areas}) =>
  restRecord(corners, slots, gradients, areas, new Float64Array(0), corners.length / 3, false);

/** @param {Objective} objective */
const objectiveStruct = ({theta, q, epsilon = 0, forward = true}) => objectiveRecord(theta, q, BOTH_AREAS, epsilon, forward);

/**
 * Return the energy of the map z -> u, both scaled to area one, without pins, the outline's term and the cost of rotation.
 * @param {Float64Array} z
 * @param {Float64Array} u
 * @param {Int32Array} faces
 * @param {number} theta
 */
export function energyOf(z, u, faces, theta) {
  const scaled = (/** @type {Float64Array} */ w) => {
    const scale = Math.sqrt(geometry(w, faces).areas.reduce((sum, area) => sum + area, 0));
    return w.map((value) => value / scale);
  };
  const rest = {corners: faces, slots: new Int32Array(0), ...geometry(scaled(z), faces)};
  return totalOf(restStruct(rest), scaled(u), objectiveStruct({theta, q: 1}));
}

/**
 * @param {Rest} rest
 * @param {Float64Array} u
 */
export const leastDeterminant = (rest, u) => leastDeterminantOf(restStruct(rest), u);

/**
 * Return constraints that hold the first vertices, and let the others move.
 * @param {Float64Array} u
 * @param {number} held number of vertices that are held
 * @returns {Constraints}
 */
export function holding(u, held) {
  const ones = new Float64Array(held).fill(1);
  return {
    kinds: new Int32Array(held).fill(HELD), goals: u.slice(0, 2 * held), rail: NO_RAIL, following: Int32Array.from({length: held}, (_, k) => k),
    spans: ones, stiffness: 0, laps: ones,
  };
}

/** A mesh whose vertices move. */
export class System {
  /** Hessian and gradient, for `quadraticStep`. */
  matrix;
  gradient;
  #parts;

  /**
   * @param {Pattern} pattern
   * @param {Int32Array} faces
   * @param {Rest} rest
   * @param {Constraints} constraints
   * @param {number} [upright] weight of rotations
   * @param {Terms | null} [terms] further terms of the energy
   */
  constructor(pattern, faces, rest, constraints, upright = 0, terms = null) {
    this.matrix = new Float64Array(4 * pattern.columns.length);
    this.gradient = new Float64Array(2 * pattern.position.length);
    this.#parts = {pattern, faces, rest, constraints, upright, terms};
  }

  /** @param {boolean} given whether the core takes the present Hessian and gradient */
  #record(given) {
    const {pattern, faces, rest, constraints, upright, terms} = this.#parts, n = pattern.position.length;
    const {kinds, goals, rail, following, spans, stiffness, laps} = constraints, count = kinds.length;
    const moments = upright > 0 ? momentsOf(rest, n) : new Float64Array(0);
    const starts = Int32Array.of(0, 0, 0, rail.knots.length, rail.vertices.length / 2, rail.corners.length);
    const rails = railsRecord(rail.knots, rail.vertices, rail.corners, starts, new Int32Array(count), Float64Array.of(Infinity));
    const border = borderRecord(following, spans, new Float64Array(count).fill(stiffness), laps, count);
    const points = () => new Scratch(16 * n), numbers = () => new Scratch(8 * count);
    const space = workspaceRecord(
      given ? this.matrix : new Scratch(8 * this.matrix.length), pattern.factor(), given ? this.gradient : points(), points(), points(), points(),
      points(), points(), new Scratch(16 * count), numbers(), numbers(), numbers(), numbers(), numbers(), numbers());
    return systemRecord(
      pattern.record, faces, faces.length / 3, restStruct(rest), constraintsRecord(kinds, goals, rails, border), uprightRecord(moments, upright),
      termsRecord(terms?.total ?? null, terms?.derivatives ?? null), space);
  }

  /**
   * Make Newton steps; positions and arclengths are changed.
   * @param {Objective} objective
   * @param {Float64Array} u
   * @param {Float64Array} tau
   * @param {number} steps the most
   * @param {number} tolerance relative decrease of the energy below which a step does not count
   * @returns {{energy: number, done: number, small: number}} with the numbers of steps, and of the last ones that gained little
   */
  descend(objective, u, tau, steps, tolerance) {
    const energy = new Float64Array(1), counts = new Int32Array(2);
    descendOf(this.#record(false), objectiveStruct(objective), u, tau, false, steps, tolerance, Infinity, energy, counts);
    return {energy: energy[0], done: counts[0], small: counts[1]};
  }

  /**
   * Move to the minimum of the quadratic energy with the present derivatives.
   * @param {Float64Array} u
   */
  quadraticStep(u) {
    quadraticStepOf(this.#record(true), u, new Float64Array(this.#parts.constraints.kinds.length));
  }
}

/**
 * Return (n,) complex κ of the vertices, with ∫ f_z = Σ κ u.
 * @param {Rest} rest
 * @param {number} n
 */
function momentsOf({corners, gradients, areas}, n) {
  const moments = new Float64Array(2 * n);
  corners.forEach((vertex, k) => {
    const area = areas[Math.floor(k / 3)];
    moments[2 * vertex] += area * gradients[2 * k];
    moments[2 * vertex + 1] += area * gradients[2 * k + 1];
  });
  return moments;
}
