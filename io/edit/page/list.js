// The list of pins, strokes and rigid regions, where they are named, moved, locked and removed.

import {icon} from './dom.js';
import {rounded} from './figures.js';
import {pinHue, strokeHue} from './hues.js';

/** @import {Actions, Item, PaneScene, Pin, Place, Region, Stroke} from './types.d.ts' */

/**
 * @typedef {object} Row
 * @property {HTMLElement} element
 * @property {HTMLElement} mark
 * @property {HTMLInputElement} name
 * @property {HTMLInputElement} place
 * @property {HTMLButtonElement} lock
 * @property {HTMLButtonElement} remove
 */

const NUMBER = /[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?/gi;
const MAX_NAME_LENGTH = 60;  // characters

/**
 * Return the numbers in a text.
 * @param {string} text
 */
export const numbersIn = (text) => (text.match(NUMBER) ?? []).map(Number);

/**
 * @param {HTMLElement} element
 * @param {PaneScene} scene
 * @param {Actions} actions
 */
export function showList(element, scene, actions) {
  const rows = rowsOf(element, scene.pins.length + scene.strokes.length + scene.rigid.length);
  scene.pins.forEach((pin, k) => showPin(rows[k], pin, k, scene, actions));
  scene.strokes.forEach((stroke, k) => showStroke(rows[scene.pins.length + k], stroke, k, scene, actions));
  const first = scene.pins.length + scene.strokes.length;
  scene.rigid.forEach((region, k) => {
    const known = scene.regions.length === scene.rigid.length;  // else some regions were merged
    showRegion(rows[first + k], region, known ? scene.regions[k] : null, k, actions);
  });
}

/**
 * Return one row per entry. Existing rows are reused, so that the focus is kept.
 * @param {HTMLElement} element
 * @param {number} count
 * @returns {Row[]}
 */
function rowsOf(element, count) {
  while (element.childElementCount > count) element.lastElementChild?.remove();
  while (element.childElementCount < count) element.append(emptyRow());
  return [...element.children].map((row) => {
    const [mark, name, place, lock, remove] = row.children;
    return /** @type {Row} */ ({element: row, mark, name, place, lock, remove});
  });
}

function emptyRow() {
  const row = document.createElement('li');
  const name = document.createElement('input'), place = document.createElement('input');
  for (const input of [name, place]) {
    input.type = 'text';
    input.maxLength = MAX_NAME_LENGTH;
    input.spellcheck = false;
  }
  const lock = document.createElement('button'), remove = document.createElement('button');
  lock.append(icon('lock'));
  lock.title = 'Keep this pin at its position (L)';
  remove.append(icon('remove'));
  remove.title = 'Remove';
  row.append(document.createElement('span'), name, place, lock, remove);
  return row;
}

/**
 * @param {Row} row
 * @param {Pin} pin
 * @param {number} number
 * @param {PaneScene} scene
 * @param {Actions} actions
 */
function showPin(row, pin, number, scene, actions) {
  const rotation = typeof pin.turn === 'number' ? ` ∠ ${pin.turn}°` : '';
  const {digits} = scene, source = coordinates(pin.source, digits.source), target = coordinates(pin.target, digits.target);
  const text = `${source} → ${target}${rotation}`;
  const wrong = scene.wrong.pins?.includes(number) ?? false;
  const isShort = Boolean(scene.wanted(pin));
  row.mark.textContent = wrong ? '!' : isShort ? '◌' : '●';
  row.element.style.setProperty('--hue', String(pinHue(number)));
  showEntry(row, 'pin', {kind: 'pins', number}, pin.name, text, wrong, actions);
  row.element.classList.toggle('short', isShort);
  row.place.readOnly = typeof pin.source === 'string' || typeof pin.target === 'string';
  row.place.onchange = () => actions.move({kind: 'pins', number}, numbersIn(row.place.value));
  row.lock.hidden = false;
  row.lock.setAttribute('aria-pressed', String(scene.locked(pin)));
  row.lock.setAttribute('aria-label', `lock pin ${pin.name || number + 1}`);
  row.lock.onclick = () => actions.lock({kind: 'pins', number});
}

/**
 * @param {Row} row
 * @param {Stroke} stroke
 * @param {number} number
 * @param {PaneScene} scene
 * @param {Actions} actions
 */
function showStroke(row, stroke, number, scene, actions) {
  const text = `${stroke.source.length} → ${stroke.target.length} points`;
  const wrong = scene.wrong.strokes?.includes(number) ?? false;
  row.mark.textContent = wrong ? '!' : '∿';
  row.element.style.setProperty('--hue', String(strokeHue(number)));
  showEntry(row, 'stroke', {kind: 'strokes', number}, stroke.name, text, wrong, actions);
  row.place.readOnly = true;
  row.place.onchange = null;
  row.lock.hidden = true;
}

/**
 * Fill in what rows of pins and strokes have in common. Fields with the focus keep what is typed there.
 * @param {Row} row
 * @param {string} word
 * @param {Item} item
 * @param {string} name
 * @param {string} text
 * @param {boolean} wrong
 * @param {Actions} actions
 */
function showEntry(row, word, item, name, text, wrong, actions) {
  const number = item.number + 1;
  row.element.className = wrong ? `${word} wrong` : word;
  row.element.onpointerenter = () => actions.hover(item);
  row.element.onpointerleave = () => actions.hover(null);
  if (document.activeElement !== row.name) row.name.value = name;
  row.name.placeholder = `${word} ${number}`;
  row.name.readOnly = false;
  row.name.setAttribute('aria-label', `name of ${word} ${number}`);
  row.name.onchange = () => actions.rename(item, row.name.value.trim());
  if (document.activeElement !== row.place) row.place.value = text;
  row.place.setAttribute('aria-label', `coordinates of ${word} ${number}`);
  row.place.onblur = () => { row.place.value = text; };
  row.remove.setAttribute('aria-label', `remove ${word} ${name || number}`);
  row.remove.onclick = () => actions.remove(item, true);
}

/**
 * @param {Row} row
 * @param {string | Place[]} region
 * @param {Region | null} figures of the map
 * @param {number} number
 * @param {Actions} actions
 */
function showRegion(row, region, figures, number, actions) {
  const text = typeof region === 'string' ? region : `${region.length} points`;
  const kept = figures ? `, K ${figures.dilatation.toFixed(3)}, size ${rounded(figures.scale)}` : '';
  row.element.className = 'region';
  row.element.onpointerenter = null;
  row.element.onpointerleave = null;
  row.mark.textContent = '▨';
  row.name.value = '';
  row.name.placeholder = `rigid ${number + 1}`;
  row.name.readOnly = true;
  row.name.onchange = null;
  row.name.setAttribute('aria-label', `rigid region ${number + 1}`);
  row.place.value = text + kept;
  row.place.readOnly = true;
  row.place.onchange = null;
  row.place.onblur = null;
  row.place.setAttribute('aria-label', `contents of rigid region ${number + 1}`);
  row.lock.hidden = true;
  row.remove.setAttribute('aria-label', `remove rigid region ${number + 1}`);
  row.remove.onclick = () => actions.remove({kind: 'rigid', number}, true);
}

/**
 * @param {Place} place
 * @param {number} digits after the point
 */
const coordinates = (place, digits) => (typeof place === 'string' ? place : place.map((value) => Number(value.toFixed(digits))).join(', '));
