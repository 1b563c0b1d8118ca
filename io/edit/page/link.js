// The conversation with the server: JSON both ways, and maps as binary frames (see io/edit/scene.py).

const TAKEN = 4001, TRIES = 4, PAUSE = 500, SELDOM = 2000;

export class Link {
  #socket = null;
  #asked = new Map();
  #next = 1;

  /** `hear(message, floats)` gets what the server says of itself, `end(sentence)` that it is gone; it may come again. */
  constructor(hear, end) {
    this.hear = hear;
    this.end = end;
    this.#open(TRIES);
  }

  #open(tries) {
    const socket = new WebSocket(new URL('link', location.href).href.replace(/^http/, 'ws'));
    socket.binaryType = 'arraybuffer';
    socket.onmessage = (event) => { tries = TRIES; this.#received(event.data); };
    socket.onclose = (event) => {
      for (const answer of this.#asked.values()) answer({error: 'the connection was lost'});
      this.#asked.clear();
      if (event.code === TAKEN) this.end('This pair is being edited in another tab.');
      else {
        if (tries === 0) this.end('iccm has ended. Start it again by the same command: this page goes on then.');
        setTimeout(() => this.#open(tries - 1), tries > 0 ? PAUSE : SELDOM);
      }
    };
    this.#socket = socket;
  }

  #received(data) {
    if (typeof data === 'string') {
      const message = JSON.parse(data);
      if (message.type !== 'answer') return this.hear(message, null);
      this.#asked.get(message.id)?.(message);
      return this.#asked.delete(message.id);
    }
    const length = new DataView(data).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    this.hear(head, new Float32Array(data, 4 + length));
  }

  /** Say something that has no answer of its own. */
  say(message) {
    if (this.#socket.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(message));
  }

  /** Ask, and wait for the answer; {error} where there is none. */
  ask(message) {
    if (this.#socket.readyState !== WebSocket.OPEN) return Promise.resolve({error: 'iccm is not connected'});
    const id = this.#next++;
    return new Promise((answer) => {
      this.#asked.set(id, answer);
      this.say({...message, id});
    });
  }
}
