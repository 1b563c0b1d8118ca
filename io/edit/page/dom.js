// Elements of the page by their id, with their types.

export const SVG = 'http://www.w3.org/2000/svg';

/**
 * @param {string} id
 * @returns {HTMLElement}
 */
export function byId(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page has no element #${id}`);
  return element;
}

/** @param {string} id */
export const input = (id) => /** @type {HTMLInputElement} */ (byId(id));

/** @param {string} id */
export const button = (id) => /** @type {HTMLButtonElement} */ (byId(id));

/** @param {string} id */
export const select = (id) => /** @type {HTMLSelectElement} */ (byId(id));

/** @param {string} id */
export const output = (id) => /** @type {HTMLOutputElement} */ (byId(id));

/** @param {string} id */
export const dialog = (id) => /** @type {HTMLDialogElement} */ (byId(id));

/**
 * Return one of the page's icons.
 * @param {string} name
 */
export function icon(name) {
  const picture = document.createElementNS(SVG, 'svg'), use = picture.appendChild(document.createElementNS(SVG, 'use'));
  picture.setAttribute('class', 'icon');
  picture.setAttribute('aria-hidden', 'true');
  use.setAttribute('href', `#icon-${name}`);
  return picture;
}

/**
 * Follow a pointer pressed on an element until it is released.
 * @param {HTMLElement} element
 * @param {PointerEvent} event the press
 * @param {(event: PointerEvent) => void} move
 * @param {(event: PointerEvent) => void} end
 */
export function followPointer(element, event, move, end) {
  element.setPointerCapture(event.pointerId);
  element.onpointermove = move;
  const release = (/** @type {PointerEvent} */ last) => {
    element.onpointermove = null;
    element.onpointerup = null;
    element.onpointercancel = null;
    end(last);
  };
  element.onpointerup = release;
  element.onpointercancel = release;
}
