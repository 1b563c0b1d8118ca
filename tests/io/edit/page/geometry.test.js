import assert from 'node:assert/strict';
import {test} from 'node:test';

import {atRim, clipped, closest, distance, fileName, finer, inside, length, simplified, Units} from '../../../../io/edit/page/geometry.js';

/** An L, longer than wide, with its corner at the lower left; y points down. */
const ELL = [[0, 0], [1, 0], [1, 3], [4, 3], [4, 4], [0, 4]];

/**
 * @param {number[]} found
 * @param {number[]} wanted
 */
function assertNear(found, wanted, tolerance = 1e-12) {
  assert.equal(found.length, wanted.length);
  assert.ok(distance(found, wanted) <= tolerance, `${found} is not ${wanted}`);
}

test('units convert to the file and back, with flipped axes, and round to what the file can hold', () => {
  const units = new Units({origin: [100, -20], scale: 250, signs: [1, -1]}, 6);
  assertNear(units.file([0.5, 0.2]), [225, -70]);
  assertNear(units.page([225, -70]), [0.5, 0.2]);
  assert.deepEqual(units.file([1 / 3, 0]), [183.3333, -20]);  // 6 digits for a shape of size 250
  assert.deepEqual(new Units({origin: [0, 0], scale: 0.001, signs: [1, 1]}, 6).file([1 / 3, 1]), [0.000333333, 0.001]);
});

test('points are inside of a concave polygon or not', () => {
  assert.ok(inside(ELL, [0.5, 2]) && inside(ELL, [3, 3.5]));
  const slanted = [[0, 0], [4, 1], [1, 3]];
  assert.ok(inside(slanted, [1.5, 1.5]) && inside(slanted, [3, 1]) && !inside(slanted, [0.3, 1.5]) && !inside(slanted, [3, 2]));
  assert.ok(!inside(ELL, [3, 2]) && !inside(ELL, [-0.1, 2]) && !inside(ELL, [0.5, 4.1]));
});

test('of a line the longest part inside is kept, with its ends on the outline', () => {
  assert.deepEqual(clipped(ELL, [[2, 1], [3, 1]]), []);
  const line = clipped(ELL, [[-1, 1], [0.5, 1], [2, 1], [3, 3.5], [3.5, 3.6], [6, 3.6]]);
  assertNear(line[0], [2.8, 3]);
  assertNear(line[line.length - 1], [4, 3.6]);
  assert.equal(line.length, 4);
  const through = clipped(ELL, [[-1, 3.5], [6, 3.5]]);
  assert.deepEqual(through, []);  // none of its points is inside
});

test('a point outside of a polygon is moved to its rim', () => {
  assertNear(/** @type {number[]} */ (atRim([[0, 0], [4, 0], [4, 3], [0, 3]], [7, 1], 0.2)), [3.8, 1]);
  for (const point of [[9, 9], [-1, -1], [2.9, 2.9], [-5, 1.5]]) {  // at corners, and in the corner of the L that is not part of it
    const place = atRim(ELL, point, 0.1);
    assert.ok(place && inside(ELL, place) && closest(ELL, place).away >= 0.07 - 1e-9 && closest(ELL, place).away < 0.31);
  }
  assert.equal(atRim([[0, 0], [4, 0], [4, 0.05], [0, 0.05]], [2, 1], 0.2), null);  // too narrow
});

test('the closest point of a polygon comes with its edge and share', () => {
  const {point, away, edge, share} = closest(ELL, [3, 1]);
  assertNear(point, [1, 1]);
  assert.equal(away, 2);
  assert.equal(edge, 1);
  assert.ok(Math.abs(share - 1 / 3) < 1e-12);
  assertNear(closest(ELL, [5, 2]).point, [4, 3]);
  assert.equal(closest(ELL, [-2, 3]).edge, 5);  // the edge that closes it
});

test('a simplified line stays within the tolerance and keeps its ends and corners', () => {
  const line = Array.from({length: 101}, (_, k) => [k / 50, Math.abs(1 - k / 50) + 0.004 * (k % 2)]);
  const simple = simplified(line, 0.01);
  assert.equal(simple.length, 3);
  assert.deepEqual([simple[0], simple[2]], [line[0], line[100]]);
  assertNear(simple[1], [1, 0]);
  assert.ok(simplified(line, 0.001).length > 50);
  assert.deepEqual(simplified([[0, 0], [1, 0]], 1), [[0, 0], [1, 0]]);
});

test('a finer line has the same course', () => {
  const line = finer([[0, 0], [4, 0], [4, 2]], 4);
  assert.equal(line.length, 9);
  assert.deepEqual(line[3], [3, 0]);
  assert.deepEqual(line[5], [4, 0.5]);
  assert.equal(length(line), 6);
});

test('names of files lose their folder, not their part', () => {
  assert.equal(fileName('/a/b/rose.svg#petals/1'), 'rose.svg#petals/1');
  assert.equal(fileName('C:\\a\\rose.svg'), 'rose.svg');
});
