// The current tool, which determines what clicks and drags on a shape do.

import {byId} from './dom.js';

/** @import {Pane} from './pane.js' */
/** @import {Side, Tool} from './types.d.ts' */

/** @type {Tool[]} */
const TOOLS = ['pin', 'pair', 'stroke', 'select'];

export class Tools {
  #panes;
  /** Called when the tool changes. */
  changed = () => {};

  /** @param {Record<Side, Pane>} panes */
  constructor(panes) {
    this.#panes = panes;
    for (const tool of TOOLS) buttonOf(tool).onclick = () => this.toggle(tool);
  }

  /** @returns {Tool} */
  get tool() {
    return this.#panes.source.tool;
  }

  /**
   * Choose a tool; if it is already chosen, return to the pin tool.
   * @param {Tool} tool
   */
  toggle(tool) {
    this.take(this.tool === tool ? 'pin' : tool);
  }

  /** @param {Tool} tool */
  take(tool) {
    for (const pane of [this.#panes.source, this.#panes.target]) {
      if (tool !== 'stroke') pane.drawing = null;
      pane.tool = tool;
      pane.redraw(false);
    }
    for (const other of TOOLS) buttonOf(other).setAttribute('aria-pressed', String(other === tool));
    byId('source').dataset.tool = tool;
    byId('target').dataset.tool = tool;
    this.changed();
  }
}

/** @param {Tool} tool */
function buttonOf(tool) {
  const element = document.querySelector(`button[data-tool=${tool}]`);
  if (!(element instanceof HTMLButtonElement)) throw new Error(`the page has no button for the tool ${tool}`);
  return element;
}
