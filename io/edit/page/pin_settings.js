// The settings of one pin: how large a patch keeps its form, and how close it comes to its place.

import {byId} from './dom.js';
import {rigidAround} from './editor.js';
import {rounded} from './figures.js';
import {significant} from './geometry.js';
import {report} from './status.js';

/** @import {Actions, Hello, PaneScene, Patch, Pin, PinSettings} from './types.d.ts' */

const FIELDS = /** @type {const} */ (['radius', 'tolerance', 'turn', 'scale']);
const MAX_ROTATION = 360;  // degrees
const LABELS = {radius: 'Keeps its form within', tolerance: 'May miss its place by', turn: 'Rotation', scale: 'Size'};
export const RANGES = {
  radius: 'a number of at least 0', tolerance: 'a number greater than 0',
  turn: `an angle from -${MAX_ROTATION} to ${MAX_ROTATION} degrees`, scale: 'a number greater than 0',
};
const PULLING = 1 / 3;  // of the automatic radius and tolerance: such a patch moves rather than keeping its form

/**
 * @param {PaneScene} scene
 * @param {Hello} hello
 * @param {Actions} actions
 */
export function showPinSettings(scene, hello, actions) {
  const box = /** @type {HTMLFieldSetElement} */ (byId('pin')), legend = /** @type {HTMLElement} */ (box.firstElementChild);
  const number = scene.active, pin = number === null ? undefined : scene.pins[number];
  box.hidden = !pin || hello.source.mesh || hello.target.mesh;
  if (!pin || number === null || box.hidden) return;
  const item = /** @type {const} */ ({kind: 'pins', number}), patch = scene.patches[number] ?? null;
  box.disabled = scene.locked(pin);
  legend.textContent = `Pin ${pin.name || number + 1}`;
  for (const name of FIELDS) {
    const field = /** @type {HTMLInputElement} */ (box.elements.namedItem(name));
    if (document.activeElement !== field) field.value = textOf(pin[name]);
    field.placeholder = placeholderOf(name, patch);
    field.onchange = () => {
      const value = field.valueAsNumber, isEmpty = Number.isNaN(value) && !field.validity.badInput;
      if (!isEmpty && !isPossible(name, value)) {
        field.value = textOf(pin[name]);
        report(`${LABELS[name]}: enter ${RANGES[name]}, or nothing.`, true);
        return;
      }
      actions.hold(item, {[name]: isEmpty ? null : value});
    };
  }
  for (const [name, settings] of Object.entries(presets(pin, patch))) {
    const button = /** @type {HTMLButtonElement} */ (box.elements.namedItem(name));
    const isChosen = name === 'exact' ? pin.radius === 0 : Boolean(pin.radius && pin.tolerance);
    button.setAttribute('aria-pressed', String(isChosen));
    button.onclick = () => actions.hold(item, isChosen ? automatic(pin) : settings);
  }
  const keep = /** @type {HTMLButtonElement} */ (box.elements.namedItem('keep')), isKept = rigidAround(scene, pin) >= 0;
  keep.setAttribute('aria-pressed', String(isKept));
  keep.disabled = !isKept && !patch;
  keep.onclick = () => actions.keep(item, patch?.radius ?? 0);
}

/** @param {number | null | undefined} value */
const textOf = (value) => (typeof value === 'number' ? String(value) : '');

/**
 * Return the placeholder of a field that is empty.
 * @param {typeof FIELDS[number]} name
 * @param {Patch | null} patch of the map
 */
function placeholderOf(name, patch) {
  if (name === 'turn' || name === 'scale') return 'free';
  return patch ? `${rounded(patch[name])} auto` : 'exact';
}

/**
 * Return whether a setting may have a value.
 * @param {typeof FIELDS[number]} name
 * @param {number} value
 */
export function isPossible(name, value) {
  if (name === 'turn') return Math.abs(value) <= MAX_ROTATION;
  return Number.isFinite(value) && (value > 0 || (name === 'radius' && value === 0));
}

/**
 * Return the settings of a pin whose patch iccm chooses.
 * @param {Pin} pin
 * @returns {PinSettings}
 */
const automatic = ({turn}) => ({radius: null, tolerance: null, turn, scale: null});

/**
 * @param {Pin} pin
 * @param {Patch | null} patch of the map
 * @returns {Record<string, PinSettings>}
 */
export function presets(pin, patch) {
  const pull = patch && {radius: significant(patch.radius * PULLING), tolerance: significant(patch.tolerance * PULLING)};
  return {pull: {...automatic(pin), ...pull}, exact: {...automatic(pin), radius: 0}};
}
