// The layout: the result is large and the source a small inset; both can be exchanged, or kept open side by side.

import {button, byId} from './dom.js';

const KEY = 'iccm-layout';  // in the browser's storage
/** What is on at the beginning: nothing, so that the result is large and Advanced closed. */
const STATES = /** @type {const} */ (['swapped', 'both', 'advanced']);

export class Layout {
  /** @type {Set<string>} */
  #on = new Set((localStorage.getItem(KEY) ?? '').split(' ').filter((name) => STATES.some((state) => state === name)));
  #advanced = /** @type {HTMLDetailsElement} */ (byId('advanced'));

  constructor() {
    button('swap').onclick = () => this.toggle('swapped');
    button('both').onclick = () => this.toggle('both');
    this.#advanced.open = this.#on.has('advanced');
    this.#advanced.ontoggle = (event) => { if (event.target === this.#advanced) this.#set('advanced', this.#advanced.open); };
    this.#show();
    closeMenus();
  }

  /** @param {'swapped' | 'both'} state */
  toggle(state) {
    this.#set(state, !this.#on.has(state));
  }

  /**
   * @param {typeof STATES[number]} state
   * @param {boolean} isOn
   */
  #set(state, isOn) {
    if (isOn) this.#on.add(state);
    else this.#on.delete(state);
    localStorage.setItem(KEY, [...this.#on].join(' '));
    this.#show();
  }

  #show() {
    for (const [state, id] of [['swapped', 'swap'], ['both', 'both']]) {
      document.body.classList.toggle(state, this.#on.has(state));
      button(id).setAttribute('aria-pressed', String(this.#on.has(state)));
    }
  }
}

/** Close menus by a click elsewhere, and by Escape. */
function closeMenus() {
  const menus = /** @type {NodeListOf<HTMLDetailsElement>} */ (document.querySelectorAll('details.menu'));
  addEventListener('pointerdown', ({target}) => {
    for (const menu of menus) if (!(target instanceof Node && menu.contains(target))) menu.open = false;
  });
  for (const menu of menus) {
    menu.addEventListener('keydown', (event) => {
      if (event.key !== 'Escape' || !menu.open) return;
      event.stopPropagation();
      menu.open = false;
      menu.querySelector('summary')?.focus();
    });
  }
}
