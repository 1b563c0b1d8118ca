// What stands beside the shapes: the list of pins and strokes, and the figures of the map.

import {hue} from './pane.js';

const NUMBER = /[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?/gi;

const number = (value) => (value === null || value === undefined ? '–' : value >= 100 ? value.toFixed(0)
  : Number(value.toPrecision(3)).toString());

/** The list; `does` {rename, move, remove, hover}. */
export function list(element, scene, wrong, does) {
  const rows = [];
  for (const kind of ['pins', 'strokes']) {
    scene[kind].forEach((entry, k) => {
      const row = element.children[rows.length] ?? element.appendChild(blank());
      const word = kind === 'pins' ? 'pin' : 'stroke', item = {kind, number: k};
      const [mark, name, place, lock, remove] = row.children;
      row.style.setProperty('--hue', hue(kind === 'pins' ? k : k + 3));
      row.className = wrong[kind]?.includes(k) ? `${word} wrong` : word;
      mark.textContent = row.classList.contains('wrong') ? '!' : kind === 'pins' ? '●' : '∿';
      if (document.activeElement !== name) name.value = entry.name;
      name.placeholder = `${word} ${k + 1}`;
      name.readOnly = false;
      name.setAttribute('aria-label', `name of ${word} ${k + 1}`);
      name.onchange = () => does.rename(item, name.value.trim());
      const numbers = kind === 'pins' && [entry.source, entry.target].flat().every((v) => typeof v === 'number');
      const turned = typeof entry.turn === 'number' ? ` ∠ ${entry.turn}°` : '';
      const text = kind === 'pins' ? `${written(entry.source)} → ${written(entry.target)}${turned}`
        : `${entry.source.length} → ${entry.target.length} points`;
      if (document.activeElement !== place) place.value = text;
      place.readOnly = !numbers;
      place.setAttribute('aria-label', `places of ${word} ${k + 1}`);
      place.onchange = () => does.move(item, (place.value.match(NUMBER) ?? []).map(Number));
      place.onblur = () => { place.value = text; };
      lock.hidden = kind !== 'pins';
      lock.setAttribute('aria-pressed', scene.locked(entry));
      lock.setAttribute('aria-label', `lock ${word} ${entry.name || k + 1}`);
      lock.onclick = () => does.lock(item);
      remove.setAttribute('aria-label', `remove ${word} ${entry.name || k + 1}`);
      remove.onclick = () => does.remove(item, true);
      row.onpointerenter = () => does.hover(item);
      row.onpointerleave = () => does.hover(null);
      rows.push(row);
    });
  }
  scene.rigid.forEach((region, k) => {
    const row = element.children[rows.length] ?? element.appendChild(blank()), item = {kind: 'rigid', number: k};
    const [mark, name, place, lock, remove] = row.children;
    row.className = 'region';
    mark.textContent = '▨';
    Object.assign(name, {value: '', placeholder: `rigid ${k + 1}`, readOnly: true, onchange: null});
    const found = scene.regions.length === scene.rigid.length && scene.regions[k];  // else some are joined
    const text = typeof region === 'string' ? region : `${region.length} points`;
    const kept = found ? `, K ${found.dilatation.toFixed(3)}, size ${number(found.scale)}` : '';
    Object.assign(place, {value: text + kept, readOnly: true, onchange: null, onblur: null});
    name.setAttribute('aria-label', `rigid region ${k + 1}`);
    place.setAttribute('aria-label', `what rigid region ${k + 1} is`);
    lock.hidden = true;
    remove.setAttribute('aria-label', `remove rigid region ${k + 1}`);
    remove.onclick = () => does.remove(item, true);
    row.onpointerenter = row.onpointerleave = null;
    rows.push(row);
  });
  while (element.childElementCount > rows.length) element.lastChild.remove();
}

const written = (place) => [place].flat().join(', ');

function blank() {
  const row = document.createElement('li');
  const mark = document.createElement('span'), name = document.createElement('input');
  const place = document.createElement('input'), [lock, remove] = [0, 1].map(() => document.createElement('button'));
  for (const input of [name, place]) Object.assign(input, {type: 'text', maxLength: 60, spellcheck: false});
  lock.textContent = 'Lock';
  lock.title = 'It stays where it is (L)';
  remove.textContent = '×';
  row.append(mark, name, place, lock, remove);
  return row;
}

/** The figures of a map; those of a coarse one are not the last word. */
export function figures(body, kind, found) {
  const {stretch, dilatation, scale, boundary, injective, turn, left_out: lost, uncovered, shown, covered, regions = []} = found;
  const percent = (share) => `${(100 * share).toFixed(1)} %`;
  const rows = [
    ['stretch', 'half, 95 %, largest', stretch && [stretch.p50, stretch.p95, stretch.max].map(number).join('   ')],
    ['dilatation', 'half, 95 %, largest', dilatation && [dilatation.median, dilatation.p95, dilatation.max].map(number).join('   ')],
    ['scale', 'within a factor of 2', scale && percent(scale.within2)],
    ['turn', 'counter-clockwise', turn === undefined ? null : `${turn.toFixed(1)}°`],
    ['outline', 'off, of the diagonal', boundary ? boundary.hausdorff.toExponential(1) : null],
    ['one-to-one', 'certified share', injective ? (injective.certified ? `${(100 * injective.share).toFixed(2)} %` : 'not certified') : null],
  ];
  if (shown !== undefined) rows.push(['shown', 'of the source', percent(shown)], ['covered', 'of the target', percent(covered)]);
  else if (lost !== undefined) rows.push(['left out', 'of the source', percent(lost)], ['uncovered', 'of the target', percent(uncovered)]);
  regions.forEach(({dilatation: bent, scale: size}, k) => rows.push([`rigid ${k + 1}`, 'dilatation of 95 % of it, and its size by the mean scale', `${bent.toFixed(3)}   × ${number(size)}`]));
  body.replaceChildren(...rows.map(([name, hint, value]) => {
    const row = document.createElement('tr'), head = document.createElement('th'), cell = document.createElement('td');
    head.textContent = name;
    head.title = hint;
    head.scope = 'row';
    cell.textContent = value ?? '–';
    row.append(head, cell);
    return row;
  }));
  body.className = kind;
}
