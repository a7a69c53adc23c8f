// Shared by all pages of the studio: the frame, live events, hold to confirm, words for states.
// @ts-check
import { askSession, insist, session, toLogIn } from "./ask.js";
import { $, $$, MARK, folded, html, icon, num, put, say, toggleTheme, trusted, wordOf } from "./dom.js";
import { hear } from "./early.js";
import { setClock, span } from "./time.js";

export * from "./ask.js";
export * from "./dom.js";
export * from "./time.js";

const PAGES = [
  ["./", "index", "Overview"],
  ["draw", "draw", "Draw"],
  ["begin", "begin", "Begin"],
  ["devices", "devices", "Devices"],
  ["tune", "tune", "Tune vision"],
  ["compare", "compare", "Compare"],
  ["wall", "wall", "Nodes"],
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

/** Says what is shown, where, and to whom. @param {import("./types.d.ts").About} found */
function foot(found) {
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
  if (out) out.onclick = () => insist("api/logout", {}, "The log-out").then(() => location.assign("login"), say);
}
session.then(foot);

/** Calls `act` when the form of a dialog is sent by its button `yes`. Escape sends nothing, whatever was said before. */
export function onYes(/** @type {HTMLDialogElement} */ dialog, /** @type {() => void} */ act) {
  $("form", dialog).addEventListener("submit", (/** @type {SubmitEvent} */ event) => {
    if (/** @type {any} */ (event.submitter)?.value === "yes") act();
  });
}

/** The server breaks its silence every 5 s: after twice as long and a little, the page is cut off. */
const CUT_OFF_MS = 11_000;

/**
 * Listens to live events, over the connection that all tabs of this browser share; gives what ends it.
 * @template {keyof import("./types.d.ts").Topics} T
 * @param {T} topic @param {string} at @param {(data: import("./types.d.ts").Topics[T]) => void} take
 * @param {(isLost: boolean, seconds: number) => void} [lost] @param {(error: Error) => void} [refused] it is not there
 */
export function listen(topic, at, take, lost = () => {}, refused = refuse) {
  let heard = Date.now();
  let isLost = false;
  const state = $("#link");
  const tell = (is) => {
    isLost = is;
    if (!state) return;
    state.dataset.s = is ? "lost" : "";
    $("span", state).textContent = is ? "Trying again" : "Connected";
  };
  const end = hear(topic, at, ({ event, data, beat, error, isLost: isGone }) => {
    if (isGone) return tell(true);
    heard = Date.now();
    const unix = beat ?? data?.now;
    if (Number.isFinite(unix)) setClock(unix);
    if (isLost || $("span", state)?.textContent !== "Connected") {
      tell(false);
      lost(false, 0);
    }
    if (event === "refused") refused(new Error(error));
    else if (event) take(data);
  });
  const timer = setInterval(() => {
    // Nobody sees it, and it may have given its connection up.
    if (document.hidden) return;
    const silent = Date.now() - heard;
    if (silent <= CUT_OFF_MS && !isLost) return;
    if (!isLost) tell(true);
    lost(true, Math.round(silent / 1000));
    // Perhaps the studio has begun anew, and knows nobody.
    askSession().then(
      (found) => !found.session && toLogIn(),
      () => {},
    );
  }, 2000);
  return () => {
    clearInterval(timer);
    end();
  };
}

/** Pauses before an image that did not load is asked for again, in ms. */
const IMAGE_AGAIN_MS = [1_000, 4_000, 15_000];

// An image that does not load is asked for again; one that stays away is said to be missing, by the style of `data-failed`.
/** @param {any} image */
const isImage = (image) => image instanceof HTMLImageElement || image instanceof SVGImageElement;
document.addEventListener(
  "error",
  ({ target: image }) => {
    if (!isImage(image)) return;
    const { dataset } = /** @type {any} */ (image);
    const name = image instanceof HTMLImageElement ? "src" : "href";
    const source = /** @type {Element} */ (image).getAttribute(name) ?? "";
    // Tries of this image: another one in its place has its own.
    const tries = dataset.of === source ? Number(dataset.tries) : 0;
    Object.assign(dataset, { failed: "", of: source, tries: String(tries + 1) });
    if (tries >= IMAGE_AGAIN_MS.length) return;
    setTimeout(() => {
      const element = /** @type {Element} */ (image);
      if (element.isConnected && element.getAttribute(name) === source) element.setAttribute(name, source);
    }, IMAGE_AGAIN_MS[tries]);
  },
  true,
);
document.addEventListener("load", ({ target: image }) => isImage(image) && delete (/** @type {any} */ (image).dataset.failed), true);

/** @param {"" | "bad" | "calm"} kind @param {"status" | "alert"} role @param {any} text @param {any} [after] */
export const banner = (kind, role, text, after = "") =>
  html`<div class="banner ${kind}" role="${role}">
    <div>${text}</div>
    ${after}
  </div>`;

/** Shows at the top of the page that what it is for cannot be had. @param {any} error */
export const refuse = (error) => put($("#banner"), banner("bad", "alert", folded(wordOf(error))));

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
/** Bytes in words. @param {number} bytes */
export const size = (bytes) => (bytes < 1e9 ? `${Math.round(bytes / 1e6)} MB` : `${Math.round(bytes / 1e9)} GB`);
const STATES = {
  live: ["live", "live", "Live"],
  overdue: ["warn", "warn", "Photograph late"],
  paused: ["warn", "warn", "Waits for you"],
  stopped: ["", "stop", "Stopped"],
  died: ["bad", "warn", "Ended without a word"],
  broken: ["bad", "warn", "Cannot be read"],
  gone: ["bad", "warn", "Not here any more"],
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
