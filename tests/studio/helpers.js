// What the tests share: a folder, the program, a browser.
import { spawn, spawnSync } from "node:child_process";
import { once } from "node:events";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { chromium } from "playwright-core";

const PROGRAM = path.resolve(process.env.TROPISM ?? "../../target/debug/tropism");
const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";

/** The programs that run in folders of tests. */
const running = new Set();

/** A new folder that is deleted at the end of `t`, when no program writes there any more. */
export function folder(t) {
  const made = fs.mkdtempSync(path.join(os.tmpdir(), "tropism-studio-"));
  t.after(async () => {
    for (const child of [...running].filter(({ cwd }) => cwd.startsWith(made))) {
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
  t.after(() => child.kill("SIGKILL"));
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

/** Runs the program to its end. */
export async function run(t, cwd, ...words) {
  const child = start(t, cwd, ...words);
  const code = await new Promise((done) => child.on("close", done));
  if (code !== 0) throw new Error(`tropism ${words.join(" ")}: ${code}\n${child.said}`);
}

/** A studio of `cwd`: its process and its address. */
export async function studio(t, cwd, port = 0, ...more) {
  const child = start(t, cwd, "studio", ".", "--listen", `127.0.0.1:${port}`, ...more);
  const address = await until(() => child.said.match(/https?:\/\/\S+/)?.[0], "the studio's address");
  return { child, address };
}

let browser;
/** A page at `address`; what goes wrong on it fails the test. */
export async function page(t, address, options = {}) {
  // A name that no name server knows, for a proxy.
  const args = ["--no-sandbox", "--host-resolver-rules=MAP plants.example.org 127.0.0.1"];
  browser ??= await chromium.launch({ executablePath: CHROMIUM, args });
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const opened = await context.newPage();
  opened.problems = [];
  opened.on("pageerror", (error) => opened.problems.push(error.message));
  opened.on("console", (message) => {
    // A lost connection is part of some tests.
    const isLost = /ERR_CONNECTION|ERR_INCOMPLETE|Failed to load resource|net::/.test(message.text());
    if (message.type() === "error" && !isLost) opened.problems.push(message.text());
  });
  t.after(async () => {
    await context.close();
    if (opened.problems.length) throw new Error(opened.problems.join("\n"));
  });
  // While one works on the pages: as they are in the sources, without a build.
  if (process.env.ASSETS)
    await context.route(/\/assets\/\w+\.(js|css)$/, (route) =>
      route.fulfill({ path: path.join(process.env.ASSETS, path.basename(new URL(route.request().url()).pathname)) }),
    );
  await opened.goto(address);
  return opened;
}
export const close = async () => browser?.close();

/** Photographs of the run in `at`. */
export const photographs = (cwd, at) => {
  const place = path.join(cwd, at, "photographs");
  return fs.existsSync(place) ? fs.readdirSync(place).length : 0;
};

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
[vision.crop]
x = 8
y = 20
width = 631
height = 379
[calibration]
${calibration}`,
  );
  return start(t, cwd, "run", "--rig", "rig.toml", "--controller", "periodic", "--steps", "119", "--out", "bean");
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
