// Shared by all pages of the studio: the frame, what the server is asked, live events, hold to confirm, words for times.
// @ts-check
import { $, $$, MARK, html, icon, num, put, toggleTheme, trusted, wordOf } from "./dom.js";

export * from "./dom.js";

const PAGES = [
  ["./", "index", "Overview"],
  ["draw", "draw", "Draw"],
  ["tune", "tune", "Tune vision"],
  ["compare", "compare", "Compare"],
];
/** Draws head and foot of the page. */
function frame() {
  const own = document.body.dataset.page ?? "";
  const bare = document.body.dataset.bare !== undefined;
  const link = ([address, name, title]) =>
    html`<a href="${address}" aria-current="${name === own ? "page" : "false"}">${title}</a>`;
  const nav = bare ? "" : html`<nav class="nav" id="nav" aria-label="Pages">${PAGES.map(link)}</nav>`;
  const state = bare ? "" : html`<span class="link-state" id="link" role="status"><i></i><span>Connecting</span></span>`;
  const burger = bare
    ? ""
    : html`<button
        class="btn quiet square burger"
        id="burger"
        type="button"
        aria-expanded="false"
        aria-controls="nav"
        aria-label="Pages"
      >
        ${icon("menu")}
      </button>`;
  const head = html`<a class="skip" href="#main">To the content</a>
    <div class="lampline" id="lampline"></div>
    <header class="top">
      <div class="bar">
        <a class="brand" href="./">${trusted(MARK)}tropism studio</a>${nav}<span class="space"></span>${state}
        <button class="btn quiet square" id="theme" type="button" aria-label="Light or dark">${icon("sun")}</button>${burger}
      </div>
    </header>`;
  document.body.insertAdjacentHTML("afterbegin", head.text);
  document.body.insertAdjacentHTML("beforeend", '<footer class="foot" id="foot"></footer>');
  $$("[data-ic]").forEach((element) => element.insertAdjacentHTML("afterbegin", icon(element.dataset.ic).text));
  $("#theme").onclick = toggleTheme;
  const menu = $("#burger");
  if (!menu) return;
  menu.onclick = () => menu.setAttribute("aria-expanded", String($("#nav").classList.toggle("open")));
  addEventListener("keydown", (event) => {
    if (event.key === "Escape" && $("#nav").classList.contains("open")) {
      menu.click();
      menu.focus();
    }
  });
}
frame();

/** Seconds by which the server's clock is ahead of this one. */
let ahead = 0;
/** @param {number} unix */
export const setClock = (unix) => {
  ahead = unix - Date.now() / 1000;
};
/** Seconds since 1970 by the server's clock. */
export const now = () => Date.now() / 1000 + ahead;

/**
 * @typedef {{ csrf: string, read_only: boolean }} Session
 * @type {Promise<{ session: Session | null, asks_for_token: boolean, folder: string, version: string, is_demo: boolean, now: number }>}
 */
export const session = fetch("api/session").then(async (answer) => {
  const found = await answer.json();
  setClock(found.now);
  const own = found.session;
  if (own?.read_only) document.body.classList.add("read-only");
  put(
    $("#foot"),
    html`<span>tropism ${found.version}</span>${own ? html`<span>folder <code>${found.folder}</code></span>` : ""}
      <span>${location.host}${found.asks_for_token ? "" : ", this computer only"}</span>
      ${found.is_demo ? html`<span>a demonstration: every plant is virtual, and the folder is deleted at the end</span>` : ""}
      ${own?.read_only ? html`<span>for looking only</span>` : ""}
      ${own && found.asks_for_token ? html`<button class="btn quiet" id="logout" type="button">Log out</button>` : ""}`,
  );
  const out = $("#logout");
  if (out) out.onclick = () => post("api/logout", {}).finally(() => location.assign("login"));
  return found;
});

/** @param {Response} answer */
async function read(answer) {
  if (answer.status === 401) location.assign("login");
  const data = await answer.json().catch(() => ({ error: `the studio answered ${answer.status}` }));
  if (!answer.ok) throw new Error(data.error ?? `the studio answered ${answer.status}`);
  return data;
}

/** @param {string} path @param {Record<string, any>} [values] @returns {Promise<any>} */
export async function get(path, values = {}) {
  const known = Object.entries(values).filter(([, value]) => value !== undefined && value !== null);
  const query = new URLSearchParams(known.map(([key, value]) => [key, String(value)]));
  return read(await fetch(known.length ? `${path}?${query}` : path));
}

/** @param {string} path @param {any} body @returns {Promise<any>} */
export async function post(path, body) {
  const csrf = (await session).session?.csrf ?? "";
  const headers = { "Content-Type": "application/json", "X-Tropism-Csrf": csrf };
  return read(await fetch(path, { method: "POST", headers, body: JSON.stringify(body) }));
}

/** The server breaks its silence every 5 s: after twice as long and a little, the page is cut off. */
const CUT_OFF_MS = 11_000;

/**
 * Listens to live events; the browser comes back by itself, with the id of the last event it has.
 * @param {string} path @param {string} event @param {(data: any) => void} take @param {(isLost: boolean, seconds: number) => void} [lost]
 */
export function listen(path, event, take, lost = () => {}) {
  let heard = Date.now();
  let isLost = false;
  /** @type {EventSource} */
  let source;
  const state = $("#link");
  const tell = (is) => {
    isLost = is;
    if (!state) return;
    state.dataset.s = is ? "lost" : "";
    $("span", state).textContent = is ? "Trying again" : "Connected";
  };
  const hear = (unix) => {
    heard = Date.now();
    if (Number.isFinite(unix)) setClock(unix);
    if (isLost || $("span", state)?.textContent !== "Connected") {
      tell(false);
      lost(false, 0);
    }
  };
  const told = (/** @type {MessageEvent} */ message) => {
    const data = JSON.parse(message.data);
    hear(data.now);
    take(data);
  };
  const open = () => {
    // Those that were opened before the scripts came.
    const { early } = /** @type {any} */ (globalThis);
    const isEarly = early?.path === path;
    // One that comes later is not needed any more.
    /** @type {any} */ (globalThis).early = undefined;
    source = isEarly ? early.source : new EventSource(path);
    source.addEventListener("beat", (message) => hear(Number(message.data)));
    source.addEventListener(event, told);
    source.onerror = () => tell(true);
    if (!isEarly) return;
    // After the rest of the page's script.
    queueMicrotask(() => early.taken().forEach(told));
  };
  open();
  setInterval(() => {
    const silent = Date.now() - heard;
    if (silent > CUT_OFF_MS || isLost) {
      if (!isLost) tell(true);
      lost(true, Math.round(silent / 1000));
    }
    // A browser gives up where the server answers at all but refuses: perhaps it has begun anew.
    if (source.readyState === EventSource.CLOSED) {
      fetch("api/session")
        .then(read)
        .then(
          (found) => {
            if (!found.session) location.assign("login");
          },
          () => {},
        );
      open();
    }
  }, 2000);
  addEventListener("pagehide", () => source.close());
}

/** @param {"" | "bad" | "calm"} kind @param {"status" | "alert"} role @param {any} text @param {any} [after] */
export const banner = (kind, role, text, after = "") =>
  html`<div class="banner ${kind}" role="${role}">
    <div>${text}</div>
    ${after}
  </div>`;

/** Shows at the top of the page that what it is for cannot be had. @param {any} error */
export const refuse = (error) => put($("#banner"), banner("bad", "alert", wordOf(error)));

/** A page that hears nothing any more. @param {number} seconds since it heard something @param {any} what goes on */
export const cutOff = (seconds, what) =>
  banner(
    "",
    "status",
    html`<strong>This page is cut off from studio.</strong> What you see was heard ${span(seconds)} ago. ${what}`,
  );

/** How long a button is held until it acts. */
const HOLD_MS = 1500;

/**
 * A button that acts when it is held, by finger, mouse, Space or Enter; letting go takes it back.
 * @param {HTMLElement} button @param {() => void} act @param {() => void} [hint]
 */
export function hold(button, act, hint = () => {}) {
  let began = 0;
  let timer = 0;
  let drawing = 0;
  const fill = () => {
    button.style.setProperty("--p", String(Math.min(1, (performance.now() - began) / HOLD_MS)));
    drawing = requestAnimationFrame(fill);
  };
  const end = (isFull = false) => {
    if (!began) return;
    began = 0;
    clearTimeout(timer);
    cancelAnimationFrame(drawing);
    button.style.setProperty("--p", "0");
    if (isFull) act();
    else hint();
  };
  const begin = () => {
    if (button.getAttribute("aria-disabled") === "true" || began) return;
    began = performance.now();
    timer = setTimeout(() => end(true), HOLD_MS);
    fill();
  };
  button.addEventListener("pointerdown", (event) => {
    button.setPointerCapture(event.pointerId);
    begin();
  });
  for (const name of ["pointerup", "pointercancel", "blur"]) button.addEventListener(name, () => end());
  button.addEventListener("keydown", (event) => {
    if (event.key !== " " && event.key !== "Enter") return;
    event.preventDefault();
    if (!event.repeat) begin();
  });
  button.addEventListener("keyup", (event) => {
    if (event.key === " " || event.key === "Enter") end();
  });
  button.addEventListener("contextmenu", (event) => event.preventDefault());
}

/** " of" the best fitness that there can be, where it is known. @param {number | null | undefined} best */
export const ofBest = (best) => (best ? ` of ${num(best, Math.abs(best - Math.round(best)) < 0.05 ? 0 : 1)}` : "");
/** @param {number} seconds */
export const mmss = (seconds) => `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")}`;
/** A span of time in words. @param {number} seconds */
export function span(seconds) {
  const s = Math.max(0, seconds);
  if (s < 60) return `${Math.floor(s)} s`;
  if (s < 3600) return `${Math.floor(s / 60)} min`;
  if (s < 86_400) return `${Math.floor(s / 3600)} h ${Math.floor((s % 3600) / 60)} min`;
  return `${Math.floor(s / 86_400)} d ${Math.floor((s % 86_400) / 3600)} h`;
}
// Made once: to make them takes longer than all that they write on a page.
const CLOCK = new Intl.DateTimeFormat([], { hour: "2-digit", minute: "2-digit", hour12: false });
const DAY = new Intl.DateTimeFormat([], { day: "numeric", month: "short" });
/** A moment in the words of a person. @param {number} unix */
export function moment(unix) {
  const date = new Date(unix * 1000);
  const days = Math.floor((new Date(now() * 1000).setHours(0, 0, 0, 0) - new Date(date).setHours(0, 0, 0, 0)) / 86_400_000 + 0.5);
  const clock = CLOCK.format(date);
  if (days === 0) return clock;
  if (days === 1) return `yesterday ${clock}`;
  return `${DAY.format(date)} ${clock}`;
}
/** Bytes in words. @param {number} bytes */
export const size = (bytes) => (bytes < 1e9 ? `${Math.round(bytes / 1e6)} MB` : `${Math.round(bytes / 1e9)} GB`);
const STATES = {
  live: ["live", "live", "Live"],
  overdue: ["warn", "warn", "Photograph late"],
  paused: ["warn", "warn", "Waits for you"],
  stopped: ["", "stop", "Stopped"],
  died: ["bad", "warn", "Ended without a word"],
  broken: ["bad", "warn", "Cannot be read"],
  over: ["", "done", "Done"],
  waiting: ["", "wait", "Waiting"],
};
/** State as shape, word and colour. @param {string} state @param {string} [word] */
export const chip = (state, word) => {
  const [kind, drawing, text] = STATES[/** @type {"live"} */ (state)] ?? STATES.over;
  return html`<span class="chip ${kind}">${icon(drawing)}<span>${word ?? text}</span></span>`;
};
export const virtual = (word = "virtual") => html`<span class="chip virtual">${word}</span>`;

/** @param {string} text */
export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
/** The page of a piece of work. @param {string} kind @param {string} at */
export const pageOf = (kind, at) => `${kind === "run" || kind === "evolution" ? kind : "work"}?${new URLSearchParams({ at })}`;
