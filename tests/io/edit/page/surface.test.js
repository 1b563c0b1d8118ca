import assert from 'node:assert/strict';
import {test} from 'node:test';

import {Surface} from '../../../../io/edit/page/surface.js';

const AXES = [1, 0, 0, 0, 1, 0, 0, 0, 1];  // right, up, towards the viewer

/**
 * Return a surface as sent by the server.
 * @param {number[][]} places
 * @param {number[][]} faces
 */
function sent(places, faces) {
  const n = places.length, m = faces.length, data = new ArrayBuffer(8 + 16 * n + 12 * m);
  new Uint32Array(data, 0, 2).set([n, m]);
  new Float32Array(data, 8, 3 * n).set(places.flat());
  new Uint32Array(data, 8 + 12 * n, 3 * m).set(faces.flat());
  new Uint32Array(data, 8 + 12 * (n + m), n).set(places.map((_, k) => 10 * k + 1));
  return new Surface(data, AXES);
}

/** Two sheets that face the viewer: one of 2 by 1 at depth 0, and a smaller one in front of its right half. */
const SHEETS = sent(
  [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1, 0, 0.5], [2, 0, 0.5], [2, 1, 0.5], [1, 1, 0.5]],
  [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
);

/** A height field of many triangles, so that its boxes are split. */
function hills(side = 12) {
  const places = [], faces = [];
  for (let j = 0; j <= side; j++) {
    for (let i = 0; i <= side; i++) places.push([i / side, 2 * j / side, 0.2 * Math.sin(5 * i / side + 3 * j / side)]);
  }
  for (let j = 0; j < side; j++) {
    for (let i = 0; i < side; i++) {
      const a = j * (side + 1) + i, b = a + side + 1;
      faces.push([a, a + 1, b], [a + 1, b + 1, b]);
    }
  }
  return {surface: sent(places, faces), places, faces};
}

test('a ray meets the sheet that is nearest to the viewer', () => {
  assert.ok(Math.abs(SHEETS.cast([0.5, -0.4])?.point[2] ?? 9) < 1e-6);
  assert.ok(Math.abs((SHEETS.cast([1.5, -0.4])?.point[2] ?? 9) - 0.5) < 1e-6);
  assert.equal(SHEETS.cast([0.5, 0.4]), null);  // y points down: that is above it
  assert.equal(SHEETS.hides([1.5, 0.4, 0]), true);
  assert.equal(SHEETS.hides([0.5, 0.4, 0]), false);
  assert.equal(SHEETS.hides([1.5, 0.4, 0.5]), false);
  assert.equal(SHEETS.hides([1.5, 0.4, 0.495]), false);  // rounded
});

test('the tree of boxes finds what all triangles, one by one, would give', () => {
  const {surface, places, faces} = hills();
  for (const [x, y] of [[0.11, 0.4], [0.62, 1.77], [0.95, 0.03], [0.33, 1.2]]) {
    const hit = surface.cast([x, -y]);
    assert.ok(hit);
    const corners = faces[hit.triangle].map((vertex) => places[vertex]);
    const [a, b, c] = corners, area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    const s = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / area;
    const t = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / area;
    assert.ok(s >= -1e-5 && t >= -1e-5 && s + t <= 1 + 1e-5);
    assert.ok(Math.abs(hit.point[2] - (a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]))) < 1e-5);
  }
});

test('rotating it keeps its axes orthonormal, and moves what is before to the right', () => {
  const {surface} = hills(), [x, y, depth] = surface.turned([0, 0, 1]);
  assert.ok(x === 0 && y === 0 && depth === 1);
  surface.orbit(0.3, 0);
  assert.ok(surface.turned([0, 0, 1])[0] > 0.29);
  surface.orbit(-0.2, 0.5);
  for (let i = 0; i < 3; i++) {
    for (let j = 0; j < 3; j++) {
      const product = surface.row(i).reduce((sum, value, k) => sum + value * surface.row(j)[k], 0);
      assert.ok(Math.abs(product - Number(i === j)) < 1e-12);
    }
  }
});

test('vertices are found by their names in the file, and bounds are those of the view', () => {
  assert.deepEqual(SHEETS.named('v41'), [1, 0, 0.5]);
  assert.deepEqual(SHEETS.bounds().map((value) => value + 0), [0, -1, 2, 0]);  // without negative zeros
});
