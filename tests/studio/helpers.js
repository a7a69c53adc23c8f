// What the tests share: a folder, the program, a browser.
import { spawn, spawnSync } from "node:child_process";
import { once } from "node:events";
import fs from "node:fs";
import http from "node:http";
import net from "node:net";
import os from "node:os";
import path from "node:path";
import * as node from "node:test";
import { chromium, firefox } from "playwright-core";

export const PROGRAM = path.resolve(process.env.TROPISM ?? "../../target/debug/tropism");
const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";
const FIREFOX = process.env.FIREFOX ?? "";

/** The browser of all tests that name none: `BROWSER=firefox` tries another. */
const BROWSER = process.env.BROWSER ?? "chromium";
/** Whether it can be told to show pages on paper, in the dark and without scripts, and to touch: what drives Firefox cannot. */
export const EMULATES = BROWSER !== "firefox";
/** Those that are installed; Firefox where `FIREFOX` names it. */
export const BROWSERS = Object.entries({ chromium: CHROMIUM, firefox: FIREFOX })
  .filter(([, file]) => fs.existsSync(file))
  .map(([name]) => name);

/** A test that fails by name where a browser or a program answers no more, instead of stopping all that follow. */
export const test = (name, ...rest) => node.test(name, { timeout: 600_000, ...(rest.length > 1 ? rest[0] : {}) }, rest.at(-1));

/** `done`, or an error after `seconds`. */
function within(seconds, done, what) {
  const late = new Promise((_, fail) => setTimeout(() => fail(new Error(`waited ${seconds} s in vain: ${what}`)), seconds * 1000).unref());
  return Promise.race([done, late]);
}

/** The programs that run in folders of tests. */
const running = new Set();

/** What is still to be done at the end of each test. */
const ends = new WeakMap();
/** Does `end` when `t` is over, before all that was asked for earlier: pages close before their studio does. */
function atEnd(t, end) {
  if (!ends.has(t)) {
    ends.set(t, []);
    t.after(async () => {
      const problems = [];
      for (const end of ends.get(t).reverse()) await within(120, Promise.resolve().then(end), `the end of ${t.name}`).catch((problem) => problems.push(problem));
      if (problems.length) throw problems[0];
    });
  }
  ends.get(t).push(end);
}

/** A new folder that is deleted at the end of `t`, when no program writes there any more. */
export function folder(t) {
  const made = fs.mkdtempSync(path.join(os.tmpdir(), "tropism-studio-"));
  atEnd(t, async () => {
    for (const child of [...running].filter(({ cwd }) => cwd.startsWith(made))) {
      // It may have ended while another was waited for.
      if (!running.has(child)) continue;
      const ended = once(child, "exit");
      child.kill("SIGKILL");
      await ended;
    }
    fs.rmSync(made, { recursive: true, force: true, maxRetries: 5 });
  });
  return made;
}

/** Starts the program in `cwd`; it is killed at the end of `t`. */
export function start(t, cwd, ...words) {
  const child = spawn(PROGRAM, words, { cwd, stdio: ["ignore", "pipe", "pipe"] });
  child.said = "";
  child.cwd = cwd;
  running.add(child);
  child.on("exit", () => running.delete(child));
  for (const stream of [child.stdout, child.stderr]) stream.on("data", (data) => (child.said += data));
  atEnd(t, () => child.kill("SIGKILL"));
  return child;
}

/** Waits until `is` gives something true. */
export async function until(is, what, seconds = 60) {
  for (const began = Date.now(); Date.now() - began < seconds * 1000;) {
    const value = await is();
    if (value) return value;
    await new Promise((done) => setTimeout(done, 50));
  }
  throw new Error(`waited ${seconds} s in vain: ${what}`);
}

/** Runs the program to its end: what it said. */
export async function run(t, cwd, ...words) {
  const child = start(t, cwd, ...words);
  const code = await new Promise((done) => child.on("close", done));
  if (code !== 0) throw new Error(`tropism ${words.join(" ")}: ${code}\n${child.said}`);
  return child.said;
}

/** A studio of `cwd`: its process and its address. */
export async function studio(t, cwd, port = 0, ...more) {
  const child = start(t, cwd, "studio", ".", "--listen", `127.0.0.1:${port}`, ...more);
  const address = await until(() => child.said.match(/https?:\/\/\S+/)?.[0], "the studio's address");
  return { child, address };
}

/** A name that no name server knows, for a proxy. */
const UNKNOWN = "plants.example.org";

/** Firefox as Debian has it, by WebDriver BiDi. */
async function launchFirefox() {
  const firefoxUserPrefs = { "network.dns.localDomains": UNKNOWN };
  const launched = await firefox.launch({ executablePath: FIREFOX, channel: "moz-firefox", firefoxUserPrefs });
  // One command of this playwright is younger than the Firefox of a stable Debian: colours stay as they are.
  const sessions = Object.getPrototypeOf(launched._connection.toImpl(launched)._browserSession);
  const { send } = sessions;
  sessions.send = function (method, words) {
    return method === "emulation.setMediaFeaturesOverride" ? Promise.resolve({}) : send.call(this, method, words);
  };
  return launched;
}
const ARGS = ["--no-sandbox", `--host-resolver-rules=MAP ${UNKNOWN} 127.0.0.1`];
const LAUNCH = { chromium: () => chromium.launch({ executablePath: CHROMIUM, args: ARGS }), firefox: launchFirefox };
/** @type {Record<string, Promise<import("playwright-core").Browser>>} */
const browsers = {};

/** A browser of its own cookies, tabs and store: `name` is one of [`BROWSERS`]. */
export async function visitor(t, options = {}, name = BROWSER) {
  browsers[name] ??= LAUNCH[name]();
  const { isMobile, ...others } = options;
  const own = name === "firefox" ? others : options;
  const context = await (await browsers[name]).newContext({ viewport: { width: 1280, height: 900 }, ...own });
  context.problems = [];
  atEnd(t, async () => {
    // A Chromium under load now and then never answers that many tabs are closed. Nothing of ours depends on it.
    await within(20, context.close(), "tabs close").catch(({ message }) => {
      t.diagnostic(`${message}: the next test starts another browser`);
      delete browsers[name];
    });
    if (context.problems.length) throw new Error(context.problems.join("\n"));
  });
  return context;
}
/** What drives this Firefox makes no clicks of touches, and writes behind what stands in a field. */
function mend(opened) {
  const locators = Object.getPrototypeOf(opened.locator("body"));
  locators.tap = function (options) {
    return this.click(options);
  };
  const fill = (locators.fillAnew ??= locators.fill);
  locators.fill = async function (value) {
    await this.evaluate((field) => (field.value = ""));
    await fill.call(this, value);
    // It tells the page of what was written, and not that it is all.
    await this.dispatchEvent("change");
  };
  opened.tap = (selector, options) => opened.click(selector, options);
  opened.fill = (selector, value) => opened.locator(selector).fill(value);
  opened.touchscreen.tap = (x, y) => opened.mouse.click(x, y);
}
/** A tab of `context` at `address`; what goes wrong on it fails the test. */
export async function tab(context, address) {
  const opened = await context.newPage();
  if (context.browser()?.browserType().name() === "firefox") mend(opened);
  opened.on("pageerror", (error) => context.problems.push(error.message));
  opened.on("console", (message) => {
    // A lost connection is part of some tests.
    const isLost = /ERR_CONNECTION|ERR_INCOMPLETE|Failed to load resource|net::|can.t establish a connection/.test(message.text());
    if (message.type() === "error" && !isLost) context.problems.push(message.text());
  });
  await opened.goto(address);
  return opened;
}
/** A finger on `opened`, which touches, moves and lifts; a mouse where the browser cannot be told to touch. */
export async function finger(opened) {
  if (!EMULATES) {
    return async (type, [at] = []) => {
      if (at) await opened.mouse.move(at.x, at.y);
      if (type === "touchStart") await opened.mouse.down();
      if (type === "touchEnd") await opened.mouse.up();
    };
  }
  const session = await opened.context().newCDPSession(opened);
  return (type, touchPoints = []) => session.send("Input.dispatchTouchEvent", { type, touchPoints });
}
/** A page at `address` in a browser of its own. */
export const page = async (t, address, options = {}) => tab(await visitor(t, options), address);
export const close = async () => {
  for (const browser of Object.values(browsers)) await within(20, (await browser).close(), "a browser closes").catch(() => {});
};

/** Lets `server` listen on this computer: its address. */
export async function listening(server) {
  await new Promise((done) => server.listen(0, "127.0.0.1", () => done(undefined)));
  return `http://127.0.0.1:${server.address().port}`;
}

/** A network between browser and studio: it counts requests, and is cut, or falls silent and comes back. */
export async function network(t, address) {
  const { hostname, port } = new URL(address);
  const sockets = new Set();
  const state = { asked: [], isSilent: false };
  const server = net.createServer((near) => {
    const far = net.connect(Number(port), hostname);
    for (const [from, to] of [[near, far], [far, near]]) {
      sockets.add(from);
      from.on("data", (data) => {
        if (from === near) state.asked.push(...(data.toString("latin1").match(/^(GET|POST) \S+/gm) ?? []));
        if (!state.isSilent) to.write(data);
      });
      from.on("error", () => {});
      from.on("close", () => {
        sockets.delete(from);
        if (!state.isSilent) to.destroy();
      });
    }
  });
  const own = await listening(server);
  const cut = () => sockets.forEach((socket) => socket.destroy());
  atEnd(t, () => {
    cut();
    server.close();
  });
  return { address: `${own}/`, state, cut };
}

/** A WLED controller, as its documentation describes it. */
export async function wled(t) {
  const segments = new Map();
  let uptime = 0;
  const server = http.createServer(async (request, response) => {
    let body = "";
    for await (const part of request) body += part;
    for (const segment of body ? (JSON.parse(body).seg ?? []) : []) segments.set(segment.id, segment);
    const info = { leds: { count: 288 }, uptime: uptime++, live: false };
    const state = { on: true, bri: 255, seg: [...segments.values()] };
    response.end(JSON.stringify(request.url?.includes("/json/info") ? info : state));
  });
  const url = await listening(server);
  atEnd(t, () => server.close());
  return { url, lit: () => [...segments.values()].filter((segment) => segment.on).map((segment) => segment.id) };
}

/** Photographs of the run in `at`. */
export const photographs = (cwd, at) => {
  const place = path.join(cwd, at, "photographs");
  return fs.existsSync(place) ? fs.readdirSync(place).length : 0;
};

/** Where a plant is in photographs of the virtual tent. */
const CROP = "[vision.crop]\nx = 8\ny = 20\nwidth = 631\nheight = 379\n";

/** Writes `cwd/rig.toml`: two lamps of the WLED controller at `url`, the keys of a camera, and `more` tables. */
export function wledRig(cwd, url, camera, more = "") {
  const lamp = (name, segment) => `[lamps.${name}]
driver = "wled"
url = "${url}"
segment = ${segment}
dead_man_min = 0
strip = { first = ${144 * segment}, pixels = 144 }
`;
  const lamps = lamp("left", 0) + lamp("right", 1);
  fs.writeFileSync(path.join(cwd, "rig.toml"), `period_min = 5\n[fault_policy]\nfree_mb = 0\n[camera]\n${camera}\n${lamps}${CROP}${more}`);
}

/** A run of a real rig that goes on in `cwd/bean`: recorded photographs, a step every `seconds` by the clock. */
export async function realRun(t, cwd, seconds) {
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "periodic", "--steps", "120", "--out", "tent");
  const calibration = fs.readFileSync(path.join(cwd, "tent/calibration.toml"), "utf8").replace("[base]", "[calibration.base]");
  const lamp = (name) => `${name} = ["true", "${name}"]`;
  fs.writeFileSync(
    path.join(cwd, "rig.toml"),
    `period_min = ${seconds / 60}
[fault_policy]
free_mb = 0
[camera]
driver = "replay"
folder = ${JSON.stringify(path.join(cwd, "tent/photographs"))}
[lamps]
${["left", "right", "dark"].map(lamp).join("\n")}
${CROP}[calibration]
${calibration}`,
  );
  return start(t, cwd, "run", "--rig", "rig.toml", "--controller", "periodic", "--steps", "119", "--out", "bean");
}

/** `count` runs that are over, fifty in a folder: `lab-1/bean-1` and so on. */
export async function manyRuns(t, cwd, count) {
  fs.mkdirSync(path.join(cwd, "lab-1"));
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--steps", "2", "--out", "lab-1/bean-1");
  for (let number = 1; number < count; number++) {
    const to = `lab-${1 + Math.floor(number / 50)}/bean-${1 + (number % 50)}`;
    fs.cpSync(path.join(cwd, "lab-1/bean-1"), path.join(cwd, to), { recursive: true });
  }
}

/** The journal of the run in `cwd/at`: numbers of the steps that were seen, decided and confirmed, and kinds of events. */
export function journal(cwd, at) {
  // What follows the last line break is still being written.
  const lines = fs.readFileSync(path.join(cwd, at, "journal.jsonl"), "utf8").split("\n").slice(0, -1);
  const entries = lines.map((line) => JSON.parse(line).slice(1));
  const of = (name, place) => entries.filter((entry) => entry[0] === name).map((entry) => entry[place]);
  return { saw: of("saw", 1), decided: of("decided", 2), done: of("done", 1), events: of("event", 2) };
}

/** Makes a certificate for `names` in `cwd` that nobody has signed. */
export function certificate(cwd, names) {
  const words = ["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2"];
  const files = ["-keyout", "key.pem", "-out", "certificate.pem", "-subj", "/CN=beans"];
  const made = spawnSync("openssl", [...words, ...files, "-addext", `subjectAltName=${names}`], { cwd });
  if (made.status !== 0) throw new Error(`openssl: ${made.stderr}`);
  fs.chmodSync(path.join(cwd, "key.pem"), 0o600);
}
