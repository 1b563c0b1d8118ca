// Messages to the user: the status line and the notes.

import {byId} from './dom.js';

/**
 * Show a message about the last step.
 * @param {string} text empty while the map follows
 * @param {boolean} [bad] whether it reports a problem
 */
export function report(text, bad = false) {
  byId('status').textContent = text || 'Following…';
  document.body.classList.toggle('bad', bad);
}

/** @param {string[]} texts */
export function showNotes(texts) {
  byId('notes').replaceChildren(...texts.map((text) => {
    const item = document.createElement('li');
    item.textContent = text;
    return item;
  }));
}

/** Return the notes that are shown. */
export const shownNotes = () => [...byId('notes').children].map((item) => item.textContent ?? '');
