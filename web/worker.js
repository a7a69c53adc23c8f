// A worker: one module of tropism, which answers one question after the other.
// @ts-check
/** @type {any} */
let tropism;

/** The length of a JSON text in 32 bits, little end first, the text, and bytes. @param {object} question @param {Uint8Array} bytes */
function packed(question, bytes) {
  const text = new TextEncoder().encode(JSON.stringify(question));
  const whole = new Uint8Array(4 + text.length + bytes.length);
  new DataView(whole.buffer).setUint32(0, text.length, true);
  whole.set(text, 4);
  whole.set(bytes, 4 + text.length);
  return whole;
}

/** @param {object} question @param {Uint8Array} bytes */
function ask(question, bytes) {
  const { memory, reserve, ask: answers, answer } = tropism.exports;
  const written = packed(question, bytes);
  const at = reserve(written.length) >>> 0;
  new Uint8Array(memory.buffer).set(written, at);
  const length = answers() >>> 0;
  const reply = new Uint8Array(memory.buffer, answer() >>> 0, length);
  const size = new DataView(reply.buffer, reply.byteOffset).getUint32(0, true);
  return { json: JSON.parse(new TextDecoder().decode(reply.subarray(4, 4 + size))), bytes: reply.slice(4 + size) };
}

/** What `~` and a letter from a on stand for: letters that a page may not hold. */
const ESCAPED = [0, 10, 13, 60, 126];

/** The bytes of a text that holds seven bits a letter, unpacked. @param {string} text */
function unpacked(text) {
  const packed = new Uint8Array((text.length * 7) >> 3);
  let [held, bits, at] = [0, 0, 0];
  for (let place = 0; place < text.length; place++) {
    const letter = text.charCodeAt(place);
    held = (held << 7) | (letter === 126 ? ESCAPED[text.charCodeAt(++place) - 97] : letter);
    bits += 7;
    if (bits < 8) continue;
    bits -= 8;
    packed[at++] = held >> bits;
    held &= (1 << bits) - 1;
  }
  const stream = new Blob([packed.subarray(0, at)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

addEventListener("message", async ({ data }) => {
  if (data.packed) {
    postMessage({ module: await WebAssembly.compile(await unpacked(data.packed)) });
    return;
  }
  if (data.module) {
    tropism = await WebAssembly.instantiate(data.module, {});
    return;
  }
  const { number, question, bytes } = data;
  try {
    const answer = ask(question, bytes ?? new Uint8Array());
    postMessage({ number, ...answer }, { transfer: [answer.bytes.buffer] });
  } catch (error) {
    // A trap: this module is not to be trusted any more.
    postMessage({ number, json: { error: `The program in the page broke off: ${error}. Load the page again.` }, bytes: null });
  }
});
