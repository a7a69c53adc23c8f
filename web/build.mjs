// Builds the page in a browser: node web/build.mjs OUT. Called by scripts/web.
//
// OUT has whole.wasm, which is tropism-wasm, and play.wasm, the same without photographs. Into it: tropism.html, one file that works from a disk,
// and site/, the same as a static folder with a service worker, which fetches the whole when it is needed. Scripts are plain modules; TypeScript turns each into a function that keeps live bindings, and a few
// lines load them. Where a module of the studio asks for the studio, it gets web/studio.js.
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const ROOT = fileURLToPath(new URL("..", import.meta.url));
const ASSETS = path.join(ROOT, "crates/tropism-studio/assets");
const WEB = path.join(ROOT, "web");
const [, , out] = process.argv;
const ts = createRequire(path.join(ROOT, "tests/studio/package.json"))("typescript");
const read = (...parts) => fs.readFileSync(path.join(...parts), "utf8");
/** Without the blanks before lines, of which a browser needs none. */
const flush = (text) => text.replace(/^[ \t]+/gm, "");
/** A script without comments, too. */
function lean(file) {
  const options = { module: ts.ModuleKind.CommonJS, target: ts.ScriptTarget.ES2022, removeComments: true };
  return flush(ts.transpileModule(read(file), { compilerOptions: options }).outputText);
}
const sha256 = (text) => createHash("sha256").update(text).digest("base64");

/** The scripts that `entry` needs, as one. Each runs in a task of its own, so that none holds up the page for long. */
function bundle(entry) {
  const places = new Map();
  const all = [];
  /** Those that a script needs come before it. */
  const order = [];
  const add = (file) => {
    if (places.has(file)) return places.get(file);
    const place = all.length;
    places.set(file, place);
    all.push("");
    const links = {};
    for (const [, name] of read(file).matchAll(/^(?:import|export)\b[^;]*?["'](\.[^"']+)["'];/gms)) {
      const found = path.resolve(path.dirname(file), name);
      links[name] = add(found === path.join(ASSETS, "studio.js") ? path.join(WEB, "studio.js") : found);
    }
    all[place] = `[function(exports,require){${lean(file)}},${JSON.stringify(links)}]`;
    order.push(place);
    return place;
  };
  add(entry);
  return `(()=>{const all=[${all.join(",\n")}],made=[];
const load=(place)=>{if(!made[place]){made[place]={};const[make,links]=all[place];make(made[place],(name)=>load(links[name]))}return made[place]};
(async()=>{for(const place of ${JSON.stringify(order)}){load(place);await new Promise((done)=>setTimeout(done))}})()})()`;
}

/** What a module answers to one question. */
async function ask(wasm, question) {
  const { exports } = await WebAssembly.instantiate(await WebAssembly.compile(wasm), {});
  const text = new TextEncoder().encode(JSON.stringify(question));
  const at = exports.reserve(4 + text.length) >>> 0;
  new DataView(exports.memory.buffer).setUint32(at, text.length, true);
  new Uint8Array(exports.memory.buffer).set(text, at + 4);
  const length = exports.ask() >>> 0;
  const reply = Buffer.from(exports.memory.buffer, exports.answer() >>> 0, length);
  return reply.subarray(4, 4 + reply.readUInt32LE()).toString();
}

/** The style sheet of the paper's figures, on light and dark ground as the page has it. */
function figures(sheet) {
  const dark = [...sheet.matchAll(/@media[^{]*\{((?:[^{}]*\{[^{}]*\})*)\}/g)].map(([, rules]) => rules).join("");
  const light = sheet.replace(/@media[^{]*\{(?:[^{}]*\{[^{}]*\})*\}/g, "");
  return `.paper-figure{${light}}
@media (prefers-color-scheme:dark){:root:not([data-theme=light]) .paper-figure{${dark}}}
:root[data-theme=dark] .paper-figure{${dark}}`;
}

/** Bytes as text: seven bits a letter, and two letters for those that a page may not hold. As web/worker.js reads it. */
function sevenBits(bytes) {
  const ESCAPED = [0, 10, 13, 60, 126];
  let [text, held, bits] = ["", 0, 0];
  const add = (letter) => {
    const place = ESCAPED.indexOf(letter);
    text += place < 0 ? String.fromCharCode(letter) : `~${"abcde"[place]}`;
  };
  for (const byte of bytes) {
    held = (held << 8) | byte;
    bits += 8;
    while (bits >= 7) {
      bits -= 7;
      add((held >> bits) & 127);
    }
    held &= 127;
  }
  if (bits) add((held << (7 - bits)) & 127);
  return text;
}

/** As a .lzma file whose head holds the size, so that web/worker.js knows it beforehand. */
function lzma(bytes) {
  const packed = execFileSync("xz", ["--format=lzma", "--lzma1=preset=9e,lc=4,pb=0", "--stdout"], { input: bytes, maxBuffer: 2 ** 28 });
  packed.writeBigUInt64LE(BigInt(bytes.length), 5);
  return packed;
}

const wasm = fs.readFileSync(path.join(out, "whole.wasm"));
const packed = { whole: lzma(wasm), play: lzma(fs.readFileSync(path.join(out, "play.wasm"))) };
const script = bundle(path.join(WEB, "app.js"));
/** Styles of the studio's other pages. */
const OTHERS = ["style/run.css", "style/overview.css", "style/tune.css"];
const shared = read(ASSETS, "style.css").replace(/^@import "(.+)";$/gm, (_, file) => (OTHERS.includes(file) ? "" : read(ASSETS, file)));
const sheet = `${shared}\n${read(WEB, "web.css")}\n${figures(JSON.parse(await ask(wasm, { style: {} })))}`;
const style = flush(sheet.replace(/\/\*.*?\*\//gs, ""));
const draw = read(ASSETS, "draw.html").match(/<main id="main">(.*)<\/main>/s)[1];
const data = {
  worker: lean(path.join(WEB, "worker.js")),
  reach: await ask(wasm, { reach: {} }),
  champion: read(WEB, "champion.json"),
  rule: read(ROOT, "benchmarks/submissions/tuned-rule/rule.json"),
};
/** What a page carries. */
function blocks(carried) {
  for (const [name, text] of Object.entries({ script, ...carried }))
    if (/<\/script|<!--/i.test(text)) throw new Error(`${name} would end the element that holds it`);
  return Object.entries(carried).map(([name, text]) => `<script type="text/plain" id="data-${name}">${text}</script>`).join("\n    ");
}
const version = read(ROOT, "Cargo.toml").match(/^version = "(.*)"/m)[1];

/** The page; `own` is what it may load besides itself. */
function page(carried, links, own) {
  const policy = [
    "default-src 'none'",
    `script-src 'sha256-${sha256(script)}' 'wasm-unsafe-eval'`,
    `style-src 'sha256-${sha256(style)}'`,
    `worker-src blob:${own}`,
    "img-src blob: data:" + own,
    ...(own ? [`manifest-src${own}`, `connect-src${own}`] : []),
    "base-uri 'none'",
    "form-action 'none'",
  ].join("; ");
  const fill = { policy, links, style, draw, data: blocks(carried), script, version };
  return read(WEB, "index.html").replace(/\{\{(\w+)\}\}/g, (_, name) => fill[name]);
}

const icon = read(ASSETS, "icon.svg").trim();
const inline = `<link rel="icon" href="data:image/svg+xml,${encodeURIComponent(icon)}" />`;
const linked = '<link rel="icon" href="icon.svg" type="image/svg+xml" />\n    <link rel="manifest" href="manifest.webmanifest" />';
const site = path.join(out, "site");
fs.mkdirSync(site, { recursive: true });
const alone = page({ whole: sevenBits(packed.whole), ...data }, inline, "");
fs.writeFileSync(path.join(out, "tropism.html"), alone);
const served = page(data, linked, " 'self'").replace('<body data-page="web"', '<body data-page="web" data-worker="sw.js"');
fs.writeFileSync(path.join(site, "index.html"), served);
fs.writeFileSync(path.join(site, "sw.js"), read(WEB, "sw.js").replace("{{version}}", sha256(Buffer.concat([Buffer.from(served), ...Object.values(packed)])).slice(0, 12)));
fs.writeFileSync(path.join(site, "icon.svg"), icon);
fs.writeFileSync(path.join(site, "manifest.webmanifest"), read(WEB, "manifest.webmanifest"));

for (const [name, bytes] of Object.entries(packed)) fs.writeFileSync(path.join(site, `${name}.lzma`), bytes);

const compressed = (text) => gzipSync(text, { level: 9 }).length;
console.log(`${path.join(out, "tropism.html")}: ${alone.length} bytes, ${compressed(alone)} compressed`);
console.log(`${site}: ${compressed(served) + packed.play.length} bytes compressed before photographs, ${packed.whole.length} for them`);
if (alone.length > 1_500_000) console.error("larger than the 1.5 MB that one file should have");
