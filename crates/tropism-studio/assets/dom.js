// Elements, markup, icons and words: shared by all pages, those of the studio and the page in a browser without one.
// @ts-check

/** @param {string} selector @param {ParentNode} [within] @returns {any} */
export const $ = (selector, within = document) => within.querySelector(selector);
/** @param {string} selector @param {ParentNode} [within] @returns {any[]} */
export const $$ = (selector, within = document) => [...within.querySelectorAll(selector)];

/** Parameters of this page's address. */
export const asked = new URLSearchParams(location.search);

/** Markup whose parts are safe: only `html` makes it. */
class Markup {
  /** @param {string} text */
  constructor(text) {
    this.text = text;
  }
  toString() {
    return this.text;
  }
}

/** @param {unknown} value */
export function escaped(value) {
  const letters = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#39;" };
  return String(value).replace(/[&<>"']/g, (letter) => letters[/** @type {"&"} */ (letter)]);
}

/** @param {any} value @returns {string} */
function part(value) {
  if (value instanceof Markup) return value.text;
  if (Array.isArray(value)) return value.map(part).join("");
  return value === undefined || value === null || value === false ? "" : escaped(value);
}

/**
 * Markup with every value escaped that is not markup itself.
 * @param {TemplateStringsArray} pieces @param {...any} values
 */
export const html = (pieces, ...values) =>
  new Markup(pieces.reduce((text, piece, index) => text + part(values[index - 1]) + piece));

/** Markup that this program made, such as a figure. @param {string} text */
export const trusted = (text) => new Markup(text);

/** @param {Element} element @param {any} markup */
export const put = (element, markup) => {
  const text = part(markup);
  // What did not change keeps its focus.
  if (/** @type {any} */ (element).shown === text) return;
  /** @type {any} */ (element).shown = text;
  element.innerHTML = text;
};

const ICONS = {
  run: '<path d="M12 21c0-6 .5-9 5-13"/><path d="M14 13c-3 0-5-1.5-6-4 3 0 5 1 6 4z"/><circle class="f" cx="17.5" cy="7" r="2"/>',
  evolution: '<path d="M4 4v16h16"/><path d="M6 17c4 0 3-9 7-9h6"/>',
  study: '<path d="M5 4h10l4 4v12H5z"/><path d="M9 12h6M9 16h6"/>',
  transfer: '<path d="M4 8h14l-4-4M20 16H6l4 4"/>',
  live: '<circle class="f" cx="12" cy="12" r="5"/><circle cx="12" cy="12" r="9"/>',
  wait: '<circle cx="12" cy="12" r="9"/><path d="M12 7v5l3 2"/>',
  pause: '<path d="M8 5v14M16 5v14"/>',
  done: '<path d="M4 12l5 6L20 6"/>',
  stop: '<rect x="5" y="5" width="14" height="14" rx="1"/>',
  warn: '<path d="M12 3l10 18H2z"/><path d="M12 10v5M12 18v.1"/>',
  info: '<circle cx="12" cy="12" r="9"/><path d="M12 11v6M12 7.5v.1"/>',
  play: '<path class="f" d="M7 4l13 8-13 8z"/>',
  menu: '<path d="M4 6h16M4 12h16M4 18h16"/>',
  prev: '<path d="M15 5l-7 7 7 7"/>',
  next: '<path d="M9 5l7 7-7 7"/>',
  bin: '<path d="M5 7h14M10 7V4h4v3M7 7l1 13h8l1-13"/>',
  lock: '<rect x="5" y="11" width="14" height="9" rx="1"/><path d="M8 11V8a4 4 0 0 1 8 0v3"/>',
  eye: '<path d="M2 12c4-7 16-7 20 0-4 7-16 7-20 0z"/><circle cx="12" cy="12" r="3"/>',
  sun: '<circle cx="12" cy="12" r="4"/><path d="M12 2v3M12 19v3M2 12h3M19 12h3M5 5l2 2M17 17l2 2M5 19l2-2M17 7l2-2"/>',
  dark: '<path d="M9 3a9 9 0 1 0 12 12A8 8 0 0 1 9 3z"/>',
  redo: '<path d="M4 12a8 8 0 1 1 3 6M4 12V6M4 12h6"/>',
  copy: '<rect x="8" y="8" width="12" height="12"/><path d="M4 16V4h12"/>',
  pen: '<path d="M4 20l1-5L16 4l4 4L9 19z"/>',
  zoom: '<circle cx="10" cy="10" r="6"/><path d="M15 15l6 6M10 7.5v5M7.5 10h5"/>',
  left: '<path d="M20 12H4l6-6M4 12l6 6"/>',
  right: '<path d="M4 12h16l-6-6M20 12l-6 6"/>',
};
const SAME = { sweep: "study", replicates: "transfer", rule: "pen" };

/** @param {string} name */
export const icon = (name) => {
  const drawing = ICONS[/** @type {keyof ICONS} */ (SAME[/** @type {"sweep"} */ (name)] ?? name)] ?? ICONS.study;
  return trusted(`<svg class="ic" viewBox="0 0 24 24" aria-hidden="true">${drawing}</svg>`);
};

// Light or dark: as the system says, or as was chosen here.
/** @param {string | null} theme */
function setTheme(theme) {
  if (theme === "light" || theme === "dark") document.documentElement.dataset.theme = theme;
}
try {
  setTheme(asked.get("theme") ?? localStorage.getItem("theme"));
} catch {
  // Without storage the system's choice holds.
}
/** Turns from light to dark, or back. */
export function toggleTheme() {
  const isDark = matchMedia("(prefers-color-scheme:dark)").matches;
  const now = document.documentElement.dataset.theme ?? (isDark ? "dark" : "light");
  const theme = now === "dark" ? "light" : "dark";
  setTheme(theme);
  try {
    localStorage.setItem("theme", theme);
  } catch {
    // It holds for this page alone.
  }
}

/** The mark of the program. */
export const MARK =
  '<svg viewBox="0 0 28 28" aria-hidden="true"><circle class="k-left" cx="4" cy="9" r="3"/><circle class="k-right" cx="24" cy="9" r="3"/><path class="k-stem" d="M13 26c-1-8 1-13 6-15"/></svg>';

/** @param {string} text */
export function toast(text) {
  $(".toast")?.remove();
  const note = document.createElement("div");
  note.className = "toast";
  note.setAttribute("role", "status");
  note.textContent = text;
  document.body.append(note);
  setTimeout(() => note.remove(), 5000);
}

/** What went wrong, in words. @param {any} error @returns {string} */
export const wordOf = (error) => (error instanceof Error ? error.message : String(error));

/** Letters of an error that are read at a glance; chosen, two lines of a phone. */
const GLANCE = 110;

/** A long text under its first sentence: the rest is unfolded. @param {string} text */
export function folded(text) {
  if (text.length <= GLANCE) return html`${text}`;
  // Up to the last stop that is seen at a glance, else up to a word.
  const stop = Math.max(...[". ", ": ", "; "].map((end) => text.lastIndexOf(end, GLANCE)));
  const first = stop > 20 ? text.slice(0, stop + 1) : `${text.slice(0, text.lastIndexOf(" ", GLANCE) + 1 || GLANCE).trimEnd()}…`;
  return html`<details class="folded">
    <summary>${first}</summary>
    <p class="mono">${text}</p>
  </details>`;
}

/** Says what went wrong. @param {any} error */
export const say = (error) => toast(wordOf(error));

/** A command with a button that copies it. @param {string} text */
export const command = (text) =>
  html`<div class="cmd">
    <code tabindex="0">${text}</code
    ><button class="btn quiet square copy" type="button" aria-label="Copy">${icon("copy")}</button>
  </div>`;

addEventListener("click", (event) => {
  const button = /** @type {Element} */ (event.target).closest?.(".copy");
  if (!button) return;
  const text = $("code", button.parentElement).textContent;
  const done = navigator.clipboard?.writeText(text) ?? Promise.reject(new Error());
  done.then(
    () => toast("Copied."),
    () => toast("This browser does not copy here: mark the text."),
  );
});

/** A number with a true minus. @param {number} value @param {number} [digits] */
export const num = (value, digits = 2) => value.toFixed(digits).replace(/^-(?=.*[1-9])/, "−").replace("-", "");
/** @param {number} count @param {string} noun */
export const plural = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;

/** The class of a lamp, or of the one at full power among several. @param {string | null} lighting */
export const lampClass = (lighting) => {
  const lamp = lighting?.split("+").find((part) => !part.includes(":"));
  return lamp === "left" || lamp === "right" ? lamp : "other";
};
/** What is lit, in words: `left lamp`, `left+top:64 lamps`, `no lamp`. @param {string} lighting */
export const lampText = (lighting) =>
  lighting === "dark" ? "no lamp" : `${lighting} lamp${lighting.includes("+") ? "s" : ""}`;
