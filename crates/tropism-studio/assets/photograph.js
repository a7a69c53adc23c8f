// The photograph of a run: the picture with what is drawn over it, the strip of many, and the film.
// @ts-check
import { $, $$, get, html, lampText, mmss, now, num, put, span, trusted } from "./studio.js";
import { lampPath } from "./figure.js";
import { nearer, regionOf, ring, stemLine } from "./photo.js";
import { at, isOn, look, onLook, place, run, stepShown, when } from "./record.js";

let hasOverlay = true;
let film = 0;
/** @type {Map<number, [number, number][] | null>} */
const stems = new Map();

/** @param {ReturnType<typeof stepShown>} one @param {boolean} isSmall */
const photoOf = (one, isSmall) =>
  `api/run/photo?${new URLSearchParams({ at, name: one.photo, v: one.v, ...(isSmall ? { small: "true" } : {}) })}`;

function overlay() {
  const one = stepShown();
  if (!one || !hasOverlay || !one.photo) return "";
  const { about, steps } = run;
  const marks = (about.targets ?? [])
    .filter((target) => target.px)
    .map(({ px: [x, y] }, index) => {
      const lines = `M${x - 8} ${y - 8}l16 16m0-16l-16 16`;
      return `<path class="dark" d="${lines}"/><path class="ring" d="${lines}"/><text x="${x}" y="${y - 14}">${index + 1}</text>`;
    });
  const pixels = (about.line ?? []).filter((point) => point.px).map((point) => point.px.join(" "));
  const wanted = pixels.length ? `<path class="wanted" d="M${pixels.join("L")}"/>` : "";
  const past = steps.slice(0, place() + 1).filter((past) => past.px !== null);
  const trail = lampPath(
    past.map((past) => ({ x: past.px, y: past.py, lamp: past.lamp })),
    (x) => x,
    (y) => y,
    "trail",
  )
    .replaceAll("stroke trail", "trail")
    .replaceAll("quiet", "other");
  const tip = one.px === null ? "" : ring(one.px, one.py, 11, one.isCarriedForward ? "carried_forward" : "");
  return (about.crop ? regionOf(about.crop) : "") + wanted + trail + stemLine(stems.get(one.number)) + marks.join("") + tip;
}

let stemTimer = 0;
function wantStem() {
  const one = stepShown();
  if (!one || !hasOverlay || stems.has(one.number)) return;
  clearTimeout(stemTimer);
  stemTimer = setTimeout(async () => {
    const { stem } = await get("api/run/stem", { at, step: one.number }).catch(() => ({ stem: null }));
    stems.set(one.number, stem);
    if (stepShown()?.number === one.number) put($("#over"), trusted(overlay()));
  }, 120);
}

/** Whether the photograph that is shown could not be loaded. */
export const isMissing = () => $("#img").dataset.failed !== undefined && $("#img").dataset.of === $("#img").getAttribute("src");

export function photograph() {
  const one = stepShown();
  const image = $("#img");
  const isLatest = run.shown === null;
  $("#no-photo").hidden = Boolean(one?.photo) && !isMissing();
  image.hidden = !one?.photo;
  if (one?.photo) {
    const source = photoOf(one, false);
    if (image.getAttribute("src") !== source) image.src = source;
    const side = one.lamp ? ` Lit next: ${lampText(one.lamp)}.` : "";
    image.alt =
      one.x === null
        ? `Step ${one.number}: no plant found.`
        : `Step ${one.number}: the tip is at ${num(one.x, 1)}, ${num(one.y, 1)} cm.${side}`;
  }
  $("#no-photo").textContent = one?.photo
    ? "This photograph could not be loaded."
    : one
      ? "The camera gave no photograph at this step."
      : run.status.state
        ? "No photograph yet."
        : "Reading the run.";
  put($("#over"), trusted(overlay()));
  wantStem();
  $("#frame").textContent = one?.photo ?? "";
  $("#note-about").textContent = isLatest || !one ? "now" : `step ${one.number}, ${when(one)}`;
  $("#where").textContent = isLatest
    ? "latest photograph"
    : `step ${one.number}, ${when(one)}${one.lamp ? `, then ${lampText(one.lamp)}` : ""}`;
  const scrub = $("#scrub");
  scrub.max = String(Math.max(0, run.steps.length - 1));
  scrub.value = String(place());
  scrub.setAttribute("aria-valuetext", one ? `step ${one.number}, ${when(one)}` : "none");
  press();
  age();
}
onLook.push(photograph);

/** Marks the button of the strip whose photographs hold the one that is shown. */
function press() {
  for (const button of $$("#strip button")) {
    button.setAttribute("aria-pressed", String(button.dataset.from <= place() && place() < button.dataset.to));
  }
}

/** How old the photograph is, and whether a newer one should be there. */
export function age() {
  const { status, isLost, lostFor } = run;
  const isLatest = run.shown === null;
  const taken = status.photo_unix;
  const one = stepShown();
  $("#age").textContent = !one ? "" : isLatest && taken ? `taken ${mmss(Math.max(0, now() - taken))} ago` : when(one);
  const isOld = isLatest && taken && isOn() && status.next_unix && now() > status.next_unix + Math.max(15, status.period_s ?? 0);
  const stale = isLost
    ? `Old: last heard ${span(lostFor)} ago`
    : isOld
      ? `Old: taken ${mmss(now() - taken)} ago, due ${mmss(now() - status.next_unix)} ago`
      : status.state === "died"
        ? "The last one before the run ended"
        : "";
  $("#photo").classList.toggle("stale", Boolean(stale));
  $("#photo").dataset.stale = stale;
}

let stripped = "";
export function strip() {
  const { steps } = run;
  const count = Math.min(innerWidth < 600 ? 5 : 9, steps.length);
  const marks = Array.from({ length: count }, (_, index) => Math.round((index * (steps.length - 1)) / Math.max(1, count - 1)));
  // A strip that changed with every photograph would load all small ones anew: it grows by eighths.
  const key = `${count} ${Math.floor(Math.log2(Math.max(1, steps.length)) * 8)}`;
  if (key === stripped) return;
  stripped = key;
  const button = (/** @type {number} */ mark, /** @type {number} */ index) => {
    const one = steps[mark];
    const to = marks[index + 1] ?? 1e9;
    const picture = one.photo ? html`<img src="${photoOf(one, true)}" alt="" loading="lazy" />` : "";
    return html`<button type="button" data-from="${mark}" data-to="${to}" aria-label="Step ${one.number}, ${when(one)}">
      ${picture}
    </button>`;
  };
  put($("#strip"), marks.map(button));
  press();
}

// The small photographs come after the large one.
$("#img").addEventListener("load", strip);
for (const event of ["load", "error"])
  $("#img").addEventListener(event, () => {
    // After the handler of all images.
    queueMicrotask(() => {
      $("#no-photo").hidden = Boolean(stepShown()?.photo) && !isMissing();
    });
  });

function stopFilm() {
  clearInterval(film);
  film = 0;
  $("#film span").textContent = "Film";
}

$("#strip").onclick = (event) => {
  const button = event.target.closest("button");
  if (button) look(Number(button.dataset.from));
};
$("#scrub").oninput = (event) => look(Number(event.target.value));
$("#back").onclick = () => look(place() - 1);
$("#forth").onclick = () => look(place() + 1);
$("#latest").onclick = () => {
  stopFilm();
  look(null);
};
$("#overlay").onclick = () => {
  hasOverlay = !hasOverlay;
  $("#overlay").setAttribute("aria-pressed", String(hasOverlay));
  photograph();
};
nearer(innerWidth < 600);
$("#film").onclick = () => {
  if (film) return stopFilm();
  if (run.shown === null) look(0);
  $("#film span").textContent = "Pause";
  const stride = Math.max(1, Math.round(run.steps.length / 300));
  const go = () => {
    // The next picture is shown when this one is there: a slow network makes a slower film, not a torn one.
    if (!$("#img").complete) return;
    look(place() + stride);
    if (run.shown === null) stopFilm();
  };
  film = setInterval(go, 80);
};
