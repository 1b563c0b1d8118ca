// Drags of an outline: a smooth displacement around the pointer.

/**
 * Return points of a drawing displaced around a centre; the displacement fades to nothing at the radius.
 * @param {Float64Array} z
 * @param {number[]} centre
 * @param {number[]} by
 * @param {number} radius
 */
export function brush(z, [x, y], [dx, dy], radius) {
  const moved = z.slice();
  for (let k = 0; k < z.length; k += 2) {
    const square = ((z[k] - x) ** 2 + (z[k + 1] - y) ** 2) / radius ** 2;
    if (square >= 1) continue;
    const share = (1 - square) ** 2;
    moved[k] += share * dx;
    moved[k + 1] += share * dy;
  }
  return moved;
}

/**
 * Return a closed polyline with edges no longer than a length.
 * @param {Float64Array} z
 * @param {number} most
 */
export function subdivided(z, most) {
  const points = [];
  for (let k = 0; k < z.length; k += 2) {
    const n = (k + 2) % z.length, dx = z[n] - z[k], dy = z[n + 1] - z[k + 1], parts = Math.max(1, Math.ceil(Math.hypot(dx, dy) / most));
    for (let part = 0; part < parts; part++) points.push(z[k] + part / parts * dx, z[k + 1] + part / parts * dy);
  }
  return Float64Array.from(points);
}
