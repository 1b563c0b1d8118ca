// Solves pairs of outlines with the demo's solver: node solve.js core.wasm pairs.json > maps.json
//
// A pair is {source, target, balance, pins}, each outline [[x, y], …] with y up, each pin [x, y, x, y] in the source and in
// the target; a map is {z, u, faces, energy}, the energy with that of the pins.
import {readFileSync} from 'node:fs';
import {argv} from 'node:process';
import {load} from '../../web/core.js';
import {fromUnit, toUnit, unitCurve} from '../../web/curve.js';
import {weightsOf} from '../../web/map.js';
import {Pins} from '../../web/pins.js';
import {solve} from '../../web/search.js';

/** @import {DiscreteMap} from '../../web/map.js' */

/** @typedef {{source: number[][], target: number[][], balance: number, pins: number[][]}} Pair */

await load(readFileSync(argv[2]));
const pairs = /** @type {Pair[]} */ (JSON.parse(readFileSync(argv[3], 'utf8')));
const maps = pairs.map(({source, target, balance, pins: given}) => {
  const [own, goal] = [source, target].map((outline) => unitCurve(Float64Array.from(outline.flat())));
  const [here, there] = [own, goal].map(({frame}, side) => toUnit(Float64Array.from(given.flatMap((pin) => pin.slice(2 * side, 2 * side + 2))), frame));
  const pins = given.length ? Pins.of(here, there, [own.curve, goal.curve]) : null;
  /** @type {string[]} */
  const stages = [];
  let map = /** @type {DiscreteMap | null} */ (null);
  solve(own.curve, goal.curve, weightsOf(balance, pins), 6000, (found, stage) => {
    map = found;
    stages.push(stage);
  });
  if (!map) throw new Error('no map was shown');
  const {mesh: {z, u, faces}, energy} = /** @type {DiscreteMap} */ (map);
  return {z: [...fromUnit(z, own.frame)], u: [...fromUnit(u, goal.frame)], faces: [...faces], energy, stages};
});
process.stdout.write(JSON.stringify(maps));
