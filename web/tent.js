// A virtual tent: photographs of a bean, the tip that vision finds in them, and the lamp that follows from it.
// @ts-check
import { drawing } from "../crates/tropism-studio/assets/drawing.js";
import { Engine } from "./engine.js";
import { $, $$, controllers, download, html, icon, num, put, say } from "./studio.js";

const STEERERS = { you: "You", greedy: "Greedy", rule: "Rule", paper: "Champion" };
/** The paper's targets, for which its champion evolved. */
const PAPER = { targets: [[3, 6], [-5, 9], [-1, 13.5]] };

/** @type {Engine | null} */
let engine = null;
let who = "greedy";
let seed = 1;
let isRunning = false;
/** Numbers the tents: an answer of an earlier one is left out. */
let number = 0;
/** The lamp that you light. @type {"left" | "right"} */
let yours = "left";
/** The last photograph, as bytes of a JPEG file. @type {Uint8Array<ArrayBuffer> | null} */
let last = null;
let address = "";

export function openTent() {
  if ($("#tent-photo")) return;
  put(
    $("#view-tent"),
    html`<div class="head">
        <div class="head-row"><h1>A virtual tent</h1><span class="chip virtual">virtual bean</span></div>
        <p class="lede">
          The whole loop: a photograph every five minutes, the tip that vision finds in it, and the lamp that a controller lights for it. Nothing here
          knows where the bean really is.
        </p>
      </div>
      <div class="cols main-side">
        <div class="stack">
          <svg class="figure" id="tent-photo" viewBox="0 0 648 486" role="img" aria-label="No photograph yet"></svg>
          <div class="steer" id="tent-steer">
            <button class="btn l" type="button" id="tent-left" aria-pressed="true">${icon("left")}Left lamp</button>
            <button class="btn r" type="button" id="tent-right" aria-pressed="false">Right lamp${icon("right")}</button>
          </div>
        </div>
        <section class="sheet">
          <h2>Who steers</h2>
          <div class="seg full" role="group" aria-label="Who steers in the tent" id="tent-who">
            ${Object.entries(STEERERS).map(([name, title]) => html`<button type="button" data-steers="${name}">${title}</button>`)}
          </div>
          <div class="row">
            <button class="btn primary" type="button" id="tent-play"></button>
            <button class="btn" type="button" id="tent-new">Another bean</button>
            <button class="btn" type="button" id="tent-save" disabled>Save the photograph</button>
          </div>
          <p class="num" id="tent-says"></p>
          <p class="soft small" id="tent-task"></p>
        </section>
      </div>`,
  );
  $("#tent-who").onclick = (event) => {
    const button = event.target.closest("[data-steers]");
    if (button) begin(button.dataset.steers, seed);
  };
  $("#tent-play").onclick = () => run(!isRunning);
  $("#tent-new").onclick = () => begin(who, seed + 1);
  $("#tent-save").onclick = () => last && download("photograph.jpg", last);
  $("#tent-left").onclick = () => light("left");
  $("#tent-right").onclick = () => light("right");
  begin(who, seed);
}

/** The lamp that you light. @param {"left" | "right"} lamp */
export function light(lamp) {
  if (!$("#tent-steer") || $("#tent-steer").hidden) return;
  yours = lamp;
  for (const side of ["left", "right"]) $(`#tent-${side}`).setAttribute("aria-pressed", String(side === lamp));
}

/** @param {string} next @param {number} plant its seed */
async function begin(next, plant) {
  [who, seed] = [next, plant];
  const own = ++number;
  for (const button of $$("[data-steers]")) button.setAttribute("aria-pressed", String(button.dataset.steers === who));
  $("#tent-steer").hidden = who !== "you";
  const task = who === "paper" ? PAPER : drawing();
  $("#tent-task").textContent = who === "paper" ? "The champion of the paper’s method, towards the paper’s three targets." : "Towards the targets that are drawn in this page.";
  engine ??= new Engine("whole");
  try {
    const file = controllers.get(who);
    const by = who === "you" ? null : who === "greedy" ? "greedy" : { file };
    await engine.ask({ tent: { seed, drawing: task, by } });
    if (own !== number) return;
    const wasRunning = isRunning;
    isRunning = false;
    await step(own);
    run(wasRunning);
  } catch (error) {
    say(error);
  }
}

/** @param {boolean} is */
async function run(is) {
  isRunning = is;
  put($("#tent-play"), is ? html`${icon("pause")}Pause` : html`${icon("play")}Play`);
  const own = number;
  while (isRunning && own === number && !$("#view-tent").hidden) {
    const began = performance.now();
    if (!(await step(own))) break;
    // Four photographs a second, that one sees what happens.
    await new Promise((done) => setTimeout(done, Math.max(0, 250 - (performance.now() - began))));
  }
  if (own === number && isRunning) {
    isRunning = false;
    put($("#tent-play"), html`${icon("play")}Play`);
  }
}

/** Takes a photograph, and lets a step pass; whether there is a next one. @param {number} own */
async function step(own) {
  try {
    const { json: seen, bytes } = await /** @type {Engine} */ (engine).askFor({ step: { light: who === "you" ? yours : null } });
    if (own !== number) return false;
    show(seen, /** @type {Uint8Array<ArrayBuffer>} */ (bytes));
    return !seen.is_over && seen.step < 1000;
  } catch (error) {
    say(error);
    return false;
  }
}

/** @param {any} seen @param {Uint8Array<ArrayBuffer>} bytes */
function show(seen, bytes) {
  last = bytes;
  $("#tent-save").disabled = false;
  const old = address;
  address = URL.createObjectURL(new Blob([bytes], { type: "image/jpeg" }));
  if (old) setTimeout(() => URL.revokeObjectURL(old), 2000);
  const { tip_px: at, tip } = seen;
  const mark = at ? `<path class="found" d="M${at.x - 9} ${at.y - 9}l18 18m0 -18l-18 18"/>` : "";
  const picture = $("#tent-photo");
  picture.innerHTML = `<image href="${address}" width="648" height="486"/>${mark}`;
  const where = tip ? `tip at ${num(tip[0], 1)}, ${num(tip[1], 1)} cm` : "no tip found";
  picture.setAttribute("aria-label", `Photograph of the virtual bean, ${where}`);
  $("#lampline").dataset.lamp = seen.light ?? "";
  const minutes = 5 * seen.step;
  const hour = html`<b>${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, "0")}</b>`;
  const kind = seen.is_measured ? "" : ` (${seen.class})`;
  put($("#tent-says"), html`${hour} ${where}${kind}, ${seen.light ?? "no"} lamp${seen.is_over ? ": the end" : ""}`);
}
