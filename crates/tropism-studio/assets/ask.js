// What the server is asked: who one is, what there is, and changes, which reach it or say that they did not.
// @ts-check
import { html, put } from "./dom.js";

/**
 * What the studio is asked by address, and what it answers.
 * @typedef {import("./types.d.ts").Gets} Gets
 * @typedef {import("./types.d.ts").Posts} Posts
 */

/** How long an answer may take. */
const ANSWER_MS = 10_000;
/** Pause before a change that did not reach the studio is asked for again. */
const AGAIN_MS = 2_000;
/** After so long a change is not asked for again by itself: nobody expects it any more. */
const INSISTS_MS = 120_000;

/** The word that changes carry; a studio that began anew has another. */
let csrf = "";

/** @returns {Promise<Gets["api/session"]["answer"]>} */
export async function askSession() {
  const found = await (await fetch("api/session", { signal: AbortSignal.timeout(ANSWER_MS) })).json();
  csrf = found.session?.csrf ?? "";
  return found;
}

/** Goes where one logs in, and comes back to this page. */
export const toLogIn = () => {
  const own = (location.pathname.split("/").at(-1) ?? "") + location.search;
  location.assign(own ? `login?${new URLSearchParams({ to: own })}` : "login");
};

/** The session, asked for until the studio answers. */
async function firstSession() {
  for (;;) {
    const found = await askSession().catch(() => null);
    if (found) return found;
    await new Promise((done) => setTimeout(done, AGAIN_MS));
  }
}

export const session = firstSession();

/** @param {Response} answer */
async function read(answer) {
  if (answer.status === 401) toLogIn();
  const data = await answer.json().catch(() => ({ error: `the studio answered ${answer.status}` }));
  if (!answer.ok) throw new Error(data.error ?? `the studio answered ${answer.status}`);
  return data;
}

/**
 * @template {keyof Gets} P
 * @param {P} path @param {Gets[P]["asked"]} [values] @returns {Promise<Gets[P]["answer"]>}
 */
export async function get(path, values) {
  const known = Object.entries(values ?? {}).filter(([, value]) => value !== undefined && value !== null);
  const query = new URLSearchParams(known.map(([key, value]) => [key, String(value)]));
  return read(await fetch(known.length ? `${path}?${query}` : path));
}

/** That the studio did not answer. */
class Unanswered extends Error {}

/** @param {keyof Posts} path @param {Posts[keyof Posts]["asked"]} body @param {number} within */
async function send(path, body, within) {
  for (let isFirst = true; ; isFirst = false) {
    const word = csrf;
    const headers = { "Content-Type": "application/json", "X-Tropism-Csrf": word };
    const signal = AbortSignal.timeout(within);
    const answer = await fetch(path, { method: "POST", headers, body: JSON.stringify(body), signal }).catch(() => {
      throw new Unanswered("The studio does not answer.");
    });
    // A studio that began anew does not know the word of this page, which may have none yet: a fresh one is asked for, once.
    if (answer.status === 403 && isFirst) {
      const found = await askSession().catch(() => null);
      if (found?.session && found.session.csrf !== word) continue;
    }
    return read(answer);
  }
}

/** Shows what lasts, until it is taken away, with buttons; gives what was pressed. @param {any} text @param {string[]} buttons */
function notice(text, ...buttons) {
  const note = document.createElement("div");
  note.className = "toast notice";
  note.setAttribute("role", "alert");
  put(note, [html`<span>${text}</span>`, buttons.map((name) => html`<button class="btn quiet" type="button">${name}</button>`)]);
  document.body.append(note);
  const pressed = new Promise((done) => {
    note.onclick = ({ target }) => target instanceof HTMLButtonElement && done(target.textContent);
  });
  return { pressed, end: () => note.remove() };
}

/** Says what waits when it takes longer than a moment. @template T @param {Promise<T>} doing @param {string} what @returns {Promise<T>} */
async function watched(doing, what) {
  let note = { end: () => {} };
  const timer = setTimeout(() => (note = notice(`${what} waits for the studio.`)), 1500);
  return doing.finally(() => {
    clearTimeout(timer);
    note.end();
  });
}

/**
 * Asks for a change; where the studio does not answer, one is asked whether to try again: it may have been done.
 * @template {keyof Posts} P
 * @param {P} path @param {Posts[P]["asked"]} body @param {number} [within] how long it may take, in ms
 * @returns {Promise<Posts[P]["answer"]>}
 */
export async function post(path, body, within = ANSWER_MS) {
  for (;;) {
    try {
      return await watched(send(path, body, within), "This");
    } catch (error) {
      if (!(error instanceof Unanswered)) throw error;
      const text = "The studio did not answer. It may have been done all the same: look, then try again.";
      const asks = notice(text, "Try again", "Leave it");
      const answer = await asks.pressed;
      asks.end();
      if (answer !== "Try again") throw error;
    }
  }
}

/**
 * Asks for a change that does no harm when it is asked for twice, again and again until the studio answers, and says so.
 * @template {keyof Posts} P
 * @param {P} path @param {Posts[P]["asked"]} body @param {string} what @returns {Promise<Posts[P]["answer"]>}
 */
export async function insist(path, body, what) {
  const began = Date.now();
  for (let tries = 2; ; tries++) {
    try {
      return await watched(send(path, body, ANSWER_MS), what);
    } catch (error) {
      if (!(error instanceof Unanswered)) throw error;
    }
    if (Date.now() - began > INSISTS_MS) throw new Error(`${what} did not reach the studio.`);
    const note = notice(html`<b>${what} has not reached the studio.</b> Try ${tries} follows.`, "Give up");
    const answer = await Promise.race([note.pressed, new Promise((done) => setTimeout(done, AGAIN_MS))]);
    note.end();
    if (answer) throw new Error(`${what} was given up: it did not reach the studio.`);
  }
}

