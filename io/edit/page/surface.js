// A mesh in space: its triangles, how it is turned, and what of it a ray meets first (a tree of boxes). Seen by parallel
// projection, so that zoom, pixels and rays are those of the plane.

const LEAF = 4;
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

export class Surface {
  #order; #boxes = []; #nodes = [];

  /** @param data what the server sends, see io/edit/surface_view.py @param axes right, up, towards the viewer */
  constructor(data, axes) {
    const [n, m] = new Uint32Array(data, 0, 2);
    this.places = new Float32Array(data, 8, 3 * n);
    this.faces = new Uint32Array(data, 8 + 12 * n, 3 * m);
    this.numbers = new Uint32Array(data, 8 + 12 * (n + m), n);
    this.source = new Float32Array(data, 8 + 16 * n + 12 * m);
    this.axes = this.first = axes.map((v, k) => (k > 2 && k < 6 ? -v : v));  // down, as the page has y
    this.#order = Uint32Array.from({length: m}, (_, k) => k);
    this.#branch(0, m);
  }

  place(vertex) {
    return [...this.places.subarray(3 * vertex, 3 * vertex + 3)];
  }

  corners(triangle) {
    return [...this.faces.subarray(3 * triangle, 3 * triangle + 3)];
  }

  /** The place of a vertex by its name in the file. */
  named(name) {
    return this.place(Math.max(0, this.numbers.indexOf(Number(name.slice(1)))));
  }

  row(k) {
    return this.axes.slice(3 * k, 3 * k + 3);
  }

  /** Right, down and towards the viewer. */
  turned(p) {
    return [0, 1, 2].map((k) => dot(this.row(k), p));
  }

  /** Turn it under the pointer, by angles to the right and down. */
  orbit(right, down) {
    const [a, b, c] = [0, 1, 2].map((k) => this.row(k));
    const mix = (u, v, s, t) => u.map((x, k) => s * x + t * v[k]);
    const side = mix(a, c, Math.cos(right), Math.sin(right)), front = mix(c, a, Math.cos(right), -Math.sin(right));
    this.axes = [...side, ...mix(b, front, Math.cos(down), Math.sin(down)), ...mix(front, b, Math.cos(down), -Math.sin(down))];
  }

  /** Left, top, right, bottom as it is turned. */
  bounds() {
    const box = [Infinity, Infinity, -Infinity, -Infinity], [a, b] = [this.row(0), this.row(1)];
    for (let k = 0; k < this.places.length; k += 3) {
      const p = this.places.subarray(k, k + 3), x = dot(a, p), y = dot(b, p);
      box[0] = Math.min(box[0], x);
      box[1] = Math.min(box[1], y);
      box[2] = Math.max(box[2], x);
      box[3] = Math.max(box[3], y);
    }
    return box;
  }

  /** The first point of it under a point of the view: {point, triangle}, or null. */
  cast([x, y]) {
    const [a, b, toward] = [0, 1, 2].map((k) => this.row(k));
    const origin = a.map((v, k) => x * v + y * b[k]);
    let best = null, most = -Infinity;
    const left = [0];
    while (left.length) {
      const node = left.pop(), [begin, end, first, second] = this.#nodes[node];
      if (!meets(this.#boxes[node], origin, toward, most)) continue;
      if (first) left.push(first, second);
      else {
        for (let k = begin; k < end; k++) {
          const depth = this.#depth(this.#order[k], origin, toward);
          if (depth > most) [most, best] = [depth, this.#order[k]];
        }
      }
    }
    return best === null ? null : {point: origin.map((v, k) => v + most * toward[k]), triangle: best};
  }

  /** Whether something lies before a point. */
  hides(p) {
    const [x, y, depth] = this.turned(p), hit = this.cast([x, y]);
    return hit !== null && dot(this.row(2), hit.point) > depth + 0.01;
  }

  /** How far along a ray a triangle is met (Möller and Trumbore); -Infinity where it is not. */
  #depth(triangle, origin, toward) {
    const [a, b, c] = this.corners(triangle).map((vertex) => this.place(vertex));
    const u = minus(b, a), v = minus(c, a), across = cross(toward, v), area = dot(u, across), way = minus(origin, a);
    const s = dot(way, across) / area, side = cross(way, u), t = dot(toward, side) / area;
    return s >= -1e-6 && t >= -1e-6 && s + t <= 1 + 1e-6 ? dot(v, side) / area : -Infinity;
  }

  /** A node over the triangles from `begin` to `end`, split at the middle of its longest side. */
  #branch(begin, end) {
    const order = this.#order, number = this.#nodes.push([begin, end, 0, 0]) - 1, low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9];
    for (let k = 3 * begin; k < 3 * end; k++) {
      const vertex = 3 * this.faces[3 * order[Math.floor(k / 3)] + k % 3];
      for (let i = 0; i < 3; i++) {
        low[i] = Math.min(low[i], this.places[vertex + i]);
        high[i] = Math.max(high[i], this.places[vertex + i]);
      }
    }
    this.#boxes.push([low, high]);
    if (end - begin <= LEAF) return number;
    const size = minus(high, low), axis = size.indexOf(Math.max(...size));
    const middle = (k) => this.corners(order[k]).reduce((sum, vertex) => sum + this.places[3 * vertex + axis], 0) / 3;
    let at = begin;
    for (let k = begin; k < end; k++) if (middle(k) < (low[axis] + high[axis]) / 2) [order[at], order[k], at] = [order[k], order[at], at + 1];
    if (at === begin || at === end) at = (begin + end) >> 1;
    this.#nodes[number][2] = this.#branch(begin, at);
    this.#nodes[number][3] = this.#branch(at, end);
    return number;
  }
}

/** Whether a line meets a box farther along than `most`. */
function meets([low, high], origin, toward, most) {
  let near = most, far = Infinity;
  for (let k = 0; k < 3; k++) {
    const a = (low[k] - 1e-7 - origin[k]) / toward[k], b = (high[k] + 1e-7 - origin[k]) / toward[k];
    if (Number.isNaN(a) || Number.isNaN(b)) continue;
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near <= far;
}
