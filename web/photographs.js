// Your photographs: a plant is tracked in them, in this page.
// @ts-check
import { fit, line, plot } from "../crates/tropism-studio/assets/figure.js";
import { Engine } from "./engine.js";
import { $, download, html, inSeconds, num, plural, put, say } from "./studio.js";

/** Photographs that are compared with each other to know how the camera stands, as by the program. */
const FIRST = 6;
/** How many pixels a drag has to move to draw a region. */
const DRAG_PX = 12;

/** @type {Engine | null} */
let engine = null;
/** The photographs, in their order. @type {File[]} */
let files = [];
/** Columns and rows of the first. */
let size = { width: 0, height: 0 };
/** Where the stem leaves the soil, and the region of the plant; null where the program's defaults hold. */
/** @type {{ base: { x: number, y: number } | null, region: { x: number, y: number, width: number, height: number } | null }} */
const marks = { base: null, region: null };
/** What was found in each photograph. @type {any[]} */
let rows = [];
let isStopped = false;
/** Numbers the drawings, so that a late one is left out. */
let drawing = 0;

export function openPhotographs() {
  if ($("#photo-files")) return;
  put(
    $("#view-photographs"),
    html`<div class="head">
        <div class="head-row"><h1>Your photographs</h1></div>
        <p class="lede">
          Photographs of one plant, in the order of their names and at even times. The program finds the tip in each, with the same bits as
          <code>tropism track</code>. They stay on this device: the page may not even ask for anything elsewhere.
        </p>
      </div>
      <div class="cols main-side">
        <div class="stack">
          <div class="dropzone" id="drop">
            <label class="field"><span>JPEG, PNG or TIFF files</span><input type="file" id="photo-files" multiple accept="image/jpeg,image/png,image/tiff" /></label>
            <label class="field"><span>or a folder</span><input type="file" id="photo-folder" webkitdirectory /></label>
            <span class="soft">or drop them here</span>
          </div>
          <canvas class="sight" id="photo" width="720" height="480" role="img" aria-label="No photograph yet" hidden></canvas>
          <label class="field" id="photo-film" hidden><span id="photo-name"></span><input type="range" id="photo-at" min="0" value="0" /></label>
        </div>
        <div class="stack">
          <section class="sheet">
            <h2>Root, region and scale</h2>
            <p class="soft small">Touch the photograph where the stem leaves the soil; drag a frame around where the plant grows, without pot and lamps.</p>
            <div class="two-fields">
              <label class="field"><span>Root, x (px)</span><input type="number" id="root-x" inputmode="numeric" placeholder="middle" /></label>
              <label class="field"><span>Root, y (px)</span><input type="number" id="root-y" inputmode="numeric" placeholder="lower edge" /></label>
              <label class="field"><span>Scale (px per cm)</span><input type="number" id="photo-scale" min="0.1" step="0.1" inputmode="decimal" placeholder="the paper’s camera" /></label>
              <label class="field"><span>Minutes between photographs</span><input type="number" id="photo-period" min="0.1" step="0.1" value="5" inputmode="decimal" /></label>
            </div>
            <div class="row wide">
              <button class="btn primary" type="button" id="photo-track" disabled>Track</button>
              <button class="btn" type="button" id="photo-region" disabled>Whole picture</button>
              <button class="btn" type="button" id="photo-save" disabled>Save the track (CSV)</button>
            </div>
            <p class="soft small" id="photo-says" role="status"></p>
          </section>
          <section class="sheet" aria-label="Path of the tip"><div id="photo-curve"></div></section>
        </div>
      </div>`,
  );
  $("#photo-files").onchange = (event) => take([...event.target.files]);
  $("#photo-folder").onchange = (event) => take([...event.target.files]);
  const drop = $("#drop");
  for (const name of ["dragover", "dragleave", "drop"]) {
    drop.addEventListener(name, (event) => {
      event.preventDefault();
      drop.classList.toggle("over", name === "dragover");
      if (name === "drop") take([...event.dataTransfer.files]);
    });
  }
  for (const id of ["#root-x", "#root-y"]) {
    $(id).onchange = () => {
      const [x, y] = ["#root-x", "#root-y"].map((one) => Number.parseFloat($(one).value));
      marks.base = Number.isFinite(x) && Number.isFinite(y) ? { x, y } : null;
      show();
    };
  }
  $("#photo-at").oninput = show;
  $("#photo-track").onclick = () => ($("#photo-track").dataset.runs ? (isStopped = true) : track());
  $("#photo-region").onclick = () => {
    marks.region = null;
    show();
  };
  $("#photo-save").onclick = async () => {
    try {
      const { bytes } = await vision().askFor({ csv: {} });
      download("track.csv", /** @type {Uint8Array<ArrayBuffer>} */ (bytes));
    } catch (error) {
      say(error);
    }
  };
  marking($("#photo"));
  curve = fit($("#photo-curve"), paths);
}
const vision = () => (engine ??= new Engine("whole"));
/** The engine that holds the track of photographs, once there is one. */
export const tracked = () => (rows.some((row) => row.tip) ? engine : null);
/** Draws the curves. */
let curve = () => {};

/** @param {File[]} found */
async function take(found) {
  const pictures = found.filter(({ name }) => /\.(jpe?g|png|tiff?)$/i.test(name));
  if (!pictures.length) return say(new Error("Found no photographs: wanted JPEG, PNG or TIFF files."));
  try {
    const places = await vision().ask({ order: { names: pictures.map(({ webkitRelativePath, name }) => webkitRelativePath || name) } });
    files = places.map((/** @type {number} */ place) => pictures[place]);
    size = (await vision().askFor({ size: {} }, await bytesOf(files[0]))).json;
    [marks.base, marks.region, rows] = [null, null, []];
    $("#photo").hidden = $("#photo-film").hidden = false;
    $("#photo-at").max = String(files.length - 1);
    $("#photo-at").value = "0";
    $("#photo-track").disabled = $("#photo-region").disabled = false;
    $("#photo-save").disabled = true;
    $("#photo-says").textContent = `${plural(files.length, "photograph")}, ${size.width} × ${size.height} pixels.`;
    show();
    curve();
  } catch (error) {
    say(error);
  }
}
/** @param {File} file */
const bytesOf = async (file) => new Uint8Array(await file.arrayBuffer());

/** Root by a touch, region by a drag. @param {HTMLCanvasElement} canvas */
function marking(canvas) {
  /** @type {{ x: number, y: number } | null} */
  let from = null;
  const at = (/** @type {PointerEvent} */ event) => {
    const box = canvas.getBoundingClientRect();
    const whole = (value, most) => Math.max(0, Math.min(most - 1, Math.round(value)));
    return {
      x: whole(((event.clientX - box.left) / box.width) * size.width, size.width),
      y: whole(((event.clientY - box.top) / box.height) * size.height, size.height),
    };
  };
  canvas.onpointerdown = (event) => {
    from = at(event);
    canvas.setPointerCapture(event.pointerId);
  };
  canvas.onpointerup = (event) => {
    const to = at(event);
    if (from && Math.abs(to.x - from.x) > DRAG_PX && Math.abs(to.y - from.y) > DRAG_PX)
      marks.region = {
        x: Math.min(from.x, to.x),
        y: Math.min(from.y, to.y),
        width: Math.abs(to.x - from.x),
        height: Math.abs(to.y - from.y),
      };
    else if (from) marks.base = to;
    from = null;
    show();
  };
}

/** Shows a photograph with its marks and what was found in it. */
async function show() {
  const own = ++drawing;
  const place = Number($("#photo-at").value);
  const file = files[place];
  if (!file) return;
  if (marks.base) [$("#root-x").value, $("#root-y").value] = [String(marks.base.x), String(marks.base.y)];
  const row = rows[place];
  $("#photo-name").textContent = `${file.name}, ${place + 1} of ${files.length}${row ? `: ${row.class}` : ""}`;
  const canvas = /** @type {HTMLCanvasElement} */ ($("#photo"));
  const picture = await createImageBitmap(file).catch(() => null);
  if (own !== drawing) return;
  [canvas.width, canvas.height] = [size.width, size.height];
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  if (picture) pen.drawImage(picture, 0, 0);
  picture?.close();
  const thick = Math.max(1.5, size.width / 360);
  const cross = ({ x, y }, colour) => {
    const r = 5 * thick;
    [pen.strokeStyle, pen.lineWidth] = [colour, thick];
    pen.stroke(new Path2D(`M${x - r} ${y - r}l${2 * r} ${2 * r}m0 ${-2 * r}l${-2 * r} ${2 * r}`));
  };
  if (marks.region) {
    [pen.strokeStyle, pen.lineWidth] = ["#ffd84a", thick];
    const { x, y, width, height } = marks.region;
    pen.strokeRect(x, y, width, height);
  }
  if (marks.base) cross(marks.base, "#ffd84a");
  if (row?.stem_px) {
    [pen.strokeStyle, pen.lineWidth] = ["#00e5ff", thick];
    pen.stroke(new Path2D(row.stem_px.map(({ x, y }, index) => `${index ? "L" : "M"}${x} ${y}`).join("")));
  }
  if (row?.tip_px) cross(row.tip_px, row.is_measured ? "#ff4fd8" : "#b0b0b0");
  const seen = row?.tip ? `tip at ${num(row.tip[0], 1)}, ${num(row.tip[1], 1)} cm` : "nothing found so far";
  canvas.setAttribute("aria-label", `Photograph ${file.name}: ${seen}`);
}

async function track() {
  const button = $("#photo-track");
  const number = (/** @type {string} */ id) => ($(id).value === "" ? null : Number($(id).value));
  rows = [];
  isStopped = false;
  button.dataset.runs = "yes";
  button.textContent = "Stop";
  $("#photo-save").disabled = true;
  const began = performance.now();
  try {
    const parts = await Promise.all(files.slice(0, FIRST).map(bytesOf));
    const bytes = new Uint8Array(await new Blob(parts).arrayBuffer());
    const first = parts.map(({ length }) => length);
    const question = { track: { px_per_cm: number("#photo-scale"), period_min: number("#photo-period"), ...marks, first } };
    await vision().askFor(question, bytes);
    for (const [place, file] of files.entries()) {
      if (isStopped) break;
      rows.push((await vision().askFor({ next: { name: file.name } }, await bytesOf(file))).json);
      if (place % 4 !== 3 && place + 1 < files.length) continue;
      $("#photo-at").value = String(place);
      $("#photo-says").textContent = `${place + 1} of ${files.length}.`;
      show();
      curve();
    }
    const measured = rows.filter((row) => row.is_measured).length;
    $("#photo-says").textContent =
      `The tip was measured in ${measured} of ${plural(rows.length, "photograph")}, in ${inSeconds((performance.now() - began) / 1000)}.`;
    $("#photo-save").disabled = !rows.some((row) => row.tip);
  } catch (error) {
    $("#photo-says").textContent = "";
    say(error);
  }
  delete button.dataset.runs;
  button.textContent = "Track";
}

/** @param {number} width */
function paths(width) {
  const tips = rows.map((row) => (row.is_measured ? row.tip : null));
  const known = tips.filter(Boolean);
  if (!known.length) return "";
  const steps = tips.map((_, step) => step);
  const values = known.flat();
  return plot({
    w: width,
    h: 200,
    x: [0, Math.max(1, files.length - 1)],
    y: [Math.min(0, ...values) - 0.5, Math.max(...values) + 0.5],
    xl: "photograph",
    yl: "tip x, y (cm)",
    label: `The tip in ${plural(known.length, "photograph")}, now at ${num(known.at(-1)[0], 1)}, ${num(known.at(-1)[1], 1)} cm`,
    body: (x, y) =>
      `<path class="stroke bold right" d="${line(steps, tips.map((tip) => tip?.[0] ?? null), x, y)}"/><path class="stroke bold best" d="${line(steps, tips.map((tip) => tip?.[1] ?? null), x, y)}"/>`,
  });
}
