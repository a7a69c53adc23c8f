// One connection for all tabs of a browser, which opens six to one address and no more: a shared worker, or a part of the page
// where there is none.
// @ts-check

/**
 * What one tab listens to.
 * @typedef {{ key: string, topic: string, at: string, last: string | null, port: MessagePort }} Listener
 */

/** Without a sound for so long a connection is dead: the server beats every 5 s. */
const SILENT_MS = 11_000;
/** Pause before a lost connection is tried again. */
const AGAIN_MS = 2_000;
/** Letters of a request: the server takes a head of 16 kB. */
const MOST_LETTERS = 8_000;
const EVENTS = ["items", "run", "evolution", "refused"];

/** @param {Listener} listener */
const asked = ({ key, topic, at, last }) => ({ key, topic, at, last });

/** A connection, and what is listened to over it. */
class Line {
  /** @type {Map<string, Listener>} */
  listeners = new Map();
  /** @type {EventSource | null} */
  source = null;
  heard = Date.now();
  timer = 0;

  letters() {
    return encodeURIComponent(JSON.stringify([...this.listeners.values()].map(asked))).length;
  }

  /** Tells every tab. @param {any} message */
  tell(message) {
    for (const { key, port } of this.listeners.values()) port.postMessage({ key, ...message });
  }

  /** Connects anew, soon: what several tabs ask for at once is one request. @param {number} [ms] */
  open(ms = 0) {
    clearTimeout(this.timer);
    this.timer = /** @type {any} */ (setTimeout(() => this.connect(), ms));
  }

  connect() {
    this.source?.close();
    this.source = null;
    this.heard = Date.now();
    if (!this.listeners.size) return;
    const to = JSON.stringify([...this.listeners.values()].map(asked));
    // Relative to this file, also behind a proxy with a path of its own.
    const source = new EventSource(new URL(`../api/stream?${new URLSearchParams({ to })}`, import.meta.url));
    this.source = source;
    const hear = () => (this.heard = Date.now());
    source.addEventListener("beat", (message) => {
      hear();
      this.tell({ beat: Number(message.data) });
    });
    for (const event of EVENTS) {
      source.addEventListener(event, (message) => {
        hear();
        const { key, id, data, error } = JSON.parse(message.data);
        const listener = this.listeners.get(key);
        if (!listener) return;
        if (id !== undefined) listener.last = id;
        listener.port.postMessage({ key, event, data, error });
      });
    }
    // The browser would come back by itself, with what was asked for first.
    source.onerror = () => {
      source.close();
      this.lose();
    };
  }

  lose() {
    this.tell({ isLost: true });
    this.open(AGAIN_MS);
  }

  look() {
    if (!this.listeners.size || Date.now() - this.heard < SILENT_MS) return;
    this.lose();
    this.heard = Date.now();
  }
}

/** @type {Line[]} */
const lines = [];

/** @param {Listener} listener */
function add(listener) {
  const size = encodeURIComponent(JSON.stringify(asked(listener))).length;
  let line = lines.find((one) => one.letters() + size < MOST_LETTERS);
  if (!line) lines.push((line = new Line()));
  line.listeners.set(listener.key, listener);
  line.open();
}

/** @param {string} key */
function drop(key) {
  const line = lines.find((one) => one.listeners.has(key));
  line?.listeners.delete(key);
  // What is left goes on over the same connection.
  if (line && !line.listeners.size) line.open();
}

/** Serves a tab. @param {MessagePort} port */
export function join(port) {
  port.onmessage = ({ data }) => {
    if (data.listen) add({ ...data.listen, last: null, port });
    if (data.drop) drop(data.drop);
  };
}

// Of a shared worker.
/** @type {any} */ (globalThis).onconnect = (/** @type {MessageEvent} */ { ports: [port] }) => join(port);
setInterval(() => lines.forEach((line) => line.look()), 1000);
