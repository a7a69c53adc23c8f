// The modules of the page in Node: what they answer to a question.
import fs from "node:fs";
import path from "node:path";

/** A module of its own: whole, or play, which is without photographs. */
export async function module(name = "whole") {
  const compiled = await WebAssembly.compile(fs.readFileSync(path.join(process.env.TROPISM_WEB, `${name}.wasm`)));
  const { exports } = await WebAssembly.instantiate(compiled, {});
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
