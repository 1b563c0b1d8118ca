// Bundles the demo into one script that needs no server, and the window of the plug-in for Figma into one page:
// node web/bundle.js FOLDER [CORE].
//
// Browsers load neither modules nor workers from file:// addresses, so the script contains everything: the worker as
// text, the core compressed and in base64, drawings and pictures.

import {readFileSync, writeFileSync} from 'node:fs';
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
const constants = {STYLE: style, WORKER: worker.outputFiles[0].text, CORE: core.toString('base64')};
const define = Object.fromEntries(Object.entries(constants).map(([name, value]) => [name, JSON.stringify(value)]));
const page = {...OPTIONS, loader: /** @type {const} */ ({'.svg': 'text', '.html': 'text', '.jpg': 'dataurl', '.png': 'dataurl'}), define};
await build({...page, entryPoints: [join(FOLDER, 'try.js')], outdir: argv[2]});

// the plug-in for Figma has one file for its window
const {outputFiles: [script]} = await build({...page, entryPoints: [join(FOLDER, 'figma.js')], write: false});
const text = script.text.replaceAll('</script', '<\\/script');
writeFileSync(join(argv[2], 'figma.html'), `<!doctype html><html lang="en"><meta charset="utf-8"><title>iccm</title>
<style>body { margin: 12px; font: 14px/1.4 system-ui, sans-serif; } #try .figma-bar { display: flex; gap: 8px; margin: 0 0 8px; }</style>
<body><div id="try"></div><script>${text}</script></body></html>
`);
