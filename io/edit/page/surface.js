// A mesh in space: its triangles, its rotation, and intersections with rays (by a tree of boxes). The projection is
// parallel, so that zoom, pixels and rays work as in the plane.

/** @import {Point} from './types.d.ts' */

const LEAF = 4;              // triangles: boxes with no more are not split
const DEPTH_MARGIN = 0.01;   // relative to the shape: points this close behind the surface are considered visible
const EDGE_MARGIN = 1e-6;    // relative to a triangle: rays this close to its edges hit it
const BOX_MARGIN = 1e-7;     // relative to the shape: boxes are enlarged by this, so that rays in their sides hit them

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
 * Return the linear combination s u + t v.
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
   * @param {ArrayBuffer} data from the server, see io/edit/surface_view.py
   * @param {number[]} axes right, up and towards the viewer, row by row
   */
  constructor(data, axes) {
    const [vertexCount, faceCount] = new Uint32Array(data, 0, 2);
    this.places = new Float32Array(data, 8, 3 * vertexCount);
    this.faces = new Uint32Array(data, 8 + 12 * vertexCount, 3 * faceCount);
    this.numbers = new Uint32Array(data, 8 + 12 * (vertexCount + faceCount), vertexCount);
    this.source = new Float32Array(data, 8 + 16 * vertexCount + 12 * faceCount);
    this.axes = axes.map((value, k) => (k > 2 && k < 6 ? -value : value));  // down, because y points down on the page
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
   * Return the vertices of a triangle.
   * @param {number} triangle
   */
  corners(triangle) {
    return [...this.faces.subarray(3 * triangle, 3 * triangle + 3)];
  }

  /**
   * Return the position of a vertex by its name in the file.
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
   * Return the coordinates of a point to the right, down and towards the viewer.
   * @param {Point} point
   */
  turned(point) {
    return [dot(this.row(0), point), dot(this.row(1), point), dot(this.row(2), point)];
  }

  /**
   * Rotate the mesh under the pointer.
   * @param {number} right in radians
   * @param {number} down
   */
  orbit(right, down) {
    const x = this.row(0), y = this.row(1), z = this.row(2);
    const newX = mix(x, z, Math.cos(right), Math.sin(right)), front = mix(z, x, Math.cos(right), -Math.sin(right));
    const newY = mix(y, front, Math.cos(down), Math.sin(down)), newZ = mix(front, y, Math.cos(down), -Math.sin(down));
    this.axes = [...newX, ...newY, ...newZ];
  }

  /** Return left, top, right and bottom of the rotated mesh. */
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
   * Return the first point under a point of the view, and its triangle; or null.
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
   * Return whether something lies in front of a point.
   * @param {Point} point
   */
  hides(point) {
    const [x, y, depth] = this.turned(point), hit = this.cast([x, y]);
    return hit !== null && dot(this.row(2), hit.point) > depth + DEPTH_MARGIN;
  }

  /**
   * Return the distance along a ray at which it hits a triangle (Möller and Trumbore 1997); -Infinity if it does not.
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
   * Build a node for a range of the ordered triangles, split at the middle of its longest side.
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
 * Return whether a ray hits the box of a node farther along than `most`.
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
