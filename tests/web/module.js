// The module of the page in Node: what it answers to a question.
import fs from "node:fs";

const compiled = WebAssembly.compile(fs.readFileSync(process.env.TROPISM_WASM));

/** A module of its own. */
export async function module() {
  const { exports } = await WebAssembly.instantiate(await compiled, {});
  /** @param {object} question @param {Uint8Array} [bytes] */
  return (question, bytes = new Uint8Array()) => {
    const text = new TextEncoder().encode(JSON.stringify(question));
    const at = exports.reserve(4 + text.length + bytes.length) >>> 0;
    new DataView(exports.memory.buffer).setUint32(at, text.length, true);
    const memory = new Uint8Array(exports.memory.buffer);
    memory.set(text, at + 4);
    memory.set(bytes, at + 4 + text.length);
    const length = exports.ask() >>> 0;
    const reply = Buffer.from(exports.memory.buffer, exports.answer() >>> 0, length);
    const size = reply.readUInt32LE();
    return { json: JSON.parse(reply.subarray(4, 4 + size)), bytes: Buffer.from(reply.subarray(4 + size)) };
  };
}
