// Tune vision: see tips and warnings change with the settings.
// @ts-check
import {
  $,
  $$,
  asked,
  banner,
  command,
  folded,
  get,
  html,
  icon,
  listen,
  num,
  plural,
  post,
  put,
  refuse,
  say,
  session,
  toast,
  virtual,
  wordOf,
} from "./studio.js";
import { frameFor, regionOf, ring, stemLine } from "./photo.js";

/**
 * @typedef {import("./types.d.ts").TuneSettings} Settings
 * @typedef {import("./types.d.ts").SeenPhoto} SeenPhoto
 */

const SLIDERS = [
  ["contrast", "Contrast", "how far a plant must stand out, in standard deviations of the background", 1, 20, 0.5],
  ["threshold", "Threshold", "share of the way from background to plant at which the plant ends", 0.1, 0.9, 0.05],
  ["px_per_cm", "Scale", "pixels in a centimetre", 2, 60, 0.1],
];
/** How long writing may take: other work with photographs comes first. */
const WRITES_MS = 120_000;
let at = asked.get("at") ?? "";
/** @type {import("./types.d.ts").TuneBegin | undefined} */
let about;
/** @type {Settings} */
let settings;
/** @type {Settings} */
let first;
/** @type {SeenPhoto[]} */
let seen = [];
/** @type {SeenPhoto[]} */
let before = [];
let chosen = 0;
let isOnly = false;

const width = () => about?.width ?? 648;
const height = () => about?.height ?? 486;
/** @param {SeenPhoto} one @param {boolean} isSmall */
const picture = (one, isSmall) =>
  `api/run/photo?${new URLSearchParams({ at, name: one.photo, ...(isSmall ? { small: "true" } : {}) })}`;

function photograph() {
  const one = seen[chosen];
  if (!one) return;
  const image = $("#img");
  if (image.getAttribute("src") !== picture(one, false)) image.src = picture(one, false);
  const k = width() / ($("#photo").clientWidth || width());
  const [x, y, w, h] = settings.roi ?? [0, 0, width(), height()];
  const touch = Math.max(22 * k, 1);
  const corners = [
    [x, y, "upper left"],
    [x + w, y, "upper right"],
    [x, y + h, "lower left"],
    [x + w, y + h, "lower right"],
  ];
  const tip = one.tip ? ring(one.tip[0], one.tip[1], 11 * k, one.state === "found" ? "" : "carried_forward") : "";
  const handles = corners.map(
    ([cx, cy, name], index) =>
      `<g tabindex="0" role="button" aria-label="Region, ${name} corner" data-corner="${index}"><circle class="handle" cx="${cx}" cy="${cy}" r="${6 * k}"/><circle class="touch" cx="${cx}" cy="${cy}" r="${touch}"/></g>`,
  );
  const [bx, by] = settings.base;
  const base = `<g tabindex="0" role="button" aria-label="Base of the stem" data-corner="4">${ring(bx, by, 8 * k)}<circle class="touch" cx="${bx}" cy="${by}" r="${touch}"/></g>`;
  const focused = /** @type {any} */ (document.activeElement)?.dataset?.corner;
  $("#over").innerHTML =
    `<path class="shade" d="M0 0H${width()}V${height()}H0ZM${x} ${y}v${h}h${w}v${-h}Z"/>${regionOf([x, y, w, h])}${stemLine(one.stem)}${tip}${handles.join("")}${base}`;
  if (focused !== undefined) $(`#over [data-corner="${focused}"]`)?.focus();
  $("#tag").textContent = `${one.photo}: ${says(one)}, confidence ${num(one.confidence, 2)}`;
}

/** @param {SeenPhoto} one */
const says = (one) =>
  ({ found: "found", uncertain: "uncertain", missed: one.status === "ok" ? "not found" : one.status.replaceAll("_", " ") })[
    one.state
  ];

function samples() {
  const shown = seen.map((one, index) => ({ ...one, index })).filter((one) => !isOnly || one.state !== "found");
  const one = (/** @type {typeof shown[0]} */ sample) =>
    html`<button
      type="button"
      class="sample ${{ uncertain: "warning", missed: "miss" }[sample.state] ?? ""}"
      data-index="${sample.index}"
      aria-pressed="${sample.index === chosen}"
    >
      <img src="${picture(sample, true)}" alt="" width="160" height="120" loading="lazy" />
      <span class="cap"
        ><b>${sample.state === "found" ? "" : icon("warn")} ${says(sample)}</b> ${num(sample.confidence, 2)}<br /><span
          class="soft"
          >${sample.photo}</span
        ></span
      >
    </button>`;
  put($("#samples"), shown.length ? shown.map(one) : html`<p class="soft">No warnings with these settings.</p>`);
}

function facts() {
  const count = (/** @type {SeenPhoto[]} */ list, /** @type {SeenPhoto["state"]} */ state) => list.filter((one) => one.state === state).length;
  const found = (/** @type {SeenPhoto[]} */ list) => list.length - count(list, "missed");
  put($("#found"), html`${found(seen)} <small>of ${seen.length}</small>`);
  $("#uncertain").textContent = count(seen, "uncertain");
  put($("#before"), html`${found(before)} <small>of ${before.length}, ${count(before, "uncertain")} uncertain</small>`);
  const moves = seen.map((one, index) =>
    one.tip && before[index]?.tip
      ? Math.hypot(one.tip[0] - before[index].tip[0], one.tip[1] - before[index].tip[1]) / settings.px_per_cm
      : 0,
  );
  put($("#moved"), html`${num(Math.max(0, ...moves), 1)} <small>cm at most</small>`);
  const isWorse =
    found(seen) < found(before) || (found(seen) === found(before) && count(seen, "uncertain") > count(before, "uncertain"));
  $("#note").hidden = !isWorse;
  $("#note").textContent = "Worse than before on these photographs. Nothing is written until you say so.";
}

function fields() {
  for (const [key] of SLIDERS) {
    $(`#o-${key}`).textContent = num(settings[/** @type {"contrast"} */ (key)], key === "threshold" ? 2 : 1);
    $(`#r-${key}`).value = String(settings[/** @type {"contrast"} */ (key)]);
  }
  for (const button of $$("[data-mode]")) button.setAttribute("aria-pressed", String(button.dataset.mode === settings.mode));
  const isSame = JSON.stringify(settings) === JSON.stringify(first);
  $("#write").disabled = isSame;
  $("#will").textContent = isSame
    ? "Nothing has changed yet."
    : "Writes a new file with calibration and vision for a rig file. The run itself keeps the settings it began with; the next one can take these.";
}

let asks = 0;
let timer = 0;
/** Looks again when nobody has changed anything for a moment. */
function changed() {
  fields();
  photograph();
  clearTimeout(timer);
  timer = setTimeout(async () => {
    const ask = ++asks;
    try {
      const found = await get("api/tune/look", {
        plan: JSON.stringify({ at, settings, photographs: before.map((one) => one.photo) }),
      });
      if (ask !== asks) return;
      seen = found.seen;
      $("#toml").textContent = found.text.toml;
      put($("#command"), command(found.text.command));
      put($("#banner"), "");
    } catch (error) {
      put($("#banner"), banner("", "status", folded(wordOf(error))));
    }
    photograph();
    samples();
    facts();
  }, 250);
}

put(
  $("#sliders"),
  SLIDERS.map(
    ([key, name, hint, low, high, step]) =>
      html`<div class="slider">
        <label for="r-${key}">${name}</label><output id="o-${key}" for="r-${key}"></output>
        <input
          id="r-${key}"
          aria-describedby="h-${key}"
          type="range"
          min="${low}"
          max="${high}"
          step="${step}"
          data-key="${key}"
        /><small id="h-${key}">${hint}</small>
      </div>`,
  ),
);
$("#sliders").addEventListener("input", (event) => {
  settings[/** @type {"contrast"} */ (event.target.dataset.key)] = Number(event.target.value);
  changed();
});
$("#mode").onclick = (event) => {
  const button = event.target.closest("[data-mode]");
  if (!button) return;
  settings.mode = button.dataset.mode;
  changed();
};
$("#reset").onclick = () => {
  settings = structuredClone(first);
  changed();
};
$("#only").onclick = () => {
  isOnly = !isOnly;
  $("#only").setAttribute("aria-pressed", String(isOnly));
  samples();
};
$("#samples").onclick = (event) => {
  const button = event.target.closest("[data-index]");
  if (!button) return;
  chosen = Number(button.dataset.index);
  photograph();
  samples();
  $(`#samples [data-index="${chosen}"]`)?.focus();
};

/** @param {number} corner @param {number} x @param {number} y */
function move(corner, x, y) {
  const [px, py] = [Math.round(Math.min(width(), Math.max(0, x))), Math.round(Math.min(height(), Math.max(0, y)))];
  if (corner === 4) {
    settings.base = [px, py];
  } else {
    const [left, top, w, h] = settings.roi ?? [0, 0, width(), height()];
    let [l, t, r, b] = [left, top, left + w, top + h];
    if (corner % 2) r = Math.max(px, l + 40);
    else l = Math.min(px, r - 40);
    if (corner > 1) b = Math.max(py, t + 40);
    else t = Math.min(py, b - 40);
    settings.roi = [
      Math.max(0, l),
      Math.max(0, t),
      Math.min(width(), r) - Math.max(0, l),
      Math.min(height(), b) - Math.max(0, t),
    ];
  }
  changed();
}
/** @type {number | null} */
let dragged = null;
$("#over").addEventListener("pointerdown", (event) => {
  const handle = event.target.closest("[data-corner]");
  if (!handle) return;
  dragged = Number(handle.dataset.corner);
  $("#over").setPointerCapture(event.pointerId);
  event.preventDefault();
});
$("#over").addEventListener("pointermove", (event) => {
  if (dragged === null) return;
  const box = $("#over").getBoundingClientRect();
  move(dragged, ((event.clientX - box.left) / box.width) * width(), ((event.clientY - box.top) / box.height) * height());
});
for (const name of ["pointerup", "pointercancel"]) {
  $("#over").addEventListener(name, () => {
    dragged = null;
  });
}
$("#over").addEventListener("keydown", (event) => {
  const handle = event.target.closest?.("[data-corner]");
  const by = { ArrowLeft: [-4, 0], ArrowRight: [4, 0], ArrowUp: [0, -4], ArrowDown: [0, 4] }[event.key];
  if (!handle || !by) return;
  event.preventDefault();
  const corner = Number(handle.dataset.corner);
  const [x, y, w, h] = settings.roi ?? [0, 0, width(), height()];
  const [px, py] = corner === 4 ? settings.base : [x + (corner % 2 ? w : 0), y + (corner > 1 ? h : 0)];
  move(corner, px + by[0], py + by[1]);
});

$("#write").onclick = async () => {
  try {
    const { file } = await post("api/tune/write", { at, settings, name: $("#name").value.trim() }, WRITES_MS);
    toast(`${file} is written.`);
  } catch (error) {
    say(error);
  }
};

/** @param {string} place */
async function open(place) {
  at = place;
  put($("#banner"), banner("calm", "status", `Looking at the photographs of ${at || "this folder"}.`));
  try {
    about = await get("api/tune", { at });
  } catch (error) {
    return refuse(error);
  }
  put($("#banner"), "");
  settings = structuredClone(about.settings);
  first = structuredClone(about.settings);
  [seen, before, chosen] = [about.seen, about.seen, about.seen.length - 1];
  for (const id of ["#facts", "#work"]) $(id).hidden = false;
  put($("#virtual"), about.is_virtual ? virtual("virtual bean") : "");
  frameFor(width(), height());
  $("#name").value = `${(at || "photographs").replaceAll("/", "-")}-vision`;
  changed();
}
$("#folder-form").onsubmit = (event) => {
  event.preventDefault();
  open($("#folder").value.trim());
};
$("#source").onchange = () => open($("#source").value);
new ResizeObserver(() => photograph()).observe($("#photo"));

session.then(async ({ session: own }) => {
  if (!own) return;
  listen("items", "", () => {});
  const { items } = await get("api/items");
  const runs = items.filter((item) => item.kind === "run" && item.step !== null);
  const options = runs.map((run) => html`<option value="${run.at}">${run.name} (${plural(run.step + 1, "photograph")})</option>`);
  put($("#source"), runs.length ? options : html`<option value="">no run yet</option>`);
  const wanted = asked.get("at") ?? runs[0]?.at;
  if (wanted === undefined)
    return put(
      $("#banner"),
      banner("calm", "status", "There is no run with photographs in this folder yet. Name a folder of photographs below it."),
    );
  $("#source").value = wanted;
  open(wanted);
});
