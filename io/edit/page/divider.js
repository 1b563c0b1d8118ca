// The divider of the swipe view, dragged by the pointer; keys move it through the slider in the toolbar.

import {followPointer} from './dom.js';

/** @import {Pane} from './pane.js' */

export class Divider {
  #pane;
  #element;

  /**
   * @param {HTMLElement} element
   * @param {Pane} pane
   */
  constructor(element, pane) {
    this.#pane = pane;
    this.#element = element.appendChild(document.createElement('div'));
    this.#element.className = 'divider';
    this.#element.hidden = true;
    this.#element.onpointerdown = (event) => {
      event.stopPropagation();
      followPointer(this.#element, event, (next) => {
        const [x] = pane.clamp(pane.pixelOf(next));
        pane.divided(x / pane.view.width);
      }, () => {});
    };
  }

  draw() {
    const {swipe} = this.#pane.overlay;
    this.#element.hidden = swipe === null;
    if (swipe !== null) this.#element.style.transform = `translateX(${swipe * this.#pane.view.width}px)`;
  }
}
