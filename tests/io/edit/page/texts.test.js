import assert from 'node:assert/strict';
import {test} from 'node:test';

import {figureRows, rounded} from '../../../../io/edit/page/figures.js';
import {leftSentence} from '../../../../io/edit/page/history.js';
import {pinHue, strokeHue} from '../../../../io/edit/page/hues.js';
import {readFrame} from '../../../../io/edit/page/link.js';
import {numbersIn} from '../../../../io/edit/page/list.js';
import {formatOf} from '../../../../io/edit/page/exporting.js';

test('numbers are read from what is typed', () => {
  assert.deepEqual(numbersIn('250, -150.5 -> +.5 1e-3 ∠ 30°'), [250, -150.5, 0.5, 0.001, 30]);
  assert.deepEqual(numbersIn('nose'), []);
});

test('figures have three digits, and large ones none after the point', () => {
  assert.deepEqual([0.123456, 12.3456, 1234.56, null].map(rounded), ['0.123', '12.3', '1235', '–']);
});

test('each figure has a row, and those that are not known a dash', () => {
  const rows = figureRows({
    stretch: {p50: 1.02, p95: 1.5, max: 210.4}, scale: {within2: 0.987}, injective: {certified: true, share: 1},
    shown: 0.95, covered: 0.5, regions: [{dilatation: 1.00049, scale: 0.5, source: [], target: []}],
  });
  const values = Object.fromEntries(rows.map(([name, , value]) => [name, value]));
  assert.deepEqual(values, {
    stretch: '1.02   1.5   210', dilatation: null, scale: '98.7 %', rotation: null, outline: null,
    'one-to-one': '100.00 %', shown: '95.0 %', covered: '50.0 %', 'rigid 1': '1.000   × 0.5',
  });
  assert.equal(figureRows({turn: -0.04})[3][2], '0.0°');
  const partial = figureRows({left_out: 0.25, uncovered: 0, injective: {certified: false, share: 0.5}});
  assert.deepEqual(partial.slice(5).map(([, , value]) => value), ['not certified', '25.0 %', '0.0 %']);
});

test('binary frames have a JSON text and numbers', () => {
  const text = new TextEncoder().encode('{"seq": 7}  '), data = new ArrayBuffer(4 + text.length + 8);
  new DataView(data).setUint32(0, text.length, true);
  new Uint8Array(data, 4, text.length).set(text);
  new Float32Array(data, 4 + text.length).set([0.5, -2]);
  assert.deepEqual(readFrame(data), {head: {seq: 7}, floats: new Float32Array([0.5, -2])});
});

test('the format is what the name of the file ends in', () => {
  const formats = ['', '.png', '.tif', '.stmap.exr'];
  assert.equal(formatOf('A.PNG', formats), '.png');
  assert.equal(formatOf('map.stmap.exr', formats), '.stmap.exr');
  assert.equal(formatOf('map.exr', formats), '');
});

test('the first pins, and the first strokes, have hues that differ', () => {
  const hues = Array.from({length: 8}, (_, k) => pinHue(k));
  for (const a of hues) for (const b of hues) assert.ok(a === b || Math.abs(a - b) > 15);
  const strokes = Array.from({length: 4}, (_, k) => strokeHue(k));
  for (const a of hues) for (const b of strokes) assert.ok(Math.abs(a - b) > 10, `${a} ${b}`);
});

test('what an earlier session left says what it is and when it was changed', () => {
  const when = new Date(2026, 10, 3, 9, 5), nothing = {pins: [], strokes: [], rigid: [], balance: 1, turn: 0, fit: 'auto'};
  /** @type {import('../../../../io/edit/page/types.d.ts').Pin} */
  const pin = {name: '', weight: 1, source: [0, 0], target: [1, 1], turn: null};
  assert.match(leftSentence({...nothing, pins: [pin, pin], rigid: ['eye']}, when), /^2 pins and 1 rigid region of .*2026/);
  assert.match(leftSentence({...nothing, rigid: ['eye']}, when), /^1 rigid region of .* was /);
  assert.match(leftSentence(nothing, when), /2026/);
});
