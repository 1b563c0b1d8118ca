// Handles over a painted shape: buttons for pins, their rotations and radii, points of strokes, and suggested pins.
// They are dragged by the pointer and moved by keys.

import {followPointer} from './dom.js';
import {rounded} from './figures.js';
import {distance, significant} from './geometry.js';
import {pinHue, strokeHue} from './hues.js';

/** @import {Pane} from './pane.js' */
/** @import {Item, Place, Point} from './types.d.ts' */

/**
 * @typedef {object} Handle
 * @property {string} key unique name of the button
 * @property {'pin' | 'point' | 'turn' | 'radius' | 'ghost'} class
 * @property {Item} item
 * @property {Place} place
 * @property {string} text label beside it
 * @property {string} name label for screen readers
 * @property {number} hue
 * @property {Point} [pixel] position, if not at its place
 * @property {boolean} [wrong] whether the map does not meet it
 * @property {boolean} [short] whether it stopped short of where it was dragged
 * @property {boolean} [selected]
 * @property {boolean} [locked]
 */

export const CLICK_REACH = 4;  // pixels: a press that moves less is a click
const KEY_STEP = 0.005;        // relative to the pane's width: step of an arrow key
const KEY_ANGLE = 5;           // degrees by which an arrow key rotates
const FINE = 0.1;              // factor of both with Shift
const KEY_GROWTH = 1.1;        // factor by which a key enlarges or reduces a patch
const KEY_REST = 250;          // milliseconds after the last key when the converged map is requested

/** @type {Record<string, [number, number]>} */
export const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

export class Handles {
  #pane;
  #box;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #rest;

  /**
   * @param {HTMLElement} element
   * @param {Pane} pane
   */
  constructor(element, pane) {
    this.#pane = pane;
    this.#box = element.appendChild(document.createElement('div'));
    this.#box.className = 'handles';
  }

  draw() {
    const old = new Map([...this.#box.children].map((child) => {
      const element = /** @type {HTMLButtonElement} */ (child);
      return [element.dataset.key, element];
    }));
    for (const handle of handlesOf(this.#pane)) {
      this.#update(old.get(handle.key) ?? this.#create(handle), handle);
      old.delete(handle.key);
    }
    for (const element of old.values()) element.remove();
  }

  /**
   * @param {HTMLButtonElement} element
   * @param {Handle} handle
   */
  #update(element, handle) {
    const pane = this.#pane, point = pane.page(handle.place), [x, y] = handle.pixel ?? pane.pixel(point);
    element.style.transform = `translate(${x}px, ${y}px)`;
    element.style.setProperty('--hue', String(handle.hue));
    element.classList.toggle('behind', Boolean(pane.surface?.hides(point)));
    element.classList.toggle('wrong', Boolean(handle.wrong));
    element.classList.toggle('short', Boolean(handle.short));
    element.classList.toggle('locked', Boolean(handle.locked));
    if (handle.class === 'pin') element.setAttribute('aria-pressed', String(Boolean(handle.selected)));
    if (handle.class === 'ghost') element.onclick = () => pane.actions.accept(handle.item.number);
    element.dataset.text = handle.text;
    const label = `${handle.name}, ${pane.side}, at ${[handle.place].flat().join(', ')}`;
    const state = handle.wrong ? ': not met' : handle.short ? ': stopped short of where it was dragged' : '';
    element.setAttribute('aria-label', `${label}${state}`);
  }

  /** @param {Handle} handle */
  #create({key, item, class: kind}) {
    const element = this.#box.appendChild(document.createElement('button'));
    const {actions} = this.#pane;
    element.dataset.key = key;
    element.className = `handle ${kind}`;
    if (kind === 'ghost') {
      element.onpointerdown = (event) => event.stopPropagation();
    } else if (kind === 'turn') {
      element.onpointerdown = (event) => this.#rotate(event, element, item);
      element.onkeydown = (event) => this.#rotateByKey(event, item);
      element.ondblclick = (event) => {
        event.stopPropagation();
        actions.turn(item, null);
        actions.drop();
      };
    } else if (kind === 'radius') {
      element.onpointerdown = (event) => this.#resize(event, element, item);
      element.onkeydown = (event) => this.#resizeByKey(event, item);
      element.ondblclick = (event) => {
        event.stopPropagation();
        actions.hold(item, {radius: null});
      };
    } else {
      element.onfocus = () => actions.activate(item);
      element.onpointerdown = (event) => this.#drag(event, element, item);
      element.onkeydown = (event) => this.#press(event, item);
      element.ondblclick = (event) => {
        event.stopPropagation();
        actions.remove(item);
      };
      element.onpointerenter = () => actions.hover(item);
      element.onpointerleave = () => actions.hover(null);
    }
    return element;
  }

  /**
   * @param {PointerEvent} event
   * @param {HTMLElement} element
   * @param {Item} item
   */
  #drag(event, element, item) {
    const pane = this.#pane;
    if (event.button) return;
    event.stopPropagation();
    if (event.shiftKey && item.kind === 'pins') {
      pane.actions.select(item);
      return;
    }
    const start = pane.pixelOf(event), from = pane.pixel(pane.page(pane.place(item))), entry = pane.entry(item);
    /** @type {Point | null} */
    let to = null;
    followPointer(element, event, (next) => {
      if (pane.entry(item) !== entry) {  // undone or removed by a key: the drag has ended
        to = null;
        return;
      }
      const now = pane.pixelOf(next);
      if (!to && distance(now, start) <= CLICK_REACH) return;
      to = pane.clamp([from[0] + now[0] - start[0], from[1] + now[1] - start[1]]);
      pane.loupe = pane.drag(item, to, {attracted: !next.altKey});
      if (pane.loupe) pane.hurry(true);
      pane.redraw(Boolean(pane.loupe));
    }, () => {
      if (pane.entry(item) !== entry) to = null;
      if (to && pane.surface) pane.drag(item, to, {last: true});
      if (pane.side === 'source') pane.hurry(false);  // the target still follows
      pane.redraw();
      pane.loupe = null;
      pane.guide = null;
      if (to) pane.actions.drop();
    });
  }

  /**
   * @param {PointerEvent} event
   * @param {HTMLElement} element
   * @param {Item} item
   */
  #rotate(event, element, item) {
    const pane = this.#pane;
    this.#pull(event, element, item, (now) => {
      const [x, y] = pane.pixel(pane.page(pane.scene.pins[item.number].target));
      const degrees = Math.atan2(x - now[0], y - now[1]) * 180 / Math.PI;
      pane.actions.turn(item, Number(degrees.toFixed(1)));
    });
  }

  /**
   * @param {PointerEvent} event
   * @param {HTMLElement} element
   * @param {Item} item
   */
  #resize(event, element, item) {
    const pane = this.#pane;
    this.#pull(event, element, item, (now) => {
      pane.actions.hold(item, {radius: pane.radiusTo(item.number, now)}, false);
    });
  }

  /**
   * Follow the pointer once it has moved farther than in a click; commit the change on release.
   * @param {PointerEvent} event
   * @param {HTMLElement} element
   * @param {Item} item
   * @param {(pixel: Point) => void} move
   */
  #pull(event, element, item, move) {
    const pane = this.#pane, entry = pane.entry(item);
    if (event.button) return;
    event.stopPropagation();
    const start = pane.pixelOf(event);
    let moved = false;
    followPointer(element, event, (next) => {
      const now = pane.pixelOf(next);
      moved ||= distance(now, start) > CLICK_REACH;
      if (moved && pane.entry(item) === entry) move(now);
    }, () => {
      if (moved && pane.entry(item) === entry) pane.actions.drop();
    });
  }

  /**
   * @param {KeyboardEvent} event
   * @param {Item} item
   */
  #resizeByKey(event, item) {
    const growth = {ArrowUp: KEY_GROWTH, ArrowRight: KEY_GROWTH, ArrowDown: 1 / KEY_GROWTH, ArrowLeft: 1 / KEY_GROWTH}[event.key];
    if (event.key === 'Delete' || event.key === 'Backspace') this.#pane.actions.hold(item, {radius: null});
    else if (growth) this.#grow(item, growth);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /**
   * Toggle between an exact and a soft pin.
   * @param {Item} item
   */
  #toggleExact(item) {
    const {scene, actions} = this.#pane;
    actions.hold(item, {radius: scene.pins[item.number].radius === 0 ? null : 0});
  }

  /**
   * Enlarge the patch of a pin.
   * @param {Item} item
   * @param {number} factor
   */
  #grow(item, factor) {
    const {scene, actions} = this.#pane, radius = scene.pins[item.number].radius ?? scene.patches[item.number]?.radius;
    if (!radius) return;
    actions.hold(item, {radius: significant(radius * factor)}, false);
    this.#dropAtRest();
  }

  /**
   * @param {KeyboardEvent} event
   * @param {Item} item
   */
  #rotateByKey(event, item) {
    const [right, down] = ARROWS[event.key] ?? [0, 0], before = this.#pane.scene.pins[item.number].turn ?? 0;
    const degrees = -KEY_ANGLE * (event.shiftKey ? FINE : 1) * (right || down);
    if (event.key === 'Delete' || event.key === 'Backspace') this.#pane.actions.turn(item, null);
    else if (degrees) this.#pane.actions.turn(item, Number(((before + degrees) % 360).toFixed(1)));
    else return;
    this.#dropAtRest();
    event.preventDefault();
    event.stopPropagation();
  }

  /**
   * @param {KeyboardEvent} event
   * @param {Item} item
   */
  #press(event, item) {
    const pane = this.#pane, isPin = item.kind === 'pins', plain = !event.ctrlKey && !event.metaKey;
    if (event.key === 'Delete' || event.key === 'Backspace') pane.actions.remove(item, event.shiftKey);
    else if (event.key === ' ' && isPin) pane.actions.select(item);
    else if (event.key.toLowerCase() === 'l' && plain && isPin) pane.actions.lock(item);
    else if (event.key === ']' && plain && isPin) this.#grow(item, KEY_GROWTH);
    else if (event.key === '[' && plain && isPin) this.#grow(item, 1 / KEY_GROWTH);
    else if (event.key.toLowerCase() === 'e' && plain && isPin) this.#toggleExact(item);
    else if (ARROWS[event.key] && plain && !event.altKey) this.#moveByKey(event, item);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /**
   * @param {KeyboardEvent} event
   * @param {Item} item
   */
  #moveByKey(event, item) {
    const pane = this.#pane, step = KEY_STEP * (event.shiftKey ? FINE : 1) * pane.view.width;
    const [x, y] = pane.pixel(pane.page(pane.place(item))), [right, down] = ARROWS[event.key];
    pane.drag(item, [x + step * right, y + step * down]);
    this.#dropAtRest();
  }

  /** Request the converged map once no key has been pressed for a while. */
  #dropAtRest() {
    clearTimeout(this.#rest);
    this.#rest = setTimeout(() => this.#pane.actions.drop(), KEY_REST);
  }
}

/**
 * @param {Pane} pane
 * @returns {Handle[]}
 */
function handlesOf(pane) {
  const {scene, side} = pane;
  /** @type {Handle[]} */
  const handles = [];
  scene.pins.forEach((pin, k) => {
    const text = pin.name || `${k + 1}`, locked = scene.locked(pin);
    handles.push({
      key: `pin ${k}`, class: 'pin', item: {kind: 'pins', number: k}, place: pin[side],
      text, name: `${locked ? 'locked ' : ''}pin ${text}`, hue: pinHue(k),
      wrong: scene.wrong.pins?.includes(k), short: Boolean(scene.wanted(pin)), selected: scene.selected.has(k), locked,
    });
  });
  pane.rotatable.forEach((pin, k) => {
    const free = pin.turn === null;
    handles.push({
      key: `turn ${k}`, class: 'turn', item: {kind: 'pins', number: k}, place: pin.target, pixel: pane.armEnd(pin),
      text: free ? '' : `${pin.turn}°`,
      name: `rotation of pin ${pin.name || k + 1}: ${free ? 'free' : `${pin.turn} degrees`}`, hue: pinHue(k),
    });
  });
  const ring = scene.active === null ? null : pane.ring(scene.active);
  if (ring && scene.active !== null) {
    const {middle: [x, y], radius} = ring, pin = scene.pins[scene.active];
    const units = scene.patches[scene.active]?.radius ?? 0;
    handles.push({
      key: `radius ${scene.active}`, class: 'radius', item: {kind: 'pins', number: scene.active}, place: pin.source,
      pixel: [x + radius, y], text: '', name: `radius of pin ${pin.name || scene.active + 1}: ${rounded(units)}`,
      hue: pinHue(scene.active),
    });
  }
  scene.suggested.forEach((pin, k) => {
    handles.push({
      key: `ghost ${pin.source} ${pin.target}`, class: 'ghost', item: {kind: 'suggested', number: k}, place: pin[side],
      text: pin.name || '+', name: `suggested pin ${pin.name || k + 1}`, hue: 0,
    });
  });
  scene.strokes.forEach((stroke, k) => {
    stroke[side].forEach((place, j) => {
      handles.push({
        key: `stroke ${k} ${j}`, class: 'point', item: {kind: 'strokes', number: k, point: j}, place,
        text: '', name: `stroke ${stroke.name || k + 1}, point ${j + 1}`, hue: strokeHue(k),
        wrong: scene.wrong.strokes?.includes(k),
      });
    });
  });
  return handles;
}
