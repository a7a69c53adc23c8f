// The engine: tropism as WebAssembly in workers, so that the page never waits.
// @ts-check

/** What is embedded in the page, by its id. @param {string} id */
const embedded = (id) => document.getElementById(id)?.textContent ?? "";

/** JSON or text that the page carries. @param {string} id */
export const carried = (id) => embedded(`data-${id}`);

const script = URL.createObjectURL(new Blob([embedded("data-worker")], { type: "text/javascript" }));
/** The module, unpacked and compiled in a worker of its own. @type {Promise<WebAssembly.Module>} */
const compiled = new Promise((done, failed) => {
  const worker = new Worker(script);
  worker.onerror = failed;
  worker.onmessage = ({ data }) => {
    done(data.module);
    worker.terminate();
  };
  worker.postMessage({ packed: embedded("data-module") });
});

/** @typedef {{ json: any, bytes: Uint8Array | null }} Answer */

/** A module in a worker of its own. */
export class Engine {
  constructor() {
    this.worker = new Worker(script);
    this.number = 0;
    /** @type {Map<number, { done: (answer: Answer) => void, failed: (error: Error) => void }>} */
    this.waiting = new Map();
    this.worker.onmessage = ({ data: { number, json, bytes } }) => {
      const { done, failed } = this.waiting.get(number) ?? {};
      this.waiting.delete(number);
      if (json?.error !== undefined) failed?.(new Error(json.error));
      else done?.({ json, bytes });
    };
    this.ready = compiled.then((module) => this.worker.postMessage({ module }));
  }

  /** Asks with bytes, and gets bytes. @param {object} question @param {Uint8Array} [bytes] @returns {Promise<Answer>} */
  async askFor(question, bytes) {
    await this.ready;
    const number = ++this.number;
    return new Promise((done, failed) => {
      this.waiting.set(number, { done, failed });
      this.worker.postMessage({ number, question, bytes });
    });
  }

  /** @param {object} question @returns {Promise<any>} */
  async ask(question) {
    return (await this.askFor(question)).json;
  }

  /** Ends it, whatever it does. */
  end() {
    this.worker.terminate();
    for (const { failed } of this.waiting.values()) failed(new Error("stopped"));
    this.waiting.clear();
  }
}

/** The one that answers at once: beans that are tried, tasks, figures. */
export const lead = new Engine();

/** How many workers evolve: one a core, four at most. */
export const HANDS = Math.max(1, Math.min(4, navigator.hardwareConcurrency || 2));
