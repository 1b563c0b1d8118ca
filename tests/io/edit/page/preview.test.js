// The map is displaced around a dragged pin, without folds, and outlines and other pins stay where they are.

import assert from 'node:assert/strict';
import {test} from 'node:test';
import {carry} from '../../../../io/edit/page/carry.js';
import {displaced, Preview} from '../../../../io/edit/page/preview.js';

const SIDE = 24;  // cells of a grid over the square from 0 to 1
const SQUARE = {outline: [[0, 0], [1, 0], [1, 1], [0, 1]], holes: [], bounds: [0, 0, 1, 1]};

/** Return the floats of a map from the square, reduced by a half and moved, onto the square. */
function grid() {
  const floats = [];
  for (let i = 0; i < SIDE; i++) {
    for (let j = 0; j < SIDE; j++) {
      const [a, b, c, d] = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map((cell) => cell.map((n) => n / SIDE));
      for (const corners of [[a, b, c], [a, c, d]]) {
        floats.push(...corners.flat(), ...corners.flat().map((value) => value / 2 + 3), ...Array(6).fill(0));
      }
    }
  }
  return Float32Array.from(floats);
}

const SHAPES = {source: {...SQUARE, outline: SQUARE.outline.map((p) => p.map((v) => v / 2 + 3)), bounds: [3, 3, 3.5, 3.5]}, target: SQUARE};

/**
 * @param {Float32Array} floats
 * @param {number} first
 */
function areas(floats, first) {
  const found = [];
  for (let k = first; k < floats.length; k += 18) {
    const [ax, ay, bx, by, cx, cy] = floats.subarray(k, k + 6);
    found.push((bx - ax) * (cy - ay) - (cx - ax) * (by - ay));
  }
  return found;
}

/**
 * Return how far the map takes a point of the source from a place.
 * @param {Float32Array} floats
 * @param {number[]} source
 * @param {number[]} place
 */
function away(floats, source, place) {
  const [x, y] = carry(floats, source, 'source') ?? [Infinity, Infinity];
  return Math.hypot(x - place[0], y - place[1]);
}

for (const side of /** @type {const} */ (['target', 'source'])) {
  test(`a pin whose end in the ${side} is dragged is seen where the hand is`, () => {
    const preview = new Preview(SHAPES), map = grid(), other = side === 'target' ? [0.8, 0.75] : [3.4, 3.375];
    preview.take(map, 0);
    const start = side === 'target' ? [0.3, 0.4] : [3.15, 3.2], scale = side === 'target' ? 1 : 0.5;
    /** @type {Float32Array} */
    let seen = map;
    for (let k = 0; k < 10; k++) {
      const source = side === 'target' ? [3.15, 3.2] : [start[0] + 0.02 * scale * k, start[1] + 0.01 * scale * k];
      seen = preview.move({seq: k + 1, side, source, by: [0.02 * scale, 0.01 * scale], others: [other]}) ?? seen;
    }
    const dragged = [start[0] + 0.2 * scale, start[1] + 0.1 * scale];
    const [source, place] = side === 'target' ? [[3.15, 3.2], dragged] : [dragged, [0.3, 0.4]];
    assert.ok(away(seen, source, place) < 0.01);
    assert.ok(away(seen, side === 'target' ? [3.4, 3.375] : other, [0.8, 0.75]) < 1e-6);
    assert.ok(Math.min(...areas(seen, 0)) > 0 && Math.min(...areas(seen, 6)) > 0);
    for (const edge of [[0, 0.5], [0.5, 0], [1, 0.3]]) {
      const at = [edge[0] / 2 + 3, edge[1] / 2 + 3];
      assert.ok(away(seen, at, edge) < 1e-6);
    }
  });
}

test('what the server has answered is not displaced again, and what it refuses is withdrawn', () => {
  const preview = new Preview(SHAPES), map = grid(), side = /** @type {const} */ ('target'), pin = {side, source: [3.25, 3.25], others: []};
  preview.take(map, 0);
  for (const seq of [1, 2, 3]) preview.move({...pin, seq, by: [0.03, 0]});
  const answered = displaced(map, 0, [0.5, 0.5], [0.06, 0], 0.3), seen = preview.take(answered, 2);
  const [x, y] = carry(answered, pin.source, 'source') ?? [0, 0];
  assert.ok(away(seen, pin.source, [x + 0.03, y]) < 2e-3);
  assert.equal(preview.take(answered, 3), answered);
  preview.move({...pin, seq: 4, by: [0.03, 0]});
  assert.equal(preview.withdraw(), answered);
});

test('close to the outline nothing is displaced', () => {
  const preview = new Preview(SHAPES);
  preview.take(grid(), 0);
  assert.equal(preview.move({seq: 1, side: 'target', source: [3.001, 3.25], by: [0.01, 0], others: []}), null);
});
