// The websocket to the server: JSON in both directions, and maps as binary frames (see io/edit/scene.py).

/** @import {Answer, ErrorMessage, Hello, MapMessage, TakenMessage} from './types.d.ts' */

const TRIES = 4;             // attempts to reconnect before the user is informed
const PAUSE = 500;           // milliseconds between these
const PAUSE_AFTER = 2000;    // milliseconds between later attempts
const LENGTH_BYTES = 4;      // length field at the start of a binary frame

export class Link {
  /** @type {WebSocket} */
  #socket;
  /** @type {Map<number, (answer: Answer) => void>} */
  #questions = new Map();
  #next = 1;
  #receive;
  #end;

  /**
   * @param {(message: Hello | MapMessage | ErrorMessage | TakenMessage, floats: Float32Array | null) => void} receive
   *   called with messages that do not answer a question
   * @param {() => void} end called when the connection is lost; it may come back
   */
  constructor(receive, end) {
    this.#receive = receive;
    this.#end = end;
    this.#socket = this.#open(TRIES);
  }

  /**
   * @param {number} tries left
   * @returns {WebSocket}
   */
  #open(tries) {
    const socket = new WebSocket(new URL('link', location.href).href.replace(/^http/, 'ws'));
    socket.binaryType = 'arraybuffer';
    socket.onmessage = (event) => {
      tries = TRIES;
      this.#take(event.data);
    };
    socket.onclose = () => {
      this.#refuseQuestions('the connection was lost');
      if (tries === 0) this.#end();
      setTimeout(() => { this.#socket = this.#open(tries - 1); }, tries > 0 ? PAUSE : PAUSE_AFTER);
    };
    return socket;
  }

  /** @param {string | ArrayBuffer} data */
  #take(data) {
    if (typeof data !== 'string') {
      const {head, floats} = readFrame(data);
      this.#receive(head, floats);
      return;
    }
    const message = JSON.parse(data);
    if (message.type === 'taken') this.#refuseQuestions('these shapes are being edited in another tab');
    if (message.type !== 'answer') {
      this.#receive(message, null);
      return;
    }
    this.#questions.get(message.id)?.(message);
    this.#questions.delete(message.id);
  }

  /** @param {string} reason */
  #refuseQuestions(reason) {
    for (const answer of this.#questions.values()) answer({error: reason});
    this.#questions.clear();
  }

  /**
   * Send a message that is not answered separately.
   * @param {object} message
   */
  say(message) {
    if (this.#socket.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(message));
  }

  /**
   * Send a question and wait for the answer.
   * @param {object} message
   * @returns {Promise<Answer>}
   */
  ask(message) {
    if (this.#socket.readyState !== WebSocket.OPEN) return Promise.resolve({error: 'iccm is not connected'});
    const id = this.#next;
    this.#next += 1;
    return new Promise((answer) => {
      this.#questions.set(id, answer);
      this.say({...message, id});
    });
  }
}

/**
 * Read a binary frame: the length of a JSON text, the text, then floats.
 * @param {ArrayBuffer} data
 */
export function readFrame(data) {
  const length = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, LENGTH_BYTES, length)));
  return {head, floats: new Float32Array(data, LENGTH_BYTES + length)};
}
