// A short tour of the page, with a box beside each part in turn.

import {button, byId} from './dom.js';

const GAP = 10;  // pixels between the box and the part that it explains

/** @type {[string, string][]} selector of the part, and its explanation */
const STEPS = [
  ['#source', 'This is the source. Click a feature, such as an eye: a pin appears here and where the map takes it.'],
  ['#target', 'This is the result on the target. Drag the pin to where the feature belongs; the map follows.'],
  ['[aria-label=Tools]', 'Tools: place pins, place both ends one after the other, draw a stroke along a line, select.'],
  ['aside', 'Fit compares ways to bring the shapes together. Click a pin to set how large an area around it keeps its form. Under Advanced: figures and the history.'],
  ['#compare', 'Compare the result with the target’s own drawing, or with the map before the last change.'],
  ['#more', 'Export shows a preview first. Save keeps the pins, so that you can continue later.'],
];

export class Tour {
  #step = 0;

  constructor() {
    button('tour-again').onclick = () => {
      document.querySelector('dialog[open]')?.closest('dialog')?.close();
      this.begin();
    };
    button('tour-next').onclick = () => this.#show(this.#step + 1);
    button('tour-end').onclick = () => this.end();
  }

  begin() {
    byId('tour').hidden = false;
    this.#show(0);
    button('tour-next').focus();
  }

  end() {
    byId('tour').hidden = true;
    this.#mark(null);
  }

  /** @param {number} step */
  #show(step) {
    if (step >= STEPS.length) {
      this.end();
      return;
    }
    this.#step = step;
    const [selector, text] = STEPS[step], about = document.querySelector(selector);
    if (!(about instanceof HTMLElement)) return;
    byId('tour-text').textContent = text;
    byId('tour-count').textContent = `${step + 1} of ${STEPS.length}`;
    button('tour-next').textContent = step + 1 === STEPS.length ? 'Done' : 'Next';
    about.scrollIntoView({block: 'nearest'});
    this.#mark(about);
    place(byId('tour'), about.getBoundingClientRect());
  }

  /** @param {HTMLElement | null} about the part that is outlined */
  #mark(about) {
    for (const element of document.querySelectorAll('.toured')) element.classList.remove('toured');
    about?.classList.add('toured');
  }
}

/**
 * Place a box below an element of the toolbar, or inside a large element, within the window.
 * @param {HTMLElement} box
 * @param {DOMRect} about
 */
function place(box, about) {
  const {width, height} = box.getBoundingClientRect(), isLarge = about.height > 2 * height;
  const left = isLarge ? about.left + (about.width - width) / 2 : about.left, top = isLarge ? about.top + 4 * GAP : about.bottom + GAP;
  box.style.left = `${Math.max(GAP, Math.min(left, innerWidth - width - GAP))}px`;
  box.style.top = `${Math.max(GAP, Math.min(top, innerHeight - height - GAP))}px`;
}
