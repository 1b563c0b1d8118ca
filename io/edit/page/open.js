// The dialog for opening files: choose or drop them, select a part of each, or try a sample.

import {button, byId, dialog, SVG} from './dom.js';
import {lasso} from './lasso.js';

/** @typedef {'source' | 'target' | 'texture'} Role */
/**
 * @typedef {{spec: string, name: string, d: string, frame: string, extent: [number, number], picture?: boolean}} Part a
 *   shape of a file, with path data of its outlines, and of the frame around several parts, in the unit square, and the
 *   width and height of the file's canvas there; `picture` if the file's picture is shown behind it
 */
/** @typedef {{name: string, shapes: string[]}} Sample a pair to try, with path data of both shapes */
/** @typedef {Partial<Record<Role, string>>} Chosen the spec of each role */

const NO_FILE = {
  source: 'none yet', target: 'none: pins deform the source', texture: 'automatic: the source’s own colors, or a checkerboard',
};
const CHECKERBOARD = 'checker';  // as a texture
/** @type {Role[]} */
const ROLES = ['source', 'target', 'texture'];

const files = dialog('files');
/** @type {Chosen} */
let chosen = {};
/** @type {Chosen} what was chosen when the dialog was opened */
let before = {};
/** @type {Chosen} the same without parts */
let paths = {};
/** @type {Chosen} addresses of the pictures among them */
let pictures = {};
let leave = () => {};
/** @type {Record<Role, string[]>} suffixes of files that can be read for each role */
let suffixes = {source: [], target: [], texture: []};

/**
 * @param {Role} role
 * @param {string} selector
 * @returns {HTMLElement}
 */
function within(role, selector) {
  const element = files.querySelector(`[data-role=${role}] ${selector}`);
  if (!(element instanceof HTMLElement)) throw new Error(`the page has no ${selector} for the ${role}`);
  return element;
}

/** @param {Role} role */
const inputOf = (role) => /** @type {HTMLInputElement} */ (within(role, 'input'));

/** @param {string} text */
function report(text) {
  byId('files-said').textContent = text;
}

/**
 * Open the dialog.
 * @param {() => void} [leaving] called before the page is reloaded
 */
export async function choose(leaving = leave) {
  leave = leaving;
  const workspace = await (await fetch('workspace')).json();
  chosen = {...workspace.chosen};
  before = {...workspace.chosen};
  paths = {...workspace.paths};
  pictures = {source: 'source.drawing', target: 'target.drawing'};
  suffixes = workspace.suffixes;
  for (const role of ROLES) inputOf(role).accept = suffixes[role].join(',');
  report('');
  byId('samples').replaceChildren(...workspace.samples.map(sampleButton));
  for (const role of ROLES) showRole(role, []);
  if (!files.open) files.showModal();
  for (const role of ROLES) {
    if (role === 'texture' || !chosen[role]) continue;
    const {parts, error} = await (await fetch(`workspace?side=${role}`)).json();
    if (error) report(error);
    else showRole(role, parts);
  }
}

/** Show the page on which nothing is open yet: samples, and a place to drop files. */
export async function welcome() {
  const {samples} = await (await fetch('workspace')).json();
  document.body.classList.add('empty');
  byId('welcome').hidden = false;
  byId('welcome-samples').replaceChildren(...samples.map(sampleButton));
}

/** @param {Sample} sample */
function sampleButton({name, shapes}) {
  const element = document.createElement('button');
  element.append(...shapes.map((d) => silhouette(d)), name);
  element.onclick = () => open({sample: name});
  return element;
}

/**
 * Show the file of a role, and thumbnails of the other shapes in it.
 * @param {Role} role
 * @param {Part[]} parts
 */
function showRole(role, parts) {
  const names = (chosen[role] ?? '').split(/[\\/]/), thumbnails = parts.length > 1 ? parts : [];
  within(role, '.name').textContent = nameOf(role, names[names.length - 1]);
  const buttons = thumbnails.map((part) => thumbnail(role, part, parts));
  if (parts[0]?.picture) buttons.push(lassoButton(role));
  within(role, '.parts').replaceChildren(...buttons);
  button('files-open').disabled = !chosen.source;
  button('no-target').hidden = !chosen.target;
}

/**
 * @param {Role} role
 * @param {string} name of the file
 */
function nameOf(role, name) {
  if (role === 'texture' && chosen.texture === CHECKERBOARD) return 'a checkerboard';
  if (role === 'texture' && chosen.texture && chosen.texture === paths.source) return 'the source’s own drawing';
  return name || NO_FILE[role];
}

/**
 * @param {Role} role
 * @param {Part} part
 * @param {Part[]} parts the first is the whole file
 */
function thumbnail(role, part, parts) {
  const element = document.createElement('button');
  const picture = part.picture ? overPicture(part, pictures[role] ?? '') : silhouette(parts[0].d, part.d, part.frame);
  const name = part.name || `part ${part.spec.slice(part.spec.lastIndexOf('#') + 1)}`;
  const isWhole = part === parts[0] && !parts.some(({spec}) => spec === chosen[role]);
  if (part.picture) element.append(part.name);
  element.prepend(picture);
  element.title = part.frame ? `${name}, with the frame around all parts` : name;
  element.setAttribute('aria-label', `${role}: ${name}`);
  element.setAttribute('aria-pressed', String(isWhole || chosen[role] === part.spec));
  element.onclick = () => {
    chosen[role] = part.spec;
    showRole(role, parts);
    within(role, '[aria-pressed=true]').focus();
  };
  return element;
}

/**
 * Return a drawing of a shape, or of one of its parts with the rest behind it.
 * @param {string} all path data
 * @param {string} [part]
 * @param {string} [frame] path data of the frame around several parts
 */
function silhouette(all, part = all, frame = '') {
  const picture = document.createElementNS(SVG, 'svg');
  picture.setAttribute('viewBox', '-0.04 -0.04 1.08 1.08');
  picture.setAttribute('aria-hidden', 'true');
  for (const d of part === all ? [all] : [all, part]) {
    const path = picture.appendChild(document.createElementNS(SVG, 'path'));
    path.setAttribute('d', d);
    path.setAttribute('fill-rule', 'evenodd');
    path.classList.toggle('rest', d !== part);
  }
  if (frame) {
    const path = picture.appendChild(document.createElementNS(SVG, 'path'));
    path.setAttribute('d', frame);
    path.classList.add('around');
  }
  return picture;
}

/**
 * Return a photograph with the outline that it can be read as.
 * @param {Part} part
 * @param {string} address of the photograph
 */
function overPicture({d, extent: [width, height]}, address) {
  const picture = silhouette(d), image = document.createElementNS(SVG, 'image');
  picture.classList.add('photograph');
  picture.prepend(image);
  const place = {href: address, x: 0, y: 1 - height, width, height, preserveAspectRatio: 'none'};
  for (const [name, value] of Object.entries(place)) image.setAttribute(name, String(value));
  return picture;
}

/**
 * Return the button for drawing an outline on a photograph.
 * @param {Role} role
 */
function lassoButton(role) {
  const element = document.createElement('button');
  element.textContent = 'Lasso…';
  element.title = 'Draw an outline on the picture by hand';
  element.onclick = () => lasso(pictures[role] ?? '', (cut) => {
    const name = (paths[role] ?? 'picture').split(/[\\/]/).at(-1)?.replace(/\.[^.]*$/, '');
    upload(role, new File([cut], `${name}-lasso.png`, {type: 'image/png'}));
  });
  return element;
}

/**
 * Upload a file from this computer for a role.
 * @param {Role} role
 * @param {File} file
 */
async function upload(role, file) {
  report(`Reading ${file.name}…`);
  const address = `files/${encodeURIComponent(file.name)}?role=${role}`;
  const {path, parts, error} = await (await fetch(address, {method: 'PUT', body: file})).json();
  report(error ?? '');
  if (error) return;
  const isRead = !parts[0]?.picture || parts.some((/** @type {Part} */ {spec}) => spec === path);
  chosen[role] = isRead ? path : parts[0].spec;
  paths[role] = path;
  if (parts[0]?.picture) pictures[role] = URL.createObjectURL(file);
  showRole(role, parts);
}

/**
 * Open the chosen files: the page is reloaded.
 * @param {Chosen | {sample: string}} choice
 */
async function open(choice) {
  report('Opening…');
  const {error} = await (await fetch('workspace', {method: 'POST', body: JSON.stringify(choice)})).json();
  if (error) {
    report(error);
    return;
  }
  const sameShapes = (chosen.source ?? '') === (before.source ?? '') && (chosen.target ?? '') === (before.target ?? '');
  // the history belongs to other shapes
  if ('sample' in choice || !sameShapes) sessionStorage.removeItem(location.pathname);
  leave();
  location.reload();
}

for (const role of ROLES) {
  const element = inputOf(role);
  element.onchange = () => { if (element.files?.[0]) upload(role, element.files[0]); };
}
button('no-target').onclick = () => {
  chosen.target = '';
  showRole('target', []);
};
button('own-texture').onclick = () => {
  chosen.texture = paths.source ?? '';
  showRole('texture', []);
};
button('checkerboard').onclick = () => {
  chosen.texture = CHECKERBOARD;
  showRole('texture', []);
};
button('files-open').onclick = () => open(chosen);
button('files-close').onclick = () => files.close();
button('welcome-files').onclick = () => choose();

// ---------------------------------------------------------------- files that are dropped

/** @param {string} name */
const isPicture = (name) => suffixes.texture.some((suffix) => name.toLowerCase().endsWith(suffix));

/**
 * Return the role of a dropped file: from where it is dropped; else pictures are textures, and others what is missing.
 * @param {EventTarget | null} target
 * @param {File} file
 * @returns {Role}
 */
function roleOf(target, file) {
  const under = target instanceof Element ? target.closest('[data-role], .pane') : null;
  const named = under instanceof HTMLElement ? under.dataset.role : null;
  const place = named ?? (isPicture(file.name) ? 'texture' : under?.id);
  return ROLES.find((role) => role === place) ?? (chosen.source && !chosen.target ? 'target' : 'source');
}

addEventListener('dragover', (event) => event.preventDefault());
addEventListener('drop', async (event) => {
  event.preventDefault();
  const dropped = [...(event.dataTransfer?.files ?? [])];
  if (!dropped.length) return;
  const {target} = event;
  if (!files.open) await choose();
  /** @type {Role[]} */
  const roles = dropped.map((file) => roleOf(target, file));
  if (dropped.length > 1 && !roles.some((role) => role !== 'source')) roles[1] = 'target';
  for (const [k, file] of dropped.entries()) await upload(roles[k], file);
});
