import assert from 'node:assert/strict';
import {mock, test} from 'node:test';

import {Editor} from '../../../../io/edit/page/editor.js';
import {describeChange, History} from '../../../../io/edit/page/history.js';

/** @import {MapMessage, Pin, Scene} from '../../../../io/edit/page/types.d.ts' */

/** @returns {Pin} */
const pin = (/** @type {number} */ x, name = '') => ({name, weight: 1, source: [x, 1], target: [x, 2], turn: null});
/** @returns {Scene} */
const scene = (/** @type {Partial<Scene>} */ values = {}) => (
  {pins: [], strokes: [], rigid: [], balance: 1, turn: 0, fit: 'auto', ...values});

/** Stands for the storage of a browser. */
function storage() {
  /** @type {Map<string, string>} */
  const kept = new Map();
  return {
    kept, full: false,
    getItem(/** @type {string} */ key) { return kept.get(key) ?? null; },
    removeItem(/** @type {string} */ key) { kept.delete(key); },
    setItem(/** @type {string} */ key, /** @type {string} */ value) {
      if (this.full) throw new Error('the quota is exceeded');
      kept.set(key, value);
    },
  };
}

function begun(store = storage()) {
  /** @type {any[]} */
  const sent = [];
  const editor = new Editor((message) => sent.push(structuredClone(message)), new History(store, '/pair/'), () => {});
  editor.begin(scene());
  return {editor, sent, store};
}

/** @returns {MapMessage} */
const mapMessage = (/** @type {Partial<MapMessage>} */ values) => (
  {type: 'map', kind: 'full', seq: 1, ok: true, message: '', figures: {}, wrong: {}, ...values});

test('steps are undone and redone, and a new one replaces those that were undone', () => {
  const {editor} = begun();
  for (const x of [1, 2, 3]) {
    editor.scene.pins.push(pin(x));
    editor.commit();
  }
  editor.commit();  // nothing has changed: not a step
  editor.travel(-2);
  assert.deepEqual(editor.scene.pins.map(({source}) => source), [[1, 1]]);
  assert.ok(editor.history.canUndo && editor.history.canRedo);
  editor.travel(1);
  assert.equal(editor.scene.pins.length, 2);
  editor.scene.balance = 3;
  editor.commit();
  assert.equal(editor.history.canRedo, false);
  assert.deepEqual(editor.history.describe(), ['initial state', '1 pin placed', '1 pin placed', 'balance 3'].map(
    (text) => text.replace('1 pin', 'pin')));
  editor.travel(-9);
  assert.equal(editor.scene.balance, 3);
});

test('steps outlast a page that is loaded again, if it shows the same scene', () => {
  const {editor, store} = begun();
  editor.scene.pins.push(pin(1));
  editor.commit();
  const again = new History(store, '/pair/');
  again.begin(scene({pins: [pin(1)]}));
  assert.equal(again.canUndo, true);
  const other = new History(store, '/pair/');
  other.begin(scene({pins: [pin(4)]}));
  assert.equal(other.canUndo, false);
});

test('where the browser has no room the old steps are not kept', () => {
  const {editor, store} = begun();
  editor.scene.pins.push(pin(1));
  editor.commit();
  store.full = true;
  editor.scene.pins.push(pin(2));
  editor.commit();
  assert.equal(store.kept.size, 0);
  editor.travel(-1);
  assert.equal(editor.scene.pins.length, 1);
});

test('what a step changed is named', () => {
  const before = scene({pins: [pin(1), pin(2)]});
  const moved = structuredClone(before);
  moved.pins[1].target = [5, 5];
  const turned = structuredClone(before);
  turned.pins[0].turn = 20;
  const cases = /** @type {[Scene, string][]} */ ([
    [scene({pins: [pin(1)]}), 'pin removed'], [scene(), '2 pins removed'], [moved, 'pin 2 moved'],
    [turned, 'pin 1 rotated'], [scene({pins: [pin(1), pin(2, 'nose')]}), 'pin 2 named'],
    [scene({pins: [pin(3), pin(4)]}), '2 pins moved'], [{...before, turn: 'any'}, 'rotation any'],
    [{...before, rigid: ['#logo']}, 'rigid region drawn'], [before, 'no change'],
  ]);
  for (const [after, words] of cases) assert.equal(describeChange(before, after), words);
});

test('it is dirty until what is there is saved', () => {
  const {editor} = begun();
  editor.saved = JSON.stringify([[], [], []]);
  assert.equal(editor.dirty, false);
  editor.scene.pins.push(pin(1));
  assert.equal(editor.dirty, true);
  editor.scene.pins.pop();
  editor.scene.balance = 2;  // not in the file of pins and strokes
  assert.equal(editor.dirty, false);
});

test('of maps that come late only those that are still wanted count', () => {
  const {editor} = begun();
  editor.follow();
  editor.follow();
  assert.equal(editor.receive(mapMessage({kind: 'coarse', seq: 1})), true);
  assert.equal(editor.receive(mapMessage({kind: 'coarse', seq: 1})), true);  // as it comes to rest
  assert.equal(editor.receive(mapMessage({kind: 'coarse', seq: 0})), false);
  editor.solve();
  assert.equal(editor.busy, true);
  assert.equal(editor.receive(mapMessage({kind: 'full', seq: 2})), false);
  assert.equal(editor.receive(mapMessage({kind: 'coarse', seq: 2})), true);
  assert.equal(editor.busy, true);
  assert.equal(editor.receive(mapMessage({kind: 'error', seq: 3, ok: false, wrong: {pins: [1]}})), true);
  assert.deepEqual([editor.busy, editor.wrong], [false, {pins: [1]}]);
});

test('a map that takes the place of a converged one without a change is known as a replacement', () => {
  const {editor} = begun();
  editor.solve();
  editor.receive(mapMessage({kind: 'coarse', seq: 1}));  // as the map settles after a drag
  editor.receive(mapMessage({kind: 'full', seq: 1}));
  assert.equal(editor.replaced, false);
  editor.receive(mapMessage({kind: 'full', seq: 1, other: 'kept'}));
  assert.equal(editor.replaced, true);
  editor.solve();
  editor.receive(mapMessage({kind: 'full', seq: 2}));
  assert.equal(editor.replaced, false);
});

test('what is held still is solved for after a while, also where the map has not followed', () => {
  mock.timers.enable({apis: ['setTimeout']});
  const {editor, sent} = begun();
  editor.follow();
  mock.timers.tick(149);
  editor.follow();
  mock.timers.tick(149);
  assert.deepEqual(sent.map(({type}) => type), ['follow', 'follow']);
  mock.timers.tick(1);
  assert.deepEqual(sent.map(({type}) => type), ['follow', 'follow', 'solve']);
  editor.receive(mapMessage({kind: 'full', seq: 3}));
  editor.follow();
  editor.receive(mapMessage({kind: 'coarse', seq: 4, ok: false}));
  mock.timers.tick(1000);
  assert.deepEqual(sent.map(({type}) => type), ['follow', 'follow', 'solve', 'follow', 'solve']);
  editor.follow();
  editor.drop();  // at once
  assert.deepEqual(sent.slice(5).map(({type}) => type), ['follow', 'solve']);
  mock.timers.reset();
});

test('the server learns which of two maps was seen when the hand let go', () => {
  mock.timers.enable({apis: ['setTimeout']});
  const {editor, sent} = begun();
  const rest = () => {
    editor.follow();
    mock.timers.tick(150);
    editor.receive(mapMessage({kind: 'full', seq: sent.length}));
  };
  rest();
  editor.drop();
  assert.deepEqual([sent.at(-1).way, sent.at(-1).hand], ['kept', 'released']);
  rest();
  editor.receive(mapMessage({kind: 'full', seq: sent.length, other: 'fresh'}));  // it is offered
  editor.drop();
  assert.deepEqual([sent.at(-1).way, sent.at(-1).hand], ['kept', 'released']);
  rest();
  editor.receive(mapMessage({kind: 'full', seq: sent.length, other: 'kept'}));  // it took the place of the other
  assert.equal(editor.replaced, true);
  editor.drop();
  assert.deepEqual([sent.at(-1).way, sent.at(-1).hand], ['fresh', 'released']);
  editor.receive(mapMessage({kind: 'full', seq: sent.length, other: 'kept'}));
  const count = sent.length;
  editor.drop();  // a click that moves nothing
  assert.equal(sent.length, count);
  mock.timers.reset();
});

test('a map that reaches a pin while the hand rests replaces the one that could not', () => {
  mock.timers.enable({apis: ['setTimeout']});
  const {editor, sent} = begun();
  editor.follow();
  mock.timers.tick(150);
  editor.receive(mapMessage({kind: 'blocked', seq: 2, ok: false, wrong: {pins: [0]}}));
  editor.receive(mapMessage({kind: 'full', seq: 2}));
  assert.equal(editor.replaced, true);
  editor.drop();
  assert.deepEqual([sent.at(-1).way, sent.at(-1).hand], ['kept', 'released']);
  mock.timers.reset();
});

test('the server learns that the hand let go, before and while the map settles', () => {
  mock.timers.enable({apis: ['setTimeout']});
  const {editor, sent} = begun();
  editor.follow();
  editor.drop();
  editor.follow();
  mock.timers.tick(150);
  editor.drop();  // the converged map was requested, but is not shown yet
  assert.deepEqual(sent.map(({type, hand}) => `${type} ${hand ?? ''}`),
    ['follow ', 'solve released', 'follow ', 'solve resting', 'solve released']);
  mock.timers.reset();
});

test('a pin that stops short is moved in the same step, and its place is searched for in another one', () => {
  const {editor, sent} = begun();
  editor.scene.pins = [pin(1), pin(2)];
  editor.commit();
  const dragged = editor.scene.pins[1];
  dragged.target = [9, 9];
  editor.follow();
  editor.drop();
  const moved = {...pin(2), target: [5, 5]};
  editor.receive(mapMessage({kind: 'full', seq: sent.length, short: [1], pins: [pin(1), moved]}));
  assert.equal(editor.scene.pins[1], dragged);  // a drag of it goes on
  assert.deepEqual(dragged.target, [5, 5]);
  assert.deepEqual([editor.wanted(pin(1)), editor.wanted(dragged)], [null, {source: [2, 1], target: [9, 9]}]);
  assert.equal(editor.history.describe().length, 3);
  editor.search();
  assert.deepEqual([sent.at(-1).way, sent.at(-1).scene.pins[1].target, editor.searching], ['search', [9, 9], true]);
  assert.equal(editor.wanted(dragged), null);
  editor.stopSearch();
  assert.deepEqual([editor.searching, editor.scene.pins[1].target], [false, [5, 5]]);
  assert.deepEqual(editor.wanted(editor.scene.pins[1]), {source: [2, 1], target: [9, 9]});
  editor.stopSearch();  // there is none
  assert.deepEqual(editor.scene.pins[1].target, [5, 5]);
});

test('a pin that is released where the map was found not to follow is left short of it', () => {
  mock.timers.enable({apis: ['setTimeout']});
  const {editor, sent} = begun();
  editor.follow();
  mock.timers.tick(150);
  editor.receive(mapMessage({kind: 'blocked', seq: 2, ok: false, wrong: {pins: [0]}}));
  assert.deepEqual([editor.busy, editor.wrong], [false, {pins: [0]}]);
  editor.drop();
  assert.equal(sent.at(-1).hand, 'released');
  mock.timers.reset();
});

test('locked pins stay when others are moved together', () => {
  const {editor} = begun();
  editor.scene.pins = [pin(1), pin(2), pin(3)];
  editor.toggleSelected(0);
  editor.toggleSelected(2);
  assert.deepEqual([editor.movedWith(0), editor.movedWith(1)], [[0, 2], [1]]);
  editor.toggleLock(editor.scene.pins[2]);
  assert.deepEqual(editor.movedWith(0), [0]);
  editor.toggleLock(editor.scene.pins[2]);
  assert.deepEqual(editor.movedWith(2), [0, 2]);
});

test('rigid regions are shown as drawn as long as no map has them', () => {
  const {editor} = begun(), drawn = [[0, 0], [1, 0], [0, 1]];
  const region = {dilatation: 1, scale: 1, source: [], target: []};
  editor.scene.rigid.push(drawn, 'head');
  editor.commit();
  assert.deepEqual(editor.unmapped, [drawn]);
  editor.receive(mapMessage({seq: editor.asked, figures: {regions: [region, region]}}));
  assert.deepEqual(editor.unmapped, []);
  editor.commit();
  editor.scene.pins.push(pin(1));
  editor.commit();
  editor.receive(mapMessage({kind: 'error', seq: editor.asked}));
  assert.deepEqual(editor.unmapped, [drawn]);
});
