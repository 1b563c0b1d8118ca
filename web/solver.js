/* global CORE, WORKER -- constants of bundle.js */
// The worker as the page sees it: one request at a time; a new search replaces the running one, and what the user does
// interrupts a quiet search.

/** @import {Answer, MapState, Request} from './types.d.ts' */

/** @typedef {Request extends infer R ? R extends {seq: number} ? Omit<R, 'seq'> : never : never} Unnumbered */

/**
 * Return the browser's own class. In pages that are opened as files, the site replaces it by one that runs scripts in a
 * frame, so that the search works; a new frame still has it.
 * @returns {typeof Worker}
 */
function workerClass() {
  if (/\[native code\]/.test(Function.prototype.toString.call(Worker))) return Worker;
  const frame = document.body.appendChild(document.createElement('iframe'));
  frame.hidden = true;
  return /** @type {typeof globalThis} */ (/** @type {unknown} */ (frame.contentWindow)).Worker;
}

export class Solver {
  /** Whether a request is being answered. */
  busy = false;
  #seq = 0;
  /** Whether the running request is a search after which nothing is lost if it is interrupted. */
  #isQuiet = false;
  /** The last map that followed the user. @type {MapState | null} */
  #state = null;
  #workerClass = workerClass();
  #answered;
  /** @type {Worker | null} */
  #worker = null;
  /** @type {ArrayBuffer | null} */
  #core = null;

  /** @param {(answer: Answer) => void} answered called with each answer to the last request */
  constructor(answered) {
    this.#answered = answered;
  }

  /** Unpack the core and start the worker. */
  async start() {
    const packed = Uint8Array.from(atob(CORE), (letter) => letter.charCodeAt(0));
    this.#core = await new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'))).arrayBuffer();
    this.#restart();
  }

  #restart() {
    this.#worker?.terminate();
    const address = URL.createObjectURL(new Blob([WORKER], {type: 'text/javascript'}));
    this.#worker = new this.#workerClass(address);
    this.#worker.addEventListener('message', (/** @type {MessageEvent<Answer>} */ event) => this.#receive(event.data));
    this.#worker.postMessage({kind: 'load', seq: 0, core: this.#core});
  }

  /**
   * Continue with a map of an earlier answer, instead of what is running.
   * @param {MapState} state
   */
  resume(state) {
    if (this.busy) this.#restart();
    this.busy = false;
    this.#seq++;
    this.#state = state;
    this.#worker?.postMessage({kind: 'resume', seq: 0, state});
  }

  /** The number of the next request. */
  get next() {
    return this.#seq + 1;
  }

  /** Whether requests other than searches can be sent. */
  get isReady() {
    return !this.busy || (this.#isQuiet && this.#state !== null);
  }

  /**
   * Send a request. A search interrupts what is running, others interrupt quiet searches; else they must wait.
   * @param {Unnumbered} request
   */
  send(request) {
    const isSearch = request.kind === 'solve';
    if (this.busy) {
      if (!isSearch && !this.isReady) throw new Error('the solver is busy');
      this.#restart();
      if (!isSearch) this.#worker?.postMessage({kind: 'resume', seq: 0, state: this.#state});
    }
    this.#isQuiet = isSearch && request.quiet;
    if (isSearch && !request.quiet) this.#state = null;
    this.busy = true;
    this.#seq++;
    this.#worker?.postMessage({...request, seq: this.#seq});
  }

  /** @param {Answer} answer */
  #receive(answer) {
    if (answer.seq !== this.#seq) return;
    if (answer.stage === 'done' || answer.stage === 'error') this.busy = false;
    else if (answer.state && answer.stage !== 'other') this.#state = answer.state;
    this.#answered(answer);
  }
}
