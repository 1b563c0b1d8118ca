// Points [x, y] of the page's own coordinates, polygons, and the way to a file's units.

export const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

/** Between a file's units and the page's coordinates. */
export class Units {
  constructor({origin, scale, down}, digits) {
    Object.assign(this, {origin, scale, sign: down ? 1 : -1});
    this.digits = Math.max(0, Math.min(15, digits - Math.floor(Math.log10(scale))));
  }

  /** Rounded, so that the page, the file and the command line say the same. */
  file([x, y]) {
    return [this.origin[0] + this.scale * x, this.origin[1] + this.sign * this.scale * y]
      .map((value) => Number(value.toFixed(this.digits)));
  }

  page([x, y]) {
    return [(x - this.origin[0]) / this.scale, this.sign * (y - this.origin[1]) / this.scale];
  }
}

export function area(ring) {
  let sum = 0;
  ring.forEach(([x, y], k) => {
    const [u, v] = ring[(k + 1) % ring.length];
    sum += x * v - u * y;
  });
  return Math.abs(sum) / 2;
}

export function inside(ring, [x, y]) {
  let odd = false;
  ring.forEach(([a, b], k) => {
    const [c, d] = ring[(k + 1) % ring.length];
    if ((b > y) !== (d > y) && x < a + (y - b) / (d - b) * (c - a)) odd = !odd;
  });
  return odd;
}

/** The closest point of a closed polygon. */
export function closest(ring, p) {
  let best = ring[0], least = Infinity;
  ring.forEach((a, k) => {
    const b = ring[(k + 1) % ring.length], u = [b[0] - a[0], b[1] - a[1]];
    const t = ((p[0] - a[0]) * u[0] + (p[1] - a[1]) * u[1]) / (u[0] * u[0] + u[1] * u[1] || 1);
    const q = [0, 1].map((i) => a[i] + Math.min(1, Math.max(0, t)) * u[i]);
    const away = distance(p, q);
    if (away < least) [best, least] = [q, away];
  });
  return best;
}

/** A drawn line with fewer points, within `near` of it (Ramer, Douglas and Peucker). */
export function simplified(points, near) {
  const [a, b] = [points[0], points.at(-1)], u = [b[0] - a[0], b[1] - a[1]], length = Math.hypot(...u) || 1;
  let far = 0, at = 0;
  points.forEach((p, k) => {
    const away = Math.abs(u[0] * (p[1] - a[1]) - u[1] * (p[0] - a[0])) / length;
    if (away > far) [far, at] = [away, k];
  });
  if (far <= near || points.length < 3) return [a, b];
  return [...simplified(points.slice(0, at + 1), near), ...simplified(points.slice(at), near).slice(1)];
}

/** A line with points between its own: its image is not straight where it is. */
export function finer(points, parts = 8) {
  const share = (a, b, t) => [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
  const between = (a, b) => Array.from({length: parts}, (_, k) => share(a, b, k / parts));
  return [...points.slice(0, -1).flatMap((a, k) => between(a, points[k + 1])), points.at(-1)];
}
