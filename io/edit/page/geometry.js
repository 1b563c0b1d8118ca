// Points [x, y] of the page's own coordinates, polygons, and the way to a file's units.

export const distance = (a, b) => Math.hypot(...a.map((value, k) => value - b[k]));

/** Between a file's units and the page's coordinates, of the plane or of space. */
export class Units {
  constructor({origin, scale, signs}, digits) {
    Object.assign(this, {origin, scale, signs});
    this.digits = Math.max(0, Math.min(15, digits - Math.floor(Math.log10(scale))));
  }

  /** Rounded, so that the page, the file and the command line say the same. */
  file(p) {
    return p.map((value, k) => Number((this.origin[k] + this.signs[k] * this.scale * value).toFixed(this.digits)));
  }

  page(place) {
    return place.map((value, k) => this.signs[k] * (value - this.origin[k]) / this.scale);
  }
}

/** What a file is called, without its folder, and the part of it. */
export const called = (spec) => spec.replace(/^[^#]*[\\/]/, '');

export function inside(ring, [x, y]) {
  let odd = false;
  ring.forEach(([a, b], k) => {
    const [c, d] = ring[(k + 1) % ring.length];
    if ((b > y) !== (d > y) && x < a + (y - b) / (d - b) * (c - a)) odd = !odd;
  });
  return odd;
}

/** The longest part of a line that is inside a closed polygon. */
export function clipped(ring, line) {
  const parts = [[]];
  line.forEach((p, k) => {
    const here = inside(ring, p), before = k > 0 && inside(ring, line[k - 1]);
    if (k > 0 && here !== before) parts.at(-1).push(crossing(ring, line[k - 1], p, before));
    if (here) parts.at(-1).push(p);
    else if (before) parts.push([]);
  });
  const length = (part) => part.reduce((sum, p, k) => sum + (k ? distance(p, part[k - 1]) : 0), 0);
  return parts.reduce((best, part) => (length(part) > length(best) ? part : best));
}

/** Where a segment crosses a closed polygon, by bisection. */
function crossing(ring, a, b, begun) {
  let [low, high] = [0, 1];
  for (let k = 0; k < 40; k++) {
    const middle = (low + high) / 2;
    if (inside(ring, between(a, b, middle)) === begun) low = middle;
    else high = middle;
  }
  return closest(ring, between(a, b, low)).point;
}

/** The closest point of a closed polygon: {point, away, edge, share}. */
export function closest(ring, p) {
  let best = {away: Infinity};
  ring.forEach((a, edge) => {
    const {point, share} = foot(a, ring[(edge + 1) % ring.length], p), away = distance(point, p);
    if (away < best.away) best = {point, away, edge, share};
  });
  return best;
}

export const between = (a, b, share) => a.map((value, k) => value + share * (b[k] - value));

/** The closest point of an edge. */
function foot(a, b, p) {
  let over = 0, square = 0;
  a.forEach((value, k) => {
    over += (p[k] - value) * (b[k] - value);
    square += (b[k] - value) ** 2;
  });
  const share = Math.min(1, Math.max(0, over / (square || 1)));
  return {point: between(a, b, share), share};
}

/** A drawn line with fewer points, within `near` of it (Ramer, Douglas and Peucker). */
export function simplified(points, near) {
  const [a, b] = [points[0], points.at(-1)];
  let far = 0, at = 0;
  points.forEach((p, k) => {
    const away = distance(foot(a, b, p).point, p);
    if (away > far) [far, at] = [away, k];
  });
  if (far <= near || points.length < 3) return [a, b];
  return [...simplified(points.slice(0, at + 1), near), ...simplified(points.slice(at), near).slice(1)];
}

/** A line with points between its own: its image is not straight where it is. */
export function finer(points, parts = 8) {
  const pieces = (a, b) => Array.from({length: parts}, (_, k) => between(a, b, k / parts));
  return [...points.slice(0, -1).flatMap((a, k) => pieces(a, points[k + 1])), points.at(-1)];
}
