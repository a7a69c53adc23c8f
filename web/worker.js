// A worker: one module of tropism, which answers one question after the other.
// @ts-check
/** The module, once it is instantiated: questions may come before. @type {Promise<any>} */
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

/** @param {any} exports what the module can do @param {object} question @param {Uint8Array} bytes */
function ask({ memory, reserve, ask: answers, answer }, question, bytes) {
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

/** The bytes of a text that holds seven bits a letter. @param {string} text */
function bytesOf(text) {
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
  return packed;
}

/**
 * The bytes of a .lzma file whose size is known, by the range decoder and the state machine of Igor Pavlov's LZMA specification
 * (7-zip.org/sdk.html). A quarter smaller than gzip, which browsers unpack by themselves.
 * @param {Uint8Array} data
 */
function unlzma(data) {
  const head = new DataView(data.buffer, data.byteOffset);
  const [literalBits, literalPlaces, places] = [data[0] % 9, Math.floor(data[0] / 9) % 5, Math.floor(data[0] / 45)];
  const out = new Uint8Array(head.getUint32(5, true));
  const odds = (/** @type {number} */ count) => new Uint16Array(count).fill(1024);
  /** Range and code of the coder: in an array, for variables of closures would hold each such number in a box. */
  const coder = new Uint32Array([0xffffffff, head.getUint32(14)]);
  let place = 18;
  const refill = () => {
    if (coder[0] >= 0x1000000) return;
    coder[0] <<= 8;
    coder[1] = (coder[1] << 8) | data[place++];
  };
  const bit = (/** @type {Uint16Array} */ of, /** @type {number} */ at) => {
    const bound = (coder[0] >>> 11) * of[at];
    const found = coder[1] < bound ? 0 : 1;
    if (found) {
      coder[0] -= bound;
      coder[1] -= bound;
      of[at] -= of[at] >> 5;
    } else {
      coder[0] = bound;
      of[at] += (2048 - of[at]) >> 5;
    }
    refill();
    return found;
  };
  const tree = (/** @type {Uint16Array} */ of, /** @type {number} */ from, /** @type {number} */ bits) => {
    let node = 1;
    for (let k = 0; k < bits; k++) node = (node << 1) | bit(of, from + node);
    return node - (1 << bits);
  };
  const reversed = (/** @type {Uint16Array} */ of, /** @type {number} */ from, /** @type {number} */ bits) => {
    let [node, value] = [1, 0];
    for (let k = 0; k < bits; k++) {
      const found = bit(of, from + node);
      node = (node << 1) | found;
      value |= found << k;
    }
    return value;
  };
  const lengths = () => ({ choice: odds(2), low: odds(128), middle: odds(128), high: odds(256) });
  const length = (/** @type {ReturnType<typeof lengths>} */ of, /** @type {number} */ at) => {
    if (!bit(of.choice, 0)) return 2 + tree(of.low, at << 3, 3);
    return bit(of.choice, 1) ? 18 + tree(of.high, 0, 8) : 10 + tree(of.middle, at << 3, 3);
  };
  const [isMatch, isShort] = [odds(192), odds(192)];
  const [isRepeat, isFirst, isSecond, isThird] = [odds(12), odds(12), odds(12), odds(12)];
  const [slots, near, low, literals] = [odds(256), odds(128), odds(16), odds(0x300 << (literalBits + literalPlaces))];
  const [ofMatch, ofRepeat] = [lengths(), lengths()];
  const distance = (/** @type {number} */ count) => {
    const slot = tree(slots, Math.min(count - 2, 3) << 6, 6);
    if (slot < 4) return slot;
    const bits = (slot >> 1) - 1;
    const base = (2 | (slot & 1)) * 2 ** bits;
    if (slot < 14) return base + reversed(near, base - slot, bits);
    let middle = 0;
    for (let k = 4; k < bits; k++) {
      coder[0] >>>= 1;
      const found = coder[1] < coder[0] ? 0 : 1;
      coder[1] -= found * coder[0];
      middle = middle * 2 + found;
      refill();
    }
    return base + middle * 16 + reversed(low, 0, 4);
  };
  let [state, at, last] = [0, 0, [0, 0, 0, 0]];
  while (at < out.length) {
    const step = at & ((1 << places) - 1);
    if (!bit(isMatch, (state << 4) + step)) {
      const before = at ? out[at - 1] : 0;
      const from = 0x300 * (((at & ((1 << literalPlaces) - 1)) << literalBits) + (before >> (8 - literalBits)));
      let byte = 1;
      if (state >= 7) {
        // After a match the byte at its distance is a hint, as far as it is right.
        let hint = out[at - last[0] - 1];
        while (byte < 256) {
          const wanted = (hint >> 7) & 1;
          hint <<= 1;
          const found = bit(literals, from + ((1 + wanted) << 8) + byte);
          byte = (byte << 1) | found;
          if (found !== wanted) break;
        }
      }
      while (byte < 256) byte = (byte << 1) | bit(literals, from + byte);
      out[at++] = byte;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
      continue;
    }
    let count = 1;
    if (!bit(isRepeat, state)) {
      count = length(ofMatch, step);
      last = [distance(count), last[0], last[1], last[2]];
      state = state < 7 ? 7 : 10;
    } else {
      // One of the last four distances, which goes to the front.
      const which = !bit(isFirst, state) ? 0 : !bit(isSecond, state) ? 1 : 2 + bit(isThird, state);
      if (which === 0 && !bit(isShort, (state << 4) + step)) {
        state = state < 7 ? 9 : 11;
      } else {
        last.unshift(...last.splice(which, 1));
        count = length(ofRepeat, step);
        state = state < 7 ? 8 : 11;
      }
    }
    for (const end = Math.min(at + count, out.length); at < end; at++) out[at] = out[at - last[0] - 1];
  }
  return out;
}

addEventListener("message", async ({ data }) => {
  if (data.packed) {
    postMessage({ module: await WebAssembly.compile(unlzma(typeof data.packed === "string" ? bytesOf(data.packed) : data.packed)) });
    return;
  }
  if (data.module) {
    tropism = WebAssembly.instantiate(data.module, {});
    return;
  }
  const { number, question, bytes } = data;
  try {
    const answer = ask((await tropism).exports, question, bytes ?? new Uint8Array());
    postMessage({ number, ...answer }, { transfer: [answer.bytes.buffer] });
  } catch (error) {
    // A trap: this module is not to be trusted any more.
    postMessage({ number, json: { error: `The program in the page broke off: ${error}. Load the page again.` }, bytes: null });
  }
});
