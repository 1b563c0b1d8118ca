// Files: chosen or dropped, the part of each that is meant, and samples to try.

const SVG = 'http://www.w3.org/2000/svg';
const PICTURE = /\.(png|jpe?g|tiff?|exr|webp|hdr|bmp|tga|jxl|dpx)$/i;
const dialog = document.getElementById('files');
const drops = [...dialog.querySelectorAll('[data-role]')];
const box = (role) => drops.find((element) => element.dataset.role === role);
let chosen = {}, before = {}, leave = () => {};

/** Has the files chosen anew; `empty` where nothing is edited yet, `leaving` is called before the page is loaded again. */
export async function choose(empty, leaving = leave) {
  leave = leaving;
  const desk = await (await fetch('desk')).json();
  chosen = {...desk.chosen};
  before = {...desk.chosen};
  dialog.dataset.empty = empty;
  dialog.querySelector('#files-close').hidden = empty;
  told('');
  dialog.querySelector('#samples').replaceChildren(...desk.samples.map((name) => {
    const button = document.createElement('button');
    button.textContent = name;
    button.onclick = () => open({sample: name});
    return button;
  }));
  for (const element of drops) named(element.dataset.role, []);
  if (!dialog.open) dialog.showModal();
  for (const role of ['source', 'target']) {
    if (!chosen[role]) continue;
    const {parts, error} = await (await fetch(`desk?side=${role}`)).json();
    if (error) told(error);
    else named(role, parts);
  }
}

/** What has been chosen for a role, and thumbnails of what else is in its file. */
function named(role, parts) {
  const element = box(role), file = chosen[role]?.split(/[\\/]/).at(-1) ?? '';
  const none = {texture: 'none: a grid, or a mesh’s own', target: 'none: the source is deformed by its pins'}[role] ?? 'none yet';
  element.querySelector('.name').textContent = file || none;
  element.querySelector('.parts').replaceChildren(...(parts.length > 1 ? parts.map((part) => thumbnail(role, part, parts)) : []));
  dialog.querySelector('#files-open').disabled = !chosen.source;
  dialog.querySelector('#no-target').hidden = !chosen.target;
}

function thumbnail(role, part, parts) {
  const button = document.createElement('button'), picture = document.createElementNS(SVG, 'svg');
  picture.setAttribute('viewBox', '-0.04 -0.04 1.08 1.08');
  picture.setAttribute('aria-hidden', 'true');
  for (const each of [parts[0], part]) {  // the first is all of it
    const path = picture.appendChild(document.createElementNS(SVG, 'path'));
    path.setAttribute('d', each.d);
    path.setAttribute('fill-rule', 'evenodd');
    path.classList.toggle('rest', each !== part);
  }
  const number = part.spec.slice(part.spec.lastIndexOf('#') + 1), word = part.name || `part ${number}`;
  const now = chosen[role] === part.spec || (part === parts[0] && !parts.some(({spec}) => spec === chosen[role]));
  button.append(picture);
  button.title = word;
  button.setAttribute('aria-label', `${role}: ${word}`);
  button.setAttribute('aria-pressed', now);
  button.onclick = () => {
    chosen[role] = part.spec;
    named(role, parts);
    box(role).querySelector(`[aria-pressed=true]`).focus();
  };
  return button;
}

/** A file of this computer for a role. */
async function put(role, file) {
  told(`Reading ${file.name}…`);
  const {path, parts, error} = await (await fetch(`files/${encodeURIComponent(file.name)}?role=${role}`, {method: 'PUT', body: file})).json();
  told(error ?? '');
  if (error) return;
  chosen[role] = path;
  named(role, parts);
}

async function open(what) {
  told('Opening…');
  const answer = await fetch('desk', {method: 'POST', body: JSON.stringify(what)});
  const {error} = await answer.json();
  if (error) return told(error);
  const same = !what.sample && ['source', 'target'].every((role) => (chosen[role] ?? '') === (before[role] ?? ''));
  if (!same) sessionStorage.removeItem(location.pathname);  // the history is of other shapes
  leave();
  return location.reload();
}

const told = (text) => { dialog.querySelector('#files-said').textContent = text; };

for (const element of drops) {
  const {role} = element.dataset, input = element.querySelector('input');
  input.onchange = () => { if (input.files[0]) put(role, input.files[0]); };
}
dialog.querySelector('#no-target').onclick = () => { chosen.target = ''; named('target', []); };
dialog.querySelector('#files-open').onclick = () => open(chosen);
dialog.querySelector('#files-close').onclick = () => dialog.close();
dialog.oncancel = (event) => { if (dialog.dataset.empty === 'true') event.preventDefault(); };

/** The role of a file that is dropped: where it falls, else a picture is the texture, others what is still wanted. */
function role(event, file) {
  const over = event.target.closest?.('[data-role], .pane');
  const named = over?.dataset.role ?? (PICTURE.test(file.name) ? 'texture' : over?.id);
  return named ?? (chosen.source && !chosen.target ? 'target' : 'source');
}

addEventListener('dragover', (event) => event.preventDefault());
addEventListener('drop', async (event) => {
  event.preventDefault();
  const files = [...event.dataTransfer.files], roles = files.map((file) => role(event, file));
  if (!files.length) return;
  if (!dialog.open) await choose(false);
  if (files.length > 1 && roles.every((each) => each === 'source')) roles[1] = 'target';
  for (const [k, file] of files.entries()) await put(roles[k], file);
});
