// WebKit as Debian has it, by the WebDriver protocol: playwright drives only a build of its own.
import { spawn } from "node:child_process";
import fs from "node:fs";
import { until } from "./helpers.js";

const DRIVER = process.env.WEBKIT ?? "/usr/bin/WebKitWebDriver";
const XVFB = "/usr/bin/Xvfb";
/** The browser of the driver's own tests. */
const BROWSER = ["4.1", "6.0", "4.0"].map((version) => `/usr/lib/${process.arch === "arm64" ? "aarch64" : "x86_64"}-linux-gnu/webkit2gtk-${version}/MiniBrowser`).find((file) => fs.existsSync(file));

/** Why there is no WebKit here, if there is none. */
export const lacking = [DRIVER, XVFB, BROWSER].every((file) => file && fs.existsSync(file)) ? false : "no webkit2gtk-driver or Xvfb";

const beside = (file, words, env = {}) => spawn(file, words, { stdio: "ignore", detached: true, env: { ...process.env, ...env } });

/** A browser with one window. */
export async function webkit(t, port) {
  const display = `:${port}`;
  // One that was killed leaves its own.
  for (const file of [`/tmp/.X11-unix/X${port}`, `/tmp/.X${port}-lock`]) fs.rmSync(file, { force: true });
  const screen = beside(XVFB, [display, "-screen", "0", "1280x900x24", "-nolisten", "tcp"]);
  await until(() => fs.existsSync(`/tmp/.X11-unix/X${port}`), "the screen");
  // The sandbox wants rights that root in a container lacks; pages here are our own.
  const driver = beside(DRIVER, [`--port=${port}`], { DISPLAY: display, WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS: "1", LIBGL_ALWAYS_SOFTWARE: "1" });
  let session = "";
  // With the browser, which the driver has started.
  t.after(() => [driver, screen].forEach(({ pid }) => process.kill(-pid, "SIGKILL")));
  /** One command of the protocol. */
  const ask = async (method, path, body) => {
    const answer = await fetch(`http://127.0.0.1:${port}${session}${path}`, { method, body: body && JSON.stringify(body), signal: AbortSignal.timeout(60_000) });
    const { value } = await answer.json();
    if (!answer.ok) throw new Error(`${method} ${path}: ${value.message}`);
    return value;
  };
  await until(() => ask("GET", "/status").catch(() => false), "the driver");
  const options = { binary: BROWSER, args: ["--automation"] };
  const { sessionId } = await ask("POST", "/session", { capabilities: { alwaysMatch: { "webkitgtk:browserOptions": options } } });
  session = `/session/${sessionId}`;
  const find = async (selector) => Object.values(await until(() => ask("POST", "/element", { using: "css selector", value: selector }).catch(() => null), selector))[0];
  return {
    goto: (url) => ask("POST", "/url", { url }),
    /** What `script` returns in the page. */
    run: (script) => ask("POST", "/execute/sync", { script, args: [] }),
    click: async (selector) => ask("POST", `/element/${await find(selector)}/click`, {}),
    /** Presses a key, by its number in the protocol. */
    press: (key) => ask("POST", "/actions", { actions: [{ type: "key", id: "keys", actions: [{ type: "keyDown", value: key }, { type: "keyUp", value: key }] }] }),
    /** Opens a window, all of which are seen, and goes there. */
    window: async () => ask("POST", "/window", { handle: (await ask("POST", "/window/new", { type: "window" })).handle }),
  };
}
