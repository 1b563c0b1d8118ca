// iccm edit: what is edited, its history, and what goes between the two shapes, the list and the server.

import {Link} from './link.js';
import {called, finer, simplified} from './geometry.js';
import {DRAWN, Pane} from './pane.js';
import {choose} from './open.js';
import {figures, list} from './panel.js';
import {past} from './past.js';

const $ = (id) => document.getElementById(id);
const copy = (value) => JSON.parse(JSON.stringify(value));
const panes = {};
let scene = null, saved = '', names = {}, chosen = null, wrong = {};
let history = [], present = 0;
let kept = '', letter = 'B';
let suggested = [], regions = [];
const selected = new Set(), locks = new Set();  // numbers of pins; places of those that stay
let seq = 0, shown = 0, kind = '', blinking = 0;
let resting = 0, solving = 0;
const BLINK = 700;  // milliseconds of each
const REST = 250;   // milliseconds after which what is held still is solved for as if it were let go of

// ---------------------------------------------------------------- history

const content = ({pins, strokes, rigid}) => JSON.stringify([pins, strokes, rigid]);
const dirty = () => scene !== null && content(scene) !== saved;

/** What was changed becomes a step that can be undone, and the map is made anew. */
function commit(solve = true) {
  const text = JSON.stringify(scene);
  if (text !== history[present]) {
    history = [...history.slice(0, present + 1), text];
    present = history.length - 1;
    remember();
  }
  if (solve) ask('solve');
  refresh();
}

function travel(steps) {
  if (present + steps < 0 || present + steps >= history.length) return;
  present += steps;
  selected.clear();
  remember();
  scene = JSON.parse(history[present]);
  ask('solve');
  refresh();
}

const showPast = () => past($('past'), history, present, (number) => travel(number - present));

/** The history outlasts a page that is loaded again. */
function remember() {
  showPast();
  try {
    sessionStorage.setItem(location.pathname, JSON.stringify({history, present}));
  } catch {
    sessionStorage.removeItem(location.pathname);  // too long: it begins with what is there
  }
}

function remembered() {
  const kept = JSON.parse(sessionStorage.getItem(location.pathname));
  const same = kept && content(JSON.parse(kept.history[kept.present])) === content(scene);
  ({history, present} = same ? kept : {history: [JSON.stringify(scene)], present: 0});
  showPast();
}

// ---------------------------------------------------------------- the server

function ask(type, way) {
  seq += 1;
  link.say({type, seq, scene, way});
  clearTimeout(resting);
  if (type === 'follow') return;
  solving = seq;
  document.body.classList.add('busy');
}

function hear(message, floats) {
  if (message.type === 'hello') return begin(message);
  if (message.type === 'error') return say(message.message, true);
  if (message.kind === 'coarse' && message.seq <= shown) return;
  if (message.kind !== 'coarse' && message.seq !== seq) return;
  shown = message.seq;
  kind = message.kind;
  wrong = message.wrong;
  if (kind !== 'coarse') document.body.classList.remove('busy');
  panes.target.hurry(kind === 'coarse');
  if (message.outlines?.length) panes.target.reshape(message.outlines);
  if (floats) {
    panes.target.painter.map(floats);
    panes.target.redraw();
  }
  if (kind !== 'error') figures($('figures').tBodies[0], kind, message.figures);
  if (kind !== 'error') regions = message.figures.regions ?? [];
  if (kind === 'full') notes(message.figures.notes);
  $('other').hidden = !message.other;
  $('other').dataset.way = message.other;
  $('other').textContent = message.other === 'kept' ? 'Back to the one gone on from' : 'Show the map from scratch';
  if (message.command) $('command').textContent = message.command;
  if (message.other === 'fresh') message.message += ' From scratch another one is found.';
  say(kind === 'error' ? `${message.message}. The map is the last good one.` : message.message, !message.ok);
  refresh();
}

function say(text, bad = false) {
  $('status').textContent = text || 'Following…';
  document.body.classList.toggle('bad', bad);
}

function notes(found) {
  $('notes').replaceChildren(...[...names.notes, ...found].map((text) => {
    const item = document.createElement('li');
    item.textContent = text;
    return item;
  }));
}

const link = new Link(hear, (reason) => {
  say(reason, true);
  document.body.classList.add('ended');
});

// ---------------------------------------------------------------- begin

async function begin(hello) {
  if (hello.empty) return choose(true);
  names = hello;
  const first = scene === null;
  if (first) {
    scene = hello.scene;
    remembered();
    try {
      for (const side of ['source', 'target']) panes[side] = new Pane(side, $(side), hello[side], hello, does);
      await Promise.all(Object.values(panes).map((pane) => pane.load()));
    } catch (error) {
      return say(error.message, true);
    }
    sharp();
    look(hello);
    $('own').disabled = $('blink').disabled = !panes.source.own && !panes.target.own;
    own($('own').value);
    $('how').disabled = hello.source.mesh || hello.target.mesh || hello.deforming;
    for (const id of ['any', 'suggest', 'draw']) $(id).disabled = hello.deforming;
    notes([]);
    Object.assign($('file'), {value: hello.constraints});
    Object.assign($('picture'), {value: hello.picture});
    Object.assign($('ending'), {value: hello.ending});
    for (const id of ['file', 'save-as']) $(id).disabled = hello.drawn;
    const [source, target] = [hello.source.name, hello.target.name];
    $('title').textContent = hello.deforming ? `${called(source)}, deformed` : `${called(source)} → ${called(target)}`;
    $('title').title = `${source} → ${target}`;
    document.title = `${$('title').textContent} · iccm edit`;
    globalThis.iccm = {panes, get scene() { return scene; }, get kind() { return kind; }, get seq() { return [seq, shown]; }};
  }
  document.body.classList.remove('ended');
  saved = content(hello.saved);
  $('left').hidden = !hello.left || content(hello.left) === content(scene);
  ask('solve');
  refresh();
}

/** A window that comes to a finer or coarser screen is painted anew. */
function sharp() {
  for (const pane of Object.values(panes)) pane.resized();
  matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener('change', sharp, {once: true});
}

async function look(hello) {
  const answer = await fetch(`texture.png?side=${panes.source.painter.most}`);
  const image = await createImageBitmap(await answer.blob(), {colorSpaceConversion: 'none', premultiplyAlpha: 'none'});
  const {source, target} = panes, bounds = hello.source.bounds;
  const how = {box: hello.source.box, edge: hello.edge, filter: hello.filter};
  for (const pane of [source, target]) {
    pane.painter.texture(image, how);
    pane.overlay.step = Math.max(bounds[2] - bounds[0], bounds[3] - bounds[1]) / 16;
    pane.redraw();
  }
}

function refresh() {
  if (!panes.target) return;
  for (const pane of Object.values(panes)) {
    pane.scene = {...scene, wrong, suggested, selected, locked, regions};
    pane.redraw(false);
  }
  list($('list'), {...scene, locked, regions}, wrong, does);
  $('accept').hidden = $('dismiss').hidden = suggested.length === 0;
  $('none').hidden = scene.pins.length + scene.strokes.length + scene.rigid.length > 0;
  $('undo').disabled = present === 0;
  $('redo').disabled = present === history.length - 1;
  $('balance').value = Math.log10(scene.balance);
  $('balance-value').value = scene.balance.toFixed(2);
  $('any').checked = scene.turn === 'any';
  $('turn').disabled = scene.turn === 'any' || names.deforming;
  if (scene.turn !== 'any') $('turn').value = scene.turn;
  $('turn-value').value = scene.turn === 'any' ? 'any' : `${scene.turn}°`;
  $('how').value = scene.fit;
  $('how-hint').textContent = hints[scene.fit];
  document.body.classList.toggle('dirty', dirty());
}

const hints = {
  auto: 'without pins the cheapest of the others; with pins the outlines, or the tightest frames around all parts',
  frame: 'gaps between parts, and bays, are closed as far as that costs less',
  whole: 'every outline onto its partner’s, limbs and bays as well',
  contain: 'bays of the source open where the target has none; the map follows when you let go',
  cover: 'what the target has no room for is left out; the map follows when you let go',
};

// ---------------------------------------------------------------- what happens on the shapes and in the list

const ends = ({source, target}) => JSON.stringify([source, target]);
const locked = (entry) => locks.has(ends(entry));

/** The pins that go with one: all that are selected, if it is; none that are locked. */
const together = (number) => (selected.has(number) ? [...selected] : [number]).filter((k) => !locked(scene.pins[k]));

const does = {
  select({number}) {
    if (!selected.delete(number)) selected.add(number);
    refresh();
  },
  lock({number}) {
    const key = ends(scene.pins[number]);
    if (!locks.delete(key)) locks.add(key);
    refresh();
  },
  accept(...numbers) {
    scene.pins.push(...suggested.filter((_, k) => numbers.includes(k)));
    suggested = suggested.filter((_, k) => !numbers.includes(k));
    commit();
  },
  async place(side, point) {
    const answer = await link.ask({type: 'place', side, points: [point]});
    if (answer.error) return say(answer.error, true);
    const [source, target] = side === 'source' ? [point, answer.points[0]] : [answer.points[0], point];
    scene.pins.push({name: '', weight: 1, source, target, turn: null});
    return commit();
  },
  async stroke(side, points, closed) {
    pen(false);
    if (closed && side === 'target') return say('Rigid regions are drawn in the source: close the stroke there.', true);
    if (closed) {
      scene.rigid.push(points);
      return commit();
    }
    const other = side === 'source' ? panes.target : panes.source;
    const answer = await link.ask({type: 'place', side, points: finer(points)});
    if (answer.error) return say(answer.error, true);
    const image = simplified(answer.points.map((p) => other.page(p)), DRAWN / other.view.zoom);
    const there = image.map((p) => other.units.file(p)), [source, target] = side === 'source' ? [points, there] : [there, points];
    scene.strokes.push({name: '', weight: 1, source, target, ends: 'free'});
    return commit();
  },
  drag(side, {kind: group, number, point}, place) {
    const entry = scene[group][number], pane = panes[side];
    if (locked(entry)) return false;
    if (group === 'strokes') entry[side][point] = place;
    else if (pane.surface) entry[side] = place;
    else {
      const from = pane.page(entry[side]), by = pane.page(place).map((value, k) => value - from[k]);
      for (const k of together(number)) scene.pins[k][side] = k === number ? place : pane.moved(scene.pins[k][side], by);
    }
    followed();
    return true;
  },
  /** By how many degrees the shape turns about a pin; null: as it likes. */
  turn({number}, degrees) {
    if (locked(scene.pins[number])) return;
    scene.pins[number].turn = degrees;
    followed();
  },
  drop: () => commit(seq !== solving),
  remove({kind: group, number, point}, whole = false) {
    const entry = scene[group][number];
    if (!entry) return;
    if (group !== 'rigid' && locked(entry)) return say('It is locked: press L on it, or Lock in the list, to move or remove it.', true);
    const few = group === 'strokes' && Math.min(entry.source.length, entry.target.length) <= 2;
    if (group === 'rigid') scene.rigid.splice(number, 1);
    else if (group === 'pins' && !whole) for (const k of together(number).sort((a, b) => b - a)) scene.pins.splice(k, 1);
    else if (whole || few) scene[group].splice(number, 1);
    else for (const side of ['source', 'target']) if (entry[side].length > point) entry[side].splice(point, 1);
    selected.clear();
    const {activeElement: from} = document, pane = from.closest('.pane') ?? $('source');
    commit();
    requestAnimationFrame(() => { if (!from.isConnected) pane.focus(); });
  },
  rename({kind: group, number}, name) {
    scene[group][number].name = name;
    commit(false);
  },
  /** Places that were typed: of the source, then of the target, and degrees where the shape turns about a pin. */
  move({kind: group, number}, typed) {
    const entry = scene[group][number], split = entry.source.length, all = split + entry.target.length;
    if (locked(entry)) return refresh();
    if (typed.length !== all && !(names.deforming && typed.length === all + 1)) return say('write as many numbers as before', true);
    Object.assign(entry, {source: typed.slice(0, split), target: typed.slice(split, all), turn: typed[all] ?? null});
    commit();
  },
  choose(item) { chosen = item; },
  hover(item) {
    for (const element of document.querySelectorAll('.handle')) {
      const key = item && `${item.kind === 'pins' ? 'pin' : 'stroke'} ${item.number}`;
      element.classList.toggle('lit', Boolean(key) && `${element.dataset.key} `.startsWith(`${key} `));
    }
  },
};

/** The map follows, and comes to rest when nothing moves. */
function followed() {
  ask('follow');
  resting = setTimeout(() => { if (!document.body.classList.contains('bad')) ask('solve'); }, REST);
  refresh();
}

function pen(down) {
  for (const pane of Object.values(panes)) if (!down && pane.drawing) Object.assign(pane, {drawing: null}).redraw();
  for (const pane of Object.values(panes)) pane.pen = down;
  $('pen').setAttribute('aria-pressed', down);
  document.body.classList.toggle('pen', down);
}

function overlay(name, on) {
  $(name).checked = on;
  $('legend').hidden = !$('stretch').checked;
  for (const pane of Object.values(panes)) {
    pane.overlay[name] = on;
    pane.redraw();
  }
}

$('other').onclick = () => { saved = ''; ask('solve', $('other').dataset.way); };  // the file holds which
/** The state kept as A and the one that is seen change places. */
function swap() {
  const here = JSON.stringify(scene);
  $('ab').textContent = kept === '' ? 'A kept' : letter === 'A' ? 'Seen: B' : 'Seen: A';
  if (kept !== '') {
    letter = letter === 'A' ? 'B' : 'A';
    scene = JSON.parse(kept);
    commit();
  }
  kept = here;
}

/** How much of the files' own drawings is seen, from 0 to 1. */
function own(share) {
  for (const pane of Object.values(panes)) {
    pane.overlay.own = Number(share);
    pane.redraw();
  }
}

function blink() {
  const on = $('blink').getAttribute('aria-pressed') !== 'true';
  $('blink').setAttribute('aria-pressed', on);
  clearInterval(blinking);
  if (!on) return own($('own').value);
  let drawing = 1;
  own(drawing);
  blinking = setInterval(() => own(drawing = 1 - drawing), BLINK);
}

$('suggest').onclick = async () => {
  const answer = await link.ask({type: 'suggest', scene});
  if (answer.error) return say(answer.error, true);
  suggested = answer.pins;
  say(suggested.length ? `${suggested.length} suggested: click those you want.` : 'No corners or names that both drawings have.');
  refresh();
};
$('accept').onclick = () => does.accept(...suggested.keys());
$('dismiss').onclick = () => { suggested = []; refresh(); };
$('ab').onclick = swap;
for (const button of document.querySelectorAll('[data-balance]')) {
  button.onclick = () => { scene.balance = Number(button.dataset.balance); commit(); };
}
$('own').oninput = () => own($('own').value);
$('blink').onclick = blink;
$('go-on').onclick = () => { $('left').hidden = true; scene = names.left; commit(); };
$('forget').onclick = () => { $('left').hidden = true; link.ask({type: 'forget'}); };
$('pen').onclick = () => pen(!panes.source.pen);
$('undo').onclick = () => travel(-1);
$('redo').onclick = () => travel(1);
$('fit').onclick = () => Object.values(panes).forEach((pane) => pane.showAll());
for (const name of ['grid', 'stretch']) $(name).onchange = (event) => overlay(name, event.target.checked);
$('how').onchange = () => { scene.fit = $('how').value; commit(); };
$('balance').oninput = () => { scene.balance = Number((10 ** $('balance').value).toFixed(2)); ask('follow'); refresh(); };
$('balance').onchange = () => commit();
$('turn').oninput = () => { scene.turn = Number($('turn').value); ask('solve'); refresh(); };
$('turn').onchange = () => commit();
$('any').onchange = () => { scene.turn = $('any').checked ? 'any' : Number($('turn').value); commit(); };

// ---------------------------------------------------------------- files

/** Asks the server to write, and the user whether to replace what is there. */
async function write(message) {
  const asked = {...message, scene};
  const before = content(scene);
  let answer = await link.ask(asked);
  if (answer.exists) {
    if (!confirm(`${answer.exists.join(', ')}: the file exists. Replace it?`)) return;
    answer = await link.ask({...asked, replace: true});
  }
  if (answer.error) return say(answer.error, true);
  if (answer.command) $('command').textContent = answer.command;
  if (message.type === (names.drawn ? 'draw' : 'save')) saved = before;
  say([`Wrote ${answer.written.join(', ')}.`, answer.message, ...(answer.notes ?? [])].filter(Boolean).join(' '));
  refresh();
}

const draw = () => write({type: 'draw', name: $('ending').value});
const save = () => (names.drawn ? draw() : write({type: 'save', name: $('file').value}));
$('save').onclick = save;
$('more').onclick = () => { $('export').showModal(); told(); };
/** The command that writes what the dialog would. */
async function told() {
  const name = $('picture').value, size = Math.round(Number($('size').value)) || 1024;
  const format = [...$('format').options].find(({value}) => value && name.toLowerCase().endsWith(value));
  $('format').value = format?.value ?? '';
  if (!name) return;
  const answer = await link.ask({type: 'export', scene, name, size, write: false});
  $('export-command').textContent = answer.command ?? answer.error;
}
$('picture').oninput = $('size').oninput = told;
$('format').onchange = () => {
  $('picture').value = $('picture').value.replace(/(\.stmap)?\.[^.]*$/, '') + $('format').value;
  told();
};
$('help').onclick = () => $('keys').showModal();
$('export').onclose = () => {
  const does = {
    save,
    export: () => write({type: 'export', name: $('picture').value, size: Math.round(Number($('size').value)) || 1024}),
    draw,
  };
  does[$('export').returnValue]?.();
  $('export').returnValue = '';
};
$('copy').onclick = async () => {
  await navigator.clipboard.writeText($('command').textContent);
  say(dirty() ? 'Copied. It reads what Save writes: save first.' : 'Copied.');
};
$('choose').onclick = () => choose(false, () => { saved = content(scene); });  // the server keeps what is not saved
addEventListener('beforeunload', (event) => { if (dirty()) event.preventDefault(); });

// ---------------------------------------------------------------- keys

addEventListener('keydown', (event) => {
  const control = event.ctrlKey || event.metaKey, key = event.key.toLowerCase();
  if (document.querySelector('dialog[open]')) return;
  const typing = event.target.matches('input[type=text], input[type=number]');
  const keys = control
    ? {z: () => travel(event.shiftKey ? 1 : -1), y: () => travel(1), s: save,
      a: () => { scene.pins.forEach((_, k) => selected.add(k)); refresh(); }}
    : typing ? {} : {
      s: () => pen(!panes.source.pen), escape: () => pen(false), g: () => overlay('grid', !$('grid').checked),
      h: () => overlay('stretch', !$('stretch').checked), b: blink, a: swap,
      d: () => own($('own').value = Number($('own').value) >= 1 ? 0 : Number($('own').value) + 0.25), 0: () => $('fit').click(), '?': () => $('help').click(),
      '+': () => focused().zoomBy(1.25), '-': () => focused().zoomBy(0.8), p: () => focused().click(),
      enter: () => focused().drawing && focused().drawn(),
    };
  if (key === 'enter' && event.target.matches('button, input')) return;
  if (!keys[key] || (control && typing && key !== 's')) return;
  event.preventDefault();
  keys[key]();
});

const focused = () => ($('source').contains(document.activeElement) ? panes.source : panes.target);
