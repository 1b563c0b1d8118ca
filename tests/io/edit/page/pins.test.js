import assert from 'node:assert/strict';
import {test} from 'node:test';

import {actionsOf, removeFromStroke} from '../../../../io/edit/page/actions.js';
import {attraction} from '../../../../io/edit/page/attraction.js';
import {strokeOf} from '../../../../io/edit/page/gestures.js';
import {newPins} from '../../../../io/edit/page/landmarks.js';
import {isPossible, presets} from '../../../../io/edit/page/pin_settings.js';

/** @import {Scene} from '../../../../io/edit/page/types.d.ts' */

const OUTLINE = [[0, 0], [6, 0], [6, 4], [0, 4]];
const VIEW = {
  pixel: (/** @type {number[]} */ [x, y]) => [100 * x + 7, 100 * y],
  at: (/** @type {number[]} */ [x, y]) => [(x - 7) / 100, y / 100],
};

test('a corner attracts pins of the outline alone, within 8 pixels', () => {
  const shape = {outline: OUTLINE, corners: [[0, 0], [6, 4]]};
  assert.deepEqual(attraction([607 - 5, 400 + 6], true, shape, [], VIEW), [6, 4]);
  assert.equal(attraction([607 - 6, 400 + 6], true, shape, [], VIEW), null);
  assert.equal(attraction([607, 400], false, shape, [], VIEW), null);
});

test('mirror images of other pins attract, then the axis', () => {
  const shape = {outline: OUTLINE, corners: [], axis: 2.5};
  assert.deepEqual(attraction([407 + 3, 100 - 4], false, shape, [[1, 1], [2, 3]], VIEW), [4, 1]);
  assert.equal(attraction([407 + 4, 100 - 5], false, shape, [[1, 1]], VIEW), null);
  assert.deepEqual(attraction([257 + 3, 333], false, shape, [[1, 1]], VIEW), [2.5, 3.33]);
  assert.equal(attraction([257 + 3, 0], true, shape, [], VIEW), null);  // the axis does not attract pins on the outline
  assert.deepEqual(attraction([407 + 2, 0], true, shape, [[1, 0.01]], VIEW), [4, 0]);  // the image, on the outline
});

test('a stroke is cut at the outline, simplified, and closed if its ends meet', () => {
  const line = Array.from({length: 50}, (_, k) => [k / 5 - 1, 2 + 0.001 * (k % 2)]);
  const stroke = strokeOf(line, OUTLINE, 100);
  assert.ok(stroke && !stroke.closed && stroke.line.length === 2);
  assert.ok(Math.abs(stroke.line[0][0]) < 1e-6 && Math.abs(stroke.line[1][0] - 6) < 1e-6);
  const circle = Array.from({length: 60}, (_, k) => [3 + Math.cos(k / 9.6), 2 + Math.sin(k / 9.6)]);
  const region = strokeOf(circle, OUTLINE, 100);
  assert.ok(region && region.closed);
  const open = strokeOf(circle, null, 100);  // on a mesh strokes are never closed
  assert.ok(open && !open.closed);
  assert.equal(region.line.length, open.line.length - 1);  // the last point, at the first one, is removed
  assert.equal(strokeOf([[1, 1], [1.1, 1]], OUTLINE, 100), null);  // 10 pixels are too short for a stroke
  assert.equal(strokeOf([[9, 9], [10, 9]], OUTLINE, 100), null);
});

test('a point is removed on both sides, and a stroke of two points as a whole', () => {
  const stroke = (/** @type {number} */ a, /** @type {number} */ b) => ({
    name: '', weight: 1, ends: 'free',
    source: Array.from({length: a}, (_, k) => [k, 0]), target: Array.from({length: b}, (_, k) => [k, 1]),
  });
  const strokes = [stroke(4, 3), stroke(2, 5)];
  removeFromStroke(strokes, 0, 3);
  assert.deepEqual(strokes[0].source, [[0, 0], [1, 0], [2, 0]]);
  assert.deepEqual(strokes[0].target, [[0, 1], [1, 1], [2, 1]]);
  removeFromStroke(strokes, 1, 0);
  assert.equal(strokes.length, 1);
  removeFromStroke(strokes, 0, null);
  assert.equal(strokes.length, 0);
});

/** Actions with an editor and panes that record their calls. */
function recorded() {
  const pin = (/** @type {number} */ x) => ({name: '', weight: 1, source: [x, 0], target: [x, 10], turn: null});
  /** @type {Scene} */
  const scene = {pins: [pin(1), pin(2), pin(3)], strokes: [], rigid: [], balance: 1, turn: 0, fit: 'auto'};
  /** @type {string[]} */
  const done = [];
  /** @type {string[]} */
  const reports = [];
  const locked = new Set();
  const editor = {
    scene, suggested: [pin(7), pin(8)], selected: new Set(), isLocked: (/** @type {any} */ entry) => locked.has(entry),
    movedWith: (/** @type {number} */ number) => (number === 0 ? [0, 2] : [number]),
    commit: () => done.push('commit'), follow: () => done.push('follow'), changed: () => done.push('changed'),
  };
  const pane = {
    page: (/** @type {number[]} */ place) => place.map((value) => value / 10),
    moved: (/** @type {number[]} */ place, /** @type {number[]} */ by) => place.map((value, k) => value + 10 * by[k]),
  };
  const link = {ask: async () => ({points: [[5, 55]]})};
  const hello = {deforming: false};  // whether numbers may end with an angle
  const actions = actionsOf(/** @type {any} */ ({
    editor, link, panes: {source: pane, target: pane}, hello, report: (/** @type {string} */ text) => reports.push(text),
    setPen: () => {},
  }));
  return {actions, scene, done, reports, locked, editor, hello};
}

test('pins that are selected are dragged together', () => {
  const {actions, scene, done} = recorded();
  assert.equal(actions.drag('target', {kind: 'pins', number: 0}, [4, 11]), true);
  assert.deepEqual(scene.pins.map((pin) => pin.target), [[4, 11], [2, 10], [6, 11]]);
  assert.deepEqual(scene.pins[0].source, [1, 0]);
  assert.deepEqual(done, ['follow']);
});

test('locked pins are neither dragged nor rotated', () => {
  const {actions, scene, done, locked} = recorded();
  locked.add(scene.pins[1]);
  assert.equal(actions.drag('source', {kind: 'pins', number: 1}, [4, 11]), false);
  actions.turn({kind: 'pins', number: 1}, 30);
  assert.deepEqual([scene.pins[1].source, scene.pins[1].turn, done], [[2, 0], null, []]);
});

test('a pin is placed on the side that was clicked, and its partner where the map has it', async () => {
  const {actions, scene, done} = recorded();
  await actions.place('target', [9, 90]);
  assert.deepEqual(scene.pins[3], {name: '', weight: 1, source: [5, 55], target: [9, 90], turn: null});
  assert.deepEqual(done, ['commit']);
});

test('suggested pins that are accepted are suggested no longer', () => {
  const {actions, scene, editor} = recorded();
  actions.accept(1);
  assert.deepEqual([scene.pins[3].source, editor.suggested.map((pin) => pin.source)], [[8, 0], [[7, 0]]]);
});

test('typed places are taken if there are as many numbers as before', () => {
  const {actions, scene, done, reports} = recorded();
  actions.move({kind: 'pins', number: 1}, [1, 2, 3]);
  assert.deepEqual([scene.pins[1].target, done], [[2, 10], []]);
  assert.match(reports[0], /4 .*x, y → x, y/);
  actions.move({kind: 'pins', number: 1}, [1, 2, 3, 4]);
  assert.deepEqual([scene.pins[1].source, scene.pins[1].target, done], [[1, 2], [3, 4], ['commit']]);
});

test('an angle may be typed after the places of a pin that deforms', () => {
  const {actions, scene, done, reports, hello} = recorded();
  hello.deforming = true;
  actions.move({kind: 'pins', number: 1}, [1, 2, 3, 4, 1000]);
  assert.deepEqual([scene.pins[1].target, done, reports.length], [[2, 10], [], 1]);
  actions.move({kind: 'pins', number: 1}, [1, 2, 3, 4, -90]);
  assert.deepEqual([scene.pins[1].target, scene.pins[1].turn, done], [[3, 4], -90, ['commit']]);
});

test('what is said of a pin is a step of its own, or part of a drag; nothing of a locked one', () => {
  const {actions, scene, done, locked} = recorded();
  actions.hold({kind: 'pins', number: 1}, {radius: 0.5}, false);
  actions.hold({kind: 'pins', number: 1}, {tolerance: 0.25});
  assert.deepEqual([scene.pins[1].radius, scene.pins[1].tolerance, done], [0.5, 0.25, ['follow', 'commit']]);
  locked.add(scene.pins[1]);
  actions.hold({kind: 'pins', number: 1}, {radius: 3});
  assert.deepEqual([scene.pins[1].radius, done.length], [0.5, 2]);
});

test('presets keep the rotation; pulling takes a third of what was chosen, to four digits', () => {
  const pin = {name: '', weight: 1, source: [1, 2], target: [3, 4], turn: 30, radius: 7, scale: 2};
  const found = presets(pin, {radius: 4, tolerance: 0.5});
  assert.deepEqual(found.pull, {radius: 1.333, tolerance: 0.1667, turn: 30, scale: null});
  assert.deepEqual(found.exact, {radius: 0, tolerance: null, turn: 30, scale: null});
});

test('settings of pins have ranges', () => {
  for (const [name, value] of /** @type {const} */ ([['radius', 0], ['tolerance', 0.1], ['turn', -360], ['scale', 2]])) {
    assert.ok(isPossible(name, value), name);
  }
  for (const [name, value] of /** @type {const} */ ([
    ['radius', -1], ['tolerance', 0], ['turn', 361], ['turn', NaN], ['scale', 0], ['scale', NaN],
  ])) assert.ok(!isPossible(name, value), `${name} ${value}`);
});

test('pins of a file that are there already are not added again', () => {
  const pin = (/** @type {number} */ x, name = '') => ({name, weight: 1, source: [x, 1], target: [x, 2], turn: null});
  assert.deepEqual(newPins([pin(1), pin(2, 'nose')], [pin(2), pin(3)]), [pin(3)]);
});
