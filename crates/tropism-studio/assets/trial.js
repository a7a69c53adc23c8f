// The phase in which a controller, or a person, steers a virtual bean.
// @ts-check
import { $, $$, get, html, icon, num, put, say, toast } from "./studio.js";
import { best, isObstacle, items, mode, targets, text } from "./drawing.js";
import { draw, view } from "./plane.js";

/** @typedef {import("./plane.js").Trial} Trial */

/** Seed of the bean. */
export let seed = 101;
let speed = 36;
let isPlaying = false;

const SAYS = {
  champion: "The network that evolved, which sees only where the tip is; or the rule that was tuned.",
  greedy: "Lights the lamp on the side of the next target, or of the next point of the line: the rule that a person would write by hand.",
  rule: "A rule with nine numbers that was tuned beforehand: it looks ahead, and remembers the light so far.",
  you: "You light the lamps: buttons, or the left and right arrow keys. Light early: the bean answers late.",
};
/** Who steers from here on. @param {keyof typeof SAYS} next */
export async function steer(next) {
  view.who = next;
  for (const button of $$("[data-who]")) button.setAttribute("aria-pressed", String(button.dataset.who === next));
  $("#who-says").textContent = SAYS[next];
  $("#steer").hidden = next !== "you";
  await ready();
}
/** A trial at its start: the bean of this seed, steered to its end; by a person, not yet. @param {typeof view.who} who @returns {Promise<Trial>} */
async function grown(who) {
  const found = await get("api/try", {
    // The studio has no rule of its own; the page in a browser alone has one.
    who: /** @type {import("./types.d.ts").Who} */ (who),
    drawing: text(),
    at: who === "champion" ? view.at || null : null,
    seed,
    lights: who === "you" ? "" : null,
  });
  const { frames, fitness, crossings } = found;
  return { frames, fitness, crossings, isOver: found.is_over, at: 0, lights: "" };
}
/** The trial of whoever steers: the bean of this seed from its start. */
async function ready() {
  const own = view.who;
  if (!view.trials[own]) {
    try {
      const found = await grown(own);
      view.trials[own] ??= found;
    } catch (error) {
      isPlaying = false;
      say(error);
    }
  }
  draw();
  scores();
}
function scores() {
  const hasObstacles = items.some(isObstacle);
  const isForm = mode === "form";
  $("#touches").hidden = !hasObstacles;
  $("#goal").textContent = isForm ? "Off the form" : "Beside each target (cm)";
  const row = (/** @type {string} */ name, /** @type {string} */ title) => {
    const trial = view.trials[name];
    const value = trial && trial.at > 0 ? num(trial.fitness[trial.at] ?? 0, 1) : "–";
    return html`<tr class="${name === view.who ? "now" : ""}">
      <th scope="row">${title}</th>
      <td class="n">${isForm ? off(trial) : beside(trial)}</td>
      ${hasObstacles ? html`<td class="n">${trial ? touched(trial) : "–"}</td>` : ""}
      <td class="n">${value}${name === view.who ? html` <span class="soft">of ${num(best, 1)}</span>` : ""}</td>
    </tr>`;
  };
  const steerers = $$("[data-who]").filter((button) => !button.hidden);
  put($("#score"), steerers.map((button) => row(button.dataset.who, button.textContent)));
  const trial = view.trials[view.who];
  const step = trial?.at ?? 0;
  const frame = trial?.frames[step];
  const isEnd = trial && isDone(trial);
  const says =
    !frame
      ? "a bean is being grown"
      : step === 0
      ? "the bean is 4 cm high"
      : isEnd
        ? "the end"
        : `${frame.lamp ?? "no"} lamp, tip ${num(frame.x, 1)}, ${num(frame.y, 1)} cm${frame.touches ? ", touches an obstacle" : ""}`;
  put($("#hour"), html`<b>${Math.floor(step / 12)} h ${String((step % 12) * 5).padStart(2, "0")}</b> ${says}`);
  put($("#play"), isPlaying ? html`${icon("pause")}Pause` : html`${icon("play")}${isEnd ? "Again" : "Play"}`);
  $("#left").setAttribute("aria-pressed", String(view.yours === "l"));
  $("#right").setAttribute("aria-pressed", String(view.yours === "r"));
}
/** How far the stem is from the form. @param {Trial | undefined} trial */
function off(trial) {
  const value = trial?.frames[trial.at]?.off;
  return value === undefined ? "–" : `${num(value, 1)} cm`;
}
/** How far beside each target the tip crossed its height, in cm; a dash for one that is still to come. @param {Trial | undefined} trial */
const beside = (trial) =>
  targets()
    .map((_, index) => trial?.crossings[index])
    .map((one) => (trial && one && one.step <= trial.at ? num(Math.abs(one.distance_cm), 1) : "–"))
    .join(", ");
/** Steps so far at which the stem touched an obstacle. @param {Trial} trial */
const touched = (trial) => trial.frames.slice(0, trial.at + 1).filter((one) => one.touches).length;
/** @param {Trial} trial */
const isDone = (trial) => trial.at >= trial.frames.length - 1 && (view.who !== "you" || trial.isOver || trial.lights.length >= 1000);

/** Begins without trials. @param {keyof typeof SAYS} [who] steers: the champion, or the rule where there is none */
export function begin(who = view.at ? "champion" : "greedy") {
  view.trials = {};
  steer(who);
}
/** Lets all others steer the same bean to the end, for their scores beside that of a person. */
async function rivals() {
  const own = view.trials;
  for (const { hidden, dataset } of $$("[data-who]")) {
    if (hidden || dataset.who === "you" || own[dataset.who]) continue;
    const trial = await grown(dataset.who).catch(() => undefined);
    if (trial) own[dataset.who] = { ...trial, at: trial.frames.length - 1 };
    if (own !== view.trials) return;
    draw();
    scores();
  }
}
export function pause() {
  isPlaying = false;
}

/** @param {boolean} is */
export async function play(is) {
  const trial = view.trials[view.who];
  if (is && trial && isDone(trial)) view.trials[view.who] = undefined;
  isPlaying = is;
  await ready();
  wake();
}
$("#play").onclick = () => play(!isPlaying);
$("#again").onclick = () => {
  view.trials[view.who] = undefined;
  ready();
};
/** Another bean takes the place of this one. @param {number} next its seed */
export function setSeed(next) {
  seed = next;
  view.trials = {};
}
$("#other").onclick = () => {
  setSeed(seed + 1);
  play(true);
};
$("#who").onclick = (event) => {
  const button = event.target.closest("[data-who]");
  if (!button) return;
  if (button.dataset.who === "champion" && !view.at) return toast("Evolve first: there is no champion yet.");
  steer(button.dataset.who);
};
$("#speed").onclick = (event) => {
  const button = event.target.closest("[data-speed]");
  if (!button) return;
  speed = Number(button.dataset.speed);
  for (const other of $$("[data-speed]")) other.setAttribute("aria-pressed", String(other === button));
};
/** @param {string} letter */
const light = (letter) => {
  view.yours = letter;
  if (!isPlaying) play(true);
  scores();
};
$("#left").onclick = () => light("l");
$("#right").onclick = () => light("r");
$("#right").insertAdjacentHTML("beforeend", icon("right").text);
addEventListener("keydown", (event) => {
  if (view.phase !== "try" || view.who !== "you" || /** @type {Element} */ (event.target).matches("input,select")) return;
  if (event.key === "ArrowLeft") light("l");
  if (event.key === "ArrowRight") light("r");
});

let last = 0;
let debt = 0;
/** Whether a frame is asked for: none is while nothing moves. */
let isAwake = false;
function wake() {
  if (isAwake || !isPlaying) return;
  isAwake = true;
  last = performance.now();
  requestAnimationFrame(frame);
}
let isAsking = false;
/** Gives the bean of a person the light of the next steps. @param {Trial} trial @param {number} steps */
async function grow(trial, steps) {
  isAsking = true;
  const lights = trial.lights + view.yours.repeat(steps);
  try {
    const found = await get("api/try", { who: "you", drawing: text(), seed, lights, from: trial.frames.length - 1 });
    trial.lights = lights;
    trial.frames.splice(found.from, trial.frames.length, ...found.frames);
    trial.fitness.splice(found.from, trial.fitness.length, ...found.fitness);
    [trial.crossings, trial.isOver] = [found.crossings, found.is_over];
  } catch (error) {
    isPlaying = false;
    say(error);
  }
  isAsking = false;
}
/** @param {number} time */
function frame(time) {
  const seconds = Math.max(0, Math.min(0.1, (time - last) / 1000));
  last = time;
  const trial = view.trials[view.who];
  if (isPlaying && view.phase === "try" && trial) {
    debt += seconds * speed;
    if (
      view.who === "you" &&
      !isAsking &&
      !trial.isOver &&
      trial.lights.length < 1000 &&
      trial.frames.length - 1 - trial.at < speed / 5
    )
      grow(trial, Math.max(2, Math.round(speed / 8)));
    const steps = Math.min(Math.floor(debt), trial.frames.length - 1 - trial.at);
    debt = Math.min(1, debt - steps);
    if (steps > 0) trial.at += steps;
    if (isDone(trial) && !isAsking) {
      isPlaying = false;
      if (view.who === "you") rivals();
    }
    if (steps > 0 || !isPlaying) {
      draw();
      scores();
    }
  }
  isAwake = isPlaying && view.phase === "try";
  if (isAwake) requestAnimationFrame(frame);
}
