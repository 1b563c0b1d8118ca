// Bundles the demo into one script that needs no server: node web/bundle.js FOLDER [CORE].
//
// Browsers load neither modules nor workers from file:// addresses, so the script contains everything: the worker as
// text, the core compressed and in base64, drawings and pictures.

import {readFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {argv} from 'node:process';
import {fileURLToPath} from 'node:url';
import {gzipSync} from 'node:zlib';
import {build, transform} from 'esbuild';

const TARGETS = ['chrome80', 'firefox113', 'safari16.4'];  // of style sheets

const FOLDER = dirname(fileURLToPath(import.meta.url));
const OPTIONS = /** @type {const} */ ({bundle: true, minify: true, format: 'iife', target: 'es2022', logLevel: 'warning', charset: 'utf8'});

const worker = await build({...OPTIONS, entryPoints: [join(FOLDER, 'worker.js')], write: false});
// the editor's style for panes applies in the demo only
const panes = readFileSync(join(FOLDER, '../io/edit/page/pane.css'), 'utf8'), own = readFileSync(join(FOLDER, 'try.css'), 'utf8');
const {code: style} = await transform(`#try { ${panes} }\n${own}`, {loader: 'css', minify: true, target: TARGETS});
const core = gzipSync(readFileSync(argv[3] ?? join(FOLDER, '../build/wasm/core.wasm')), {level: 9});
await build({
  ...OPTIONS,
  entryPoints: [join(FOLDER, 'try.js')],
  outdir: argv[2],
  loader: {'.svg': 'text', '.html': 'text', '.jpg': 'dataurl'},
  define: {STYLE: JSON.stringify(style), WORKER: JSON.stringify(worker.outputFiles[0].text), CORE: JSON.stringify(core.toString('base64'))},
});
