// Elements of the page by their id, with their types.

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
 * Follow a pointer that is pressed on an element until it is released.
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
