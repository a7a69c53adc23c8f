// What the tests share: a folder, the program, a browser.
import { spawn } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { chromium } from "playwright-core";

const PROGRAM = path.resolve(process.env.TROPISM ?? "../../target/debug/tropism");
const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";

/** A new folder that is deleted at the end of `t`. */
export function folder(t) {
  const made = fs.mkdtempSync(path.join(os.tmpdir(), "tropism-studio-"));
  t.after(() => fs.rmSync(made, { recursive: true, force: true, maxRetries: 5 }));
  return made;
}

/** Starts the program in `cwd`; it is killed at the end of `t`. */
export function start(t, cwd, ...words) {
  const child = spawn(PROGRAM, words, { cwd, stdio: ["ignore", "pipe", "pipe"] });
  child.said = "";
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
  const address = await until(() => child.said.match(/http:\/\/\S+/)?.[0], "the studio's address");
  return { child, address };
}

let browser;
/** A page at `address`; what goes wrong on it fails the test. */
export async function page(t, address, options = {}) {
  browser ??= await chromium.launch({ executablePath: CHROMIUM, args: ["--no-sandbox"] });
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
  await opened.goto(address);
  return opened;
}
export const close = async () => browser?.close();

/** Photographs of the run in `at`. */
export const photographs = (cwd, at) => {
  const place = path.join(cwd, at, "photographs");
  return fs.existsSync(place) ? fs.readdirSync(place).length : 0;
};
