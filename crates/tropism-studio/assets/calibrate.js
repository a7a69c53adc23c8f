// Calibrate a camera by clicks: both ends of something of known length, and the place where the stem leaves the soil.
// @ts-check
import { $, $$, command, folded, html, num, onYes, post, put, toast, trusted, wordOf } from "./studio.js";
import { ring } from "./photo.js";

/** How long a calibration may take: other work with photographs comes first. */
const ANSWER_MS = 60_000;
const NAMES = ["One end", "Other end", "Root"];

/** The photograph that is clicked in. @type {{ rig: string, number: number, size: [number, number] } | null} */
let photo = null;
/** The three places, in pixels. @type {[number, number][]} */
let points = [];
let chosen = 0;

/** Takes a photograph to click in, or none. @param {typeof photo} next */
export function clickIn(next) {
  const isOther = next?.rig !== photo?.rig;
  photo = next;
  if (next && (isOther || !points.length)) {
    const [width, height] = next.size;
    points = [[0.4, 0.6], [0.6, 0.6], [0.5, 0.75]].map(([x, y]) => [Math.round(x * width), Math.round(y * height)]);
    choose(0);
    forget();
  }
  draw();
}

const isOpen = () => Boolean(photo) && $("#calibrate").open;

/** What was reckoned no longer fits. */
function forget() {
  put($("#reckoned"), "");
}

function draw() {
  $("#clicks").toggleAttribute("hidden", !isOpen());
  $("#reckon").disabled = !photo;
  $("#photo").classList.toggle("clicked", isOpen());
  if (!photo) return;
  const [width, height] = photo.size;
  $("#clicks").setAttribute("viewBox", `0 0 ${width} ${height}`);
  const r = width / 80;
  const [[x1, y1], [x2, y2]] = points;
  const grips = points.map(
    ([x, y], index) =>
      `<g tabindex="0" role="button" data-point="${index}" aria-label="${NAMES[index]} at ${x}, ${y} pixels. Arrow keys move it.">${ring(x, y, r, index === chosen ? "chosen" : "")}<text x="${x}" y="${y - 2 * r}">${["1", "2", "root"][index]}</text></g>`,
  );
  const focused = /** @type {any} */ (document.activeElement)?.dataset?.point;
  const isWithin = $("#clicks").contains(document.activeElement);
  put($("#clicks"), trusted(`<path class="wanted" d="M${x1} ${y1}L${x2} ${y2}"/>${grips.join("")}`));
  if (isWithin) $(`#clicks [data-point="${focused}"]`)?.focus();
}

/** @param {number} index */
function choose(index) {
  chosen = index;
  for (const button of $$("#clicking button")) button.setAttribute("aria-pressed", String(Number(button.dataset.point) === index));
}

/** @param {number} index @param {number} x @param {number} y */
function place(index, x, y) {
  if (!photo) return;
  const within = (value, most) => Math.min(most - 1, Math.max(0, Math.round(value * 10) / 10));
  points[index] = [within(x, photo.size[0]), within(y, photo.size[1])];
  forget();
  draw();
}

$("#calibrate").addEventListener("toggle", draw);
$("#clicking").onclick = ({ target }) => {
  if (target.dataset.point === undefined) return;
  choose(Number(target.dataset.point));
  draw();
};
$("#clicks").onclick = (event) => {
  if (!photo) return;
  const { left, top, width, height } = $("#clicks").getBoundingClientRect();
  const index = chosen;
  choose(Math.min(2, chosen + 1));
  place(index, ((event.clientX - left) / width) * photo.size[0], ((event.clientY - top) / height) * photo.size[1]);
};
$("#clicks").onkeydown = (event) => {
  const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
  const index = Number(event.target.dataset.point);
  if (!by || Number.isNaN(index)) return;
  event.preventDefault();
  const far = event.shiftKey ? 10 : 1;
  choose(index);
  place(index, points[index][0] + far * by[0], points[index][1] + far * by[1]);
};

/** @param {boolean} write */
const ask = (write) =>
  post(
    "api/rig/calibrate",
    {
      rig: photo?.rig,
      number: photo?.number,
      ends: [points[0], points[1]],
      length_cm: Number($("#length").value),
      base: points[2],
      write,
    },
    ANSWER_MS,
  );

$("#measure").onsubmit = async (event) => {
  event.preventDefault();
  const length = Number($("#length").value);
  try {
    const found = await ask(false);
    const isFile = photo?.rig.endsWith(".toml");
    put(
      $("#reckoned"),
      html`<p>
          <b>${num(found.px_per_cm, 2)} pixels a cm.</b> A click that is one pixel off changes all lengths by
          ${num(100 / (length * found.px_per_cm), 1)} %.
        </p>
        ${command(found.table.trimEnd())}
        ${isFile ? html`<button class="btn" type="button" id="write">Write it into ${photo?.rig}…</button>` : ""}
        <details><summary>The same in a terminal</summary><div class="stack">${found.commands.map(command)}</div></details>`,
    );
  } catch (error) {
    put($("#reckoned"), html`<div class="banner bad" role="alert">${folded(wordOf(error))}</div>`);
  }
};
$("#reckoned").onclick = ({ target }) => {
  if (target.id !== "write") return;
  $("#sure-title").textContent = `Write it into ${photo?.rig}?`;
  $("#sure").showModal();
};
onYes($("#sure"), async () => {
  try {
    await ask(true);
    toast(`${photo?.rig} has the new calibration.`);
  } catch (error) {
    put($("#reckoned"), html`<div class="banner bad" role="alert">${folded(wordOf(error))}</div>`);
  }
});
