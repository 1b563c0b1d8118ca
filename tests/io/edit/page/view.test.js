import assert from 'node:assert/strict';
import {test} from 'node:test';

import {View} from '../../../../io/edit/page/view.js';

function shown() {
  const view = new View();
  view.width = 800;
  view.height = 500;
  view.showAll([-2, 1, 6, 3]);
  return view;
}

test('all of a box is visible and in the middle', () => {
  const view = shown();
  assert.deepEqual(view.point([400, 250]), [2, 2]);
  const [left, top] = view.pixel([-2, 1]), [right, bottom] = view.pixel([6, 3]);
  assert.ok(left > 0 && right < 800 && top > 0 && bottom < 500);
  assert.ok(right - left > 0.9 * 800 && Math.abs(800 - right - left) < 1e-9);
});

test('points and pixels are inverse', () => {
  const view = shown();
  const [x, y] = view.point(view.pixel([1.25, -3.5]));
  assert.ok(Math.abs(x - 1.25) < 1e-12 && Math.abs(y + 3.5) < 1e-12);
});

test('zooming keeps the point under the pointer, and has limits', () => {
  const view = shown(), before = view.point([100, 400]), zoom = view.zoom;
  view.zoomBy(3, [100, 400]);
  assert.ok(Math.abs(view.zoom - 3 * zoom) < 1e-9);
  view.point([100, 400]).forEach((value, k) => assert.ok(Math.abs(value - before[k]) < 1e-12));
  assert.equal(view.whole, false);
  view.zoomBy(1e9, [0, 0]);
  assert.equal(view.zoom, 2000 * zoom);
  view.zoomBy(1e-9, [0, 0]);
  assert.equal(view.zoom, 0.2 * zoom);
});

test('panning moves the shape with the pointer', () => {
  const view = shown(), [x, y] = view.pixel([1, 2]);
  view.pan(30, -7);
  const [newX, newY] = view.pixel([1, 2]);
  assert.ok(Math.abs(newX - x - 30) < 1e-9 && Math.abs(newY - y + 7) < 1e-9);
});
