// Soft pins, which draw small patches of the source to their places, as terms of the energy; as in iccm/pins.py,
// iccm/balanced/constraints/soft.py and iccm/balanced/minimise/soft_pins.py, without exact pins, rotations and sizes.

import {
  CORE_MARGIN_RATIO, CORE_SHARE, COST_AT_TOLERANCE, FEWEST_CORE_VERTICES, LARGEST_CORE_RADIUS, MOST_TOLERANCES, RADIUS_OUTLINE_DISTANCES,
  RADIUS_PIN_DISTANCES, RADIUS_SHARE, STIFFNESS, TOLERANCE_SHARE, WORST_CONDITION_NUMBER,
} from './constants.js';
import {numbersAt} from './core.js';
import {triangleAt} from './locate.js';
import {areasOf} from './unfold.js';

/** @import {Curve} from './curve.js' */
/** @import {Pattern} from './linear.js' */

/** A map's mesh: vertices, their images, and triangles. @typedef {{z: Float64Array, u: Float64Array, faces: Int32Array}} Mesh */
/** The term s |Σ aᵢ uᵢ + b|² in the images uᵢ of vertices, with complex a and b. @typedef {{vertices: number[], weights: Float64Array, constant: number[], stiffness: number}} Spring */
/** The springs for the core. @typedef {{total: (u: number) => number, derivatives: (u: number, matrix: number, gradient: number) => number}} Terms */

const QUADRATURE = quadrature(4);

/**
 * Return barycentric coordinates of the centroids of equal parts of a triangle.
 * @param {number} n parts of an edge
 */
function quadrature(n) {
  const points = [];
  for (let i = 0; i < n; i++) {
    for (let j = 0; i + j < n; j++) {
      points.push([i + 1 / 3, j + 1 / 3]);
      if (i + j < n - 1) points.push([i + 2 / 3, j + 2 / 3]);
    }
  }
  return points.map(([a, b]) => [a / n, b / n, 1 - (a + b) / n]);
}

/**
 * Return the radii of the patches of pins, in the source.
 * @param {Float64Array} source
 * @param {Float64Array} target
 * @param {[Curve, Curve]} curves of the shapes, of area one
 */
export function radiiOf(source, target, curves) {
  const count = source.length / 2, radii = new Float64Array(count).fill(RADIUS_SHARE);
  [source, target].forEach((points, side) => {
    for (let k = 0; k < count; k++) {
      const x = points[2 * k], y = points[2 * k + 1];
      radii[k] = Math.min(radii[k], RADIUS_OUTLINE_DISTANCES * curves[side].distance(x, y));
      for (let j = 0; j < count; j++) {
        if (j !== k) radii[k] = Math.min(radii[k], RADIUS_PIN_DISTANCES * Math.hypot(points[2 * j] - x, points[2 * j + 1] - y));
      }
    }
  });
  return radii;
}

/** Soft pins between shapes of area one. */
export class Pins {
  /**
   * @param {object} pins
   * @param {Float64Array} pins.source points of the source
   * @param {Float64Array} pins.target their places
   * @param {Float64Array} pins.radii of the patches, in the source
   * @param {Float64Array} pins.springs energy at distance one
   * @param {boolean} [isInverse] whether the map is from target to source
   */
  constructor(pins, isInverse = false) {
    this.given = pins;
    this.isInverse = isInverse;
    /** Number of pins. */
    this.count = pins.radii.length;
  }

  /**
   * Return pins with radii chosen.
   * @param {Float64Array} source
   * @param {Float64Array} target
   * @param {[Curve, Curve]} curves of the shapes, of area one
   */
  static of(source, target, curves) {
    const radii = radiiOf(source, target, curves);
    return new Pins({source, target, radii, springs: radii.map(() => COST_AT_TOLERANCE / TOLERANCE_SHARE ** 2)});
  }

  /** Return the pins of the inverse map; patches remain those of the source. */
  inverse() {
    return new Pins(this.given, !this.isInverse);
  }

  /**
   * Return the pins with stiffer springs.
   * @param {ArrayLike<number>} factors
   */
  stiffer(factors) {
    return new Pins({...this.given, springs: this.given.springs.map((spring, k) => spring * factors[k])}, this.isInverse);
  }

  /** Points of the domain of the map. */
  get points() {
    return this.isInverse ? this.given.target : this.given.source;
  }

  /** Their places. */
  get places() {
    return this.isInverse ? this.given.source : this.given.target;
  }

  /** @param {number} k */
  #coreRadius(k) {
    return Math.min(CORE_SHARE * this.given.radii[k], LARGEST_CORE_RADIUS);
  }

  /**
   * Return the positions of vertices in the source, and in the target.
   * @param {Mesh} mesh
   */
  #sides({z, u}) {
    return this.isInverse ? [u, z] : [z, u];
  }

  /**
   * Return the distances of the images of pins from their places, relative to the distances up to which they count as met.
   * @param {Mesh} mesh
   */
  misses(mesh) {
    const {source, target} = this.given, [w, image] = this.#sides(mesh);
    return Float64Array.from({length: this.count}, (_, k) => {
      const [x, y] = source.subarray(2 * k, 2 * k + 2), own = mesh.faces.subarray(3 * triangleAt(w, mesh.faces, x, y)).subarray(0, 3);
      const shares = barycentric(w, own, x, y), at = [0, 1].map((axis) => shares.reduce((sum, share, i) => sum + share * image[2 * own[i] + axis], 0));
      return Math.hypot(at[0] - target[2 * k], at[1] - target[2 * k + 1]) / (MOST_TOLERANCES * TOLERANCE_SHARE);
    });
  }

  /**
   * Return the vertices of each patch's core, ascending, with the corners of the triangle around the pin.
   * @param {Mesh} mesh
   * @param {number} [margin] radius relative to that of the core
   */
  cores(mesh, margin = 1) {
    const [w] = this.#sides(mesh), {source} = this.given;
    return Array.from({length: this.count}, (_, k) => {
      const x = source[2 * k], y = source[2 * k + 1], radius = margin * this.#coreRadius(k), t = triangleAt(w, mesh.faces, x, y);
      const found = new Set(mesh.faces.subarray(3 * t, 3 * t + 3));
      for (let v = 0; v < w.length / 2; v++) if ((w[2 * v] - x) ** 2 + (w[2 * v + 1] - y) ** 2 < radius ** 2) found.add(v);
      return [...found].sort((a, b) => a - b);
    });
  }

  /**
   * Return the cores with a margin, unless some that are known contain the present ones.
   * @param {Mesh} mesh
   * @param {number[][] | null} known
   */
  coresOnMesh(mesh, known) {
    const needed = this.cores(mesh);
    const isKnown = known?.length === needed.length && needed.every((core, k) => core.every((vertex) => known[k].includes(vertex)));
    return isKnown ? known : this.cores(mesh, CORE_MARGIN_RATIO);
  }

  /**
   * Return the weight of distortion in each triangle; 1 outside of all patches.
   * @param {Mesh} mesh
   */
  multipliers(mesh) {
    const [w] = this.#sides(mesh), {faces} = mesh, {source, radii} = this.given;
    return Float64Array.from({length: faces.length / 3}, (_, t) => {
      const corners = [0, 1, 2].map((i) => 2 * faces[3 * t + i]), x = corners.map((v) => w[v]), y = corners.map((v) => w[v + 1]);
      const mx = (x[0] + x[1] + x[2]) / 3, my = (y[0] + y[1] + y[2]) / 3;
      const reach = Math.max(...corners.map((_v, i) => Math.hypot(x[i] - mx, y[i] - my)));
      const near = [...radii.keys()].filter((k) => Math.hypot(mx - source[2 * k], my - source[2 * k + 1]) < radii[k] + reach);
      if (!near.length) return 1;
      let sum = 0;
      for (const [a, b, c] of QUADRATURE) {
        const px = a * x[0] + b * x[1] + c * x[2], py = a * y[0] + b * y[1] + c * y[2];
        sum += Math.max(...near.map((k) => kernel(Math.hypot(px - source[2 * k], py - source[2 * k + 1]) / radii[k])));
      }
      return 1 + (STIFFNESS - 1) * sum / QUADRATURE.length;
    });
  }

  /**
   * Return the springs.
   * @param {Mesh} mesh
   * @param {number[][]} cores as returned by `cores`, or larger
   * @param {number} q power of the density to which they are added
   * @param {boolean} forward whether the images move, rather than the vertices
   * @returns {Spring[]}
   */
  springs(mesh, cores, q, forward) {
    const {z, u, faces} = mesh, [w] = this.#sides(mesh), {source, springs} = this.given, areas = new Float64Array(w.length / 2);
    areasOf(w, faces).forEach((area, t) => {
      for (let i = 3 * t; i < 3 * t + 3; i++) areas[faces[i]] += Math.abs(area) / 3;
    });
    const here = this.points, there = this.places, moving = forward ? u : z;
    return cores.map((vertices, k) => {
      const x = source[2 * k], y = source[2 * k + 1];
      let own = coreWeights(x, y, this.#coreRadius(k), vertices, w, areas);
      if (!own) {
        const t = triangleAt(w, faces, x, y), corners = faces.subarray(3 * t, 3 * t + 3), shares = barycentric(w, corners, x, y);
        own = new Float64Array(vertices.length);
        corners.forEach((vertex, i) => own?.fill(shares[i], vertices.indexOf(vertex), vertices.indexOf(vertex) + 1));
      }
      const mean = (/** @type {Float64Array} */ points) => [0, 1].map(
        (axis) => vertices.reduce((sum, vertex, i) => sum + /** @type {Float64Array} */ (own)[i] * points[2 * vertex + axis], 0));
      const before = mean(z), after = mean(u), [fx, fy] = meanDerivative(z, u, vertices, own, before);
      // Displacement of the core from its place: u - u₀ - f'·(z - z₀), which is linear in the positions that move. The
      // second difference is zero until vertices of the source move.
      const dx = before[0] - here[2 * k], dy = before[1] - here[2 * k + 1], [gx, gy] = forward ? [1, 0] : [-fx, -fy], middle = mean(moving);
      const residual = [after[0] - there[2 * k] - fx * dx + fy * dy, after[1] - there[2 * k + 1] - fx * dy - fy * dx];
      const weights = new Float64Array(2 * vertices.length);
      own.forEach((share, i) => weights.set([gx * share, gy * share], 2 * i));
      // distances are measured in the target, also for the inverse map
      const scale = this.isInverse ? 1 / (fx * fx + fy * fy) : 1;
      const constant = [residual[0] - gx * middle[0] + gy * middle[1], residual[1] - gx * middle[1] - gy * middle[0]];
      return {vertices, weights, constant, stiffness: q * springs[k] * scale};
    });
  }
}

/**
 * Return the sum of springs, and its derivatives, as functions that the core calls.
 * @param {Spring[]} springs
 * @param {Pattern} pattern with entries for all pairs of their vertices
 * @param {number} n number of vertices
 * @returns {Terms}
 */
export function termsOf(springs, pattern, n) {
  const {position} = pattern, entries = pattern.columns.length;
  /** Blocks of the Hessian, which is constant: an entry, and its four numbers. */
  const places = /** @type {number[]} */ ([]), blocks = /** @type {number[]} */ ([]);
  for (const {vertices, weights, stiffness} of springs) {
    vertices.forEach((a, i) => vertices.forEach((b, j) => {
      if (position[a] > position[b]) return;
      const [ax, ay, bx, by] = [weights[2 * i], weights[2 * i + 1], weights[2 * j], weights[2 * j + 1]];
      const x = 2 * stiffness * (ax * bx + ay * by), y = 2 * stiffness * (ax * by - ay * bx);  // of conj(a) b
      if (x === 0 && y === 0) return;
      places.push(pattern.entry(a, b));
      blocks.push(x, -y, y, x);
    }));
  }
  const total = (/** @type {number} */ u) => totalOf(springs, numbersAt(u, 2 * n));
  return {
    total,
    derivatives: (u, matrix, gradient) => {
      const images = numbersAt(u, 2 * n), slopes = numbersAt(gradient, 2 * n), hessian = numbersAt(matrix, 4 * entries);
      places.forEach((entry, k) => {
        for (let i = 0; i < 4; i++) hessian[4 * entry + i] += blocks[4 * k + i];
      });
      for (const spring of springs) {
        const [x, y] = residualOf(spring, images), {vertices, weights, stiffness} = spring;
        vertices.forEach((vertex, i) => {
          slopes[2 * vertex] += 2 * stiffness * (weights[2 * i] * x + weights[2 * i + 1] * y);
          slopes[2 * vertex + 1] += 2 * stiffness * (weights[2 * i] * y - weights[2 * i + 1] * x);
        });
      }
      return total(u);
    },
  };
}

/**
 * @param {Spring[]} springs
 * @param {Float64Array} u
 */
export const totalOf = (springs, u) => springs.reduce((sum, spring) => {
  const [x, y] = residualOf(spring, u);
  return sum + spring.stiffness * (x * x + y * y);
}, 0);

/**
 * @param {Spring} spring
 * @param {Float64Array} u
 */
function residualOf({vertices, weights, constant: [x, y]}, u) {
  vertices.forEach((vertex, i) => {
    const ax = weights[2 * i], ay = weights[2 * i + 1], ux = u[2 * vertex], uy = u[2 * vertex + 1];
    x += ax * ux - ay * uy;
    y += ax * uy + ay * ux;
  });
  return [x, y];
}

/**
 * Return (1 - ρ²)² for a distance relative to a radius; 0 beyond it.
 * @param {number} rho
 */
const kernel = (rho) => Math.max(1 - rho * rho, 0) ** 2;

/**
 * Return weights with which a pin is the mean of a core's vertices; null if these are too few. They are the kernel,
 * times the areas around the vertices, times a linear function that moves the mean to the pin.
 * @param {number} x
 * @param {number} y
 * @param {number} radius
 * @param {number[]} vertices
 * @param {Float64Array} w
 * @param {Float64Array} areas around all vertices
 */
function coreWeights(x, y, radius, vertices, w, areas) {
  const away = vertices.map((vertex) => [1, (w[2 * vertex] - x) / radius, (w[2 * vertex + 1] - y) / radius]);
  const masses = vertices.map((vertex, i) => areas[vertex] * kernel(Math.hypot(away[i][1], away[i][2])));
  if (masses.filter((mass) => mass > 0).length < FEWEST_CORE_VERTICES) return null;
  const moment = (/** @type {number} */ a, /** @type {number} */ b) => masses.reduce((sum, mass, i) => sum + mass * away[i][a] * away[i][b], 0);
  const [m00, m01, m02, m11, m12, m22] = [moment(0, 0), moment(0, 1), moment(0, 2), moment(1, 1), moment(1, 2), moment(2, 2)];
  // the adjugate of the symmetric matrix of moments
  const a00 = m11 * m22 - m12 * m12, a01 = m02 * m12 - m01 * m22, a02 = m01 * m12 - m02 * m11;
  const a11 = m00 * m22 - m02 * m02, a12 = m01 * m02 - m00 * m12, a22 = m00 * m11 - m01 * m01, det = m00 * a00 + m01 * a01 + m02 * a02;
  const condition = Math.hypot(m00, m11, m22, m01, m01, m02, m02, m12, m12) * Math.hypot(a00, a11, a22, a01, a01, a02, a02, a12, a12) / det;
  if (!(condition < WORST_CONDITION_NUMBER)) return null;
  const weights = Float64Array.from(masses, (mass, i) => mass * (a00 + a01 * away[i][1] + a02 * away[i][2]) / det);
  return weights.some((weight) => weight < 0) ? null : weights;
}

/**
 * Return the barycentric coordinates of a point, clipped if it is outside of the triangle.
 * @param {Float64Array} w
 * @param {Int32Array} corners
 * @param {number} x
 * @param {number} y
 */
function barycentric(w, corners, x, y) {
  const [a, b, c] = [...corners].map((vertex) => [w[2 * vertex] - x, w[2 * vertex + 1] - y]);
  const cross = (/** @type {number[]} */ p, /** @type {number[]} */ r) => Math.max(p[0] * r[1] - p[1] * r[0], 0);
  const shares = [cross(b, c), cross(c, a), cross(a, b)], sum = shares[0] + shares[1] + shares[2];
  return shares.map((share) => share / sum);
}

/**
 * Return the derivative of the similarity closest to z -> u.
 * @param {Float64Array} z
 * @param {Float64Array} u
 * @param {number[]} vertices
 * @param {Float64Array} weights
 * @param {number[]} middle the mean of z
 */
function meanDerivative(z, u, vertices, weights, [mx, my]) {
  let x = 0, y = 0, square = 0;
  vertices.forEach((vertex, i) => {
    const dx = z[2 * vertex] - mx, dy = z[2 * vertex + 1] - my, ux = u[2 * vertex], uy = u[2 * vertex + 1];
    x += weights[i] * (dx * ux + dy * uy);
    y += weights[i] * (dx * uy - dy * ux);
    square += weights[i] * (dx * dx + dy * dy);
  });
  return [x / square, y / square];
}
