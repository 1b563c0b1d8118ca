// Solves pairs of outlines with the demo's solver: node solve.js core.wasm pairs.json > maps.json
//
// A pair is {source, target, balance}, each outline [[x, y], …] with y up; a map is {z, u, faces, energy}.
import {readFileSync} from 'node:fs';
import {argv} from 'node:process';
import {load} from '../../web/core.js';
import {fromUnit, unitCurve} from '../../web/curve.js';
import {solve} from '../../web/search.js';

/** @import {DiscreteMap} from '../../web/map.js' */

/** @typedef {{source: number[][], target: number[][], balance: number}} Pair */

await load(readFileSync(argv[2]));
const pairs = /** @type {Pair[]} */ (JSON.parse(readFileSync(argv[3], 'utf8')));
const maps = pairs.map(({source, target, balance}) => {
  const [own, goal] = [source, target].map((outline) => unitCurve(Float64Array.from(outline.flat())));
  /** @type {string[]} */
  const stages = [];
  let map = /** @type {DiscreteMap | null} */ (null);
  solve(own.curve, goal.curve, {theta: balance, upright: 2}, 6000, (found, stage) => {
    map = found;
    stages.push(stage);
  });
  if (!map) throw new Error('no map was shown');
  const {mesh: {z, u, faces}, energy} = /** @type {DiscreteMap} */ (map);
  return {z: [...fromUnit(z, own.frame)], u: [...fromUnit(u, goal.frame)], faces: [...faces], energy, stages};
});
process.stdout.write(JSON.stringify(maps));
