// The engine: tropism as WebAssembly in workers, so that the page never waits.
// @ts-check

/** What is embedded in the page, by its id. @param {string} id */
const embedded = (id) => document.getElementById(id)?.textContent ?? "";

/** JSON or text that the page carries. @param {string} id */
export const carried = (id) => embedded(`data-${id}`);

const script = URL.createObjectURL(new Blob([embedded("data-worker")], { type: "text/javascript" }));

/** One file carries the whole module. In a folder it lies beside the page, as does one that plays and evolves, half as large. */
const whole = embedded("data-whole");
const FIRST = whole ? "whole" : "play";

/** A packed module. @param {string} name */
async function packed(name) {
  if (whole) return whole;
  const found = await fetch(`${name}.lzma`);
  if (!found.ok) throw new Error(`${name}.lzma is not beside the page: ${found.status}`);
  return new Uint8Array(await found.arrayBuffer());
}

/** Unpacks and compiles a module in a worker of its own. @param {string} name @returns {Promise<WebAssembly.Module>} */
async function compiled(name) {
  const bytes = await packed(name);
  return new Promise((done, failed) => {
    const worker = new Worker(script);
    worker.onerror = failed;
    worker.onmessage = ({ data }) => {
      done(data.module);
      worker.terminate();
    };
    worker.postMessage({ packed: bytes });
  });
}
/** @type {Map<string, Promise<WebAssembly.Module>>} */
const modules = new Map();

/** @typedef {{ json: any, bytes: Uint8Array | null }} Answer */

/** A module in a worker of its own. */
export class Engine {
  /** @param {string} name whole for photographs, the tent and constants; play for all else */
  constructor(name = FIRST) {
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
    const module = modules.get(name) ?? compiled(name);
    modules.set(name, module);
    // A module that was not to be had is asked for again.
    module.catch(() => modules.delete(name));
    this.ready = module.then((module) => this.worker.postMessage({ module }));
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
