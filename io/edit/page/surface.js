// A mesh in space: its triangles, its rotation, and what a ray meets first (a tree of boxes). It is seen by parallel
// projection, so that zoom, pixels and rays are those of the plane.

/** @import {Point} from './types.d.ts' */

const LEAF = 4;              // triangles, below which a box is not split
const DEPTH_MARGIN = 0.01;   // of the shape: a point that lies as little behind the surface is on it
const EDGE_MARGIN = 1e-6;    // of a triangle: rays that pass as near to its edges meet it
const BOX_MARGIN = 1e-7;     // of the shape: boxes are larger by that, so that rays in their sides meet them

/**
 * @param {Point} a
 * @param {Point} b
 */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/**
 * @param {Point} a
 * @param {Point} b
 */
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/**
 * @param {Point} a
 * @param {Point} b
 */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/**
 * The linear combination s u + t v.
 * @param {Point} u
 * @param {Point} v
 * @param {number} s
 * @param {number} t
 */
const mix = (u, v, s, t) => u.map((value, k) => s * value + t * v[k]);

/** @typedef {{begin: number, end: number, low: Point, high: Point, children: [Node, Node] | null}} Node */

export class Surface {
  #order;
  #root;

  /**
   * @param {ArrayBuffer} data what the server sends, see io/edit/surface_view.py
   * @param {number[]} axes right, up and towards the viewer, row by row
   */
  constructor(data, axes) {
    const [vertexCount, faceCount] = new Uint32Array(data, 0, 2);
    this.places = new Float32Array(data, 8, 3 * vertexCount);
    this.faces = new Uint32Array(data, 8 + 12 * vertexCount, 3 * faceCount);
    this.numbers = new Uint32Array(data, 8 + 12 * (vertexCount + faceCount), vertexCount);
    this.source = new Float32Array(data, 8 + 16 * vertexCount + 12 * faceCount);
    this.axes = axes.map((value, k) => (k > 2 && k < 6 ? -value : value));  // down, as the page has y
    this.#order = Uint32Array.from({length: faceCount}, (_, k) => k);
    this.#root = this.#branch(0, faceCount);
  }

  /**
   * @param {number} vertex
   * @returns {Point}
   */
  place(vertex) {
    return [...this.places.subarray(3 * vertex, 3 * vertex + 3)];
  }

  /**
   * The vertices of a triangle.
   * @param {number} triangle
   */
  corners(triangle) {
    return [...this.faces.subarray(3 * triangle, 3 * triangle + 3)];
  }

  /**
   * The place of a vertex by its name in the file.
   * @param {string} name
   */
  named(name) {
    return this.place(Math.max(0, this.numbers.indexOf(Number(name.slice(1)))));
  }

  /** @param {number} k 0 right, 1 down, 2 towards the viewer */
  row(k) {
    return this.axes.slice(3 * k, 3 * k + 3);
  }

  /**
   * The coordinates of a point to the right, down and towards the viewer.
   * @param {Point} point
   */
  turned(point) {
    return [dot(this.row(0), point), dot(this.row(1), point), dot(this.row(2), point)];
  }

  /**
   * Rotate it under the pointer.
   * @param {number} right in radians
   * @param {number} down
   */
  orbit(right, down) {
    const x = this.row(0), y = this.row(1), z = this.row(2);
    const newX = mix(x, z, Math.cos(right), Math.sin(right)), front = mix(z, x, Math.cos(right), -Math.sin(right));
    const newY = mix(y, front, Math.cos(down), Math.sin(down)), newZ = mix(front, y, Math.cos(down), -Math.sin(down));
    this.axes = [...newX, ...newY, ...newZ];
  }

  /** Left, top, right and bottom as it is rotated. */
  bounds() {
    const box = [Infinity, Infinity, -Infinity, -Infinity], right = this.row(0), down = this.row(1);
    for (let k = 0; k < this.places.length; k += 3) {
      const point = [this.places[k], this.places[k + 1], this.places[k + 2]];
      const x = dot(right, point), y = dot(down, point);
      box[0] = Math.min(box[0], x);
      box[1] = Math.min(box[1], y);
      box[2] = Math.max(box[2], x);
      box[3] = Math.max(box[3], y);
    }
    return box;
  }

  /**
   * The first point under a point of the view, and its triangle; null where there is none.
   * @param {Point} point
   * @returns {{point: Point, triangle: number} | null}
   */
  cast([x, y]) {
    const toward = this.row(2), origin = mix(this.row(0), this.row(1), x, y);
    let triangle = -1, nearest = -Infinity;
    const nodes = [this.#root];
    for (let node = nodes.pop(); node; node = nodes.pop()) {
      if (!meets(node, origin, toward, nearest)) continue;
      if (node.children) {
        nodes.push(...node.children);
        continue;
      }
      for (let k = node.begin; k < node.end; k++) {
        const depth = this.#depth(this.#order[k], origin, toward);
        if (depth > nearest) [nearest, triangle] = [depth, this.#order[k]];
      }
    }
    return triangle < 0 ? null : {point: mix(origin, toward, 1, nearest), triangle};
  }

  /**
   * Whether something lies before a point.
   * @param {Point} point
   */
  hides(point) {
    const [x, y, depth] = this.turned(point), hit = this.cast([x, y]);
    return hit !== null && dot(this.row(2), hit.point) > depth + DEPTH_MARGIN;
  }

  /**
   * How far along a ray a triangle is met (Möller and Trumbore 1997); -Infinity where it is not.
   * @param {number} triangle
   * @param {Point} origin
   * @param {Point} toward
   */
  #depth(triangle, origin, toward) {
    const [a, b, c] = this.corners(triangle).map((vertex) => this.place(vertex));
    const ab = minus(b, a), ac = minus(c, a), across = cross(toward, ac), area = dot(ab, across);
    const offset = minus(origin, a), s = dot(offset, across) / area;
    const side = cross(offset, ab), t = dot(toward, side) / area;
    const isInside = s >= -EDGE_MARGIN && t >= -EDGE_MARGIN && s + t <= 1 + EDGE_MARGIN;
    return isInside ? dot(ac, side) / area : -Infinity;
  }

  /**
   * A node over some of the ordered triangles, split at the middle of its longest side.
   * @param {number} begin
   * @param {number} end
   * @returns {Node}
   */
  #branch(begin, end) {
    const order = this.#order, low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let k = begin; k < end; k++) {
      for (const vertex of this.corners(order[k])) {
        for (let axis = 0; axis < 3; axis++) {
          low[axis] = Math.min(low[axis], this.places[3 * vertex + axis]);
          high[axis] = Math.max(high[axis], this.places[3 * vertex + axis]);
        }
      }
    }
    /** @type {Node} */
    const node = {begin, end, low, high, children: null};
    if (end - begin <= LEAF) return node;
    const size = minus(high, low), axis = size.indexOf(Math.max(...size)), middle = (low[axis] + high[axis]) / 2;
    let split = begin;
    for (let k = begin; k < end; k++) {
      const corners = this.corners(order[k]), sum = corners.reduce((all, vertex) => all + this.places[3 * vertex + axis], 0);
      if (sum / 3 < middle) {
        [order[split], order[k]] = [order[k], order[split]];
        split += 1;
      }
    }
    if (split === begin || split === end) split = (begin + end) >> 1;
    node.children = [this.#branch(begin, split), this.#branch(split, end)];
    return node;
  }
}

/**
 * Whether a line meets the box of a node farther along than `most`.
 * @param {Node} node
 * @param {Point} origin
 * @param {Point} toward
 * @param {number} most
 */
function meets({low, high}, origin, toward, most) {
  let near = most, far = Infinity;
  for (let k = 0; k < 3; k++) {
    const a = (low[k] - BOX_MARGIN - origin[k]) / toward[k], b = (high[k] + BOX_MARGIN - origin[k]) / toward[k];
    if (Number.isNaN(a) || Number.isNaN(b)) continue;
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near <= far;
}
