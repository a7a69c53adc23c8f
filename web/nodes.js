// Nodes of a lamp and a proximity sensor each, which lead a virtual bean along the path that is drawn.
// @ts-check
import { Engine } from "./engine.js";
import { $, $$, html, icon, num, put, say } from "./studio.js";

const RULES = { machine: "Machine", "path-lit": "Path lit", dormant: "Dormant" };

/** @typedef {{ name: string, at: [number, number, number] }} Place */
/** @typedef {{ hours: number, stem: [number, number][], nodes: { level: number, sees: boolean, done: boolean }[] }} Picture */

/** @type {Engine | null} */
let engine = null;
/** The nodes; two that are next to each other are one level. @type {Place[]} */
let places = [];
/** Number of the node of each level on the path, lowest first. @type {number[]} */
let path = [];
let rule = "machine";
let seed = 1;
/** What became of the plant. @type {{ pictures: Picture[], decisions: { node: number, is_right: boolean }[] } | null} */
let grown = null;
let at = 0;
let isPlaying = false;
/** Numbers the times that it plays: one that was paused does not go on beside the next. */
let plays = 0;
/** Numbers the plants: an answer of an earlier one is left out. */
let number = 0;

/** Pixels of the drawing: a centimetre is 22. @param {number} x */
const X = (x) => Math.round(220 + 22 * x);
/** @param {number} y */
const Y = (y) => Math.round(500 - 22 * y);

export async function openNodes() {
  if ($("#wall")) return;
  put(
    $("#view-nodes"),
    html`<div class="head">
        <div class="head-row"><h1>Nodes that steer together</h1><span class="chip virtual">virtual bean</span></div>
        <p class="lede">
          Each node is a lamp with a proximity sensor behind the plant. It knows its own echo and what its neighbours say; nobody knows where the plant
          is. Touch a node to lay the path through it.
        </p>
      </div>
      <div class="cols main-side">
        <svg class="figure" id="wall" viewBox="0 0 440 520" role="group" aria-label="The wall"></svg>
        <section class="sheet">
          <h2>What runs in the nodes</h2>
          <div class="seg full" role="group" aria-label="What runs in the nodes" id="wall-rule">
            ${Object.entries(RULES).map(([name, title]) => html`<button type="button" data-rule="${name}">${title}</button>`)}
          </div>
          <div class="row">
            <button class="btn primary" type="button" id="wall-play"></button>
            <button class="btn" type="button" id="wall-new">Another bean</button>
          </div>
          <label class="fields">Time<input type="range" id="wall-time" min="0" value="0" /></label>
          <p id="wall-says"></p>
        </section>
      </div>`,
  );
  $("#wall-rule").onclick = (event) => {
    const button = event.target.closest("[data-rule]");
    if (button) grow({ rule: button.dataset.rule });
  };
  $("#wall-new").onclick = () => grow({ seed: seed + 1 });
  $("#wall-play").onclick = () => play(!isPlaying);
  $("#wall-time").oninput = () => {
    at = Number($("#wall-time").value);
    draw();
  };
  $("#wall").onclick = (event) => choose(event.target.closest("[data-node]"));
  $("#wall").onkeydown = (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    choose(event.target.closest("[data-node]"));
  };
  engine ??= new Engine("whole");
  try {
    places = await engine.ask({ nodes: {} });
    await grow({ path: places.map((_, node) => node).filter((node) => node % 4 === 0 || node % 4 === 3) });
  } catch (error) {
    say(error);
  }
}

/** Lays the path through a node, and no longer through the other one of its level. @param {HTMLElement | null} element */
function choose(element) {
  if (!element) return;
  const node = Number(element.dataset.node);
  grow({ path: path.map((old) => (old >> 1 === node >> 1 ? node : old)) });
}

/** Grows a plant, with what is given changed. @param {{ path?: number[], rule?: string, seed?: number }} next */
async function grow(next) {
  ({ path = path, rule = rule, seed = seed } = next);
  const own = ++number;
  for (const button of $$("[data-rule]")) button.setAttribute("aria-pressed", String(button.dataset.rule === rule));
  isPlaying = false;
  grown = null;
  draw();
  try {
    const found = await /** @type {Engine} */ (engine).ask({ wall: { path: path.map((node) => places[node].name), rule, seed } });
    if (own !== number) return;
    [grown, at] = [found, 0];
    $("#wall-time").max = found.pictures.length - 1;
    play(true);
  } catch (error) {
    say(error);
  }
}

/** @param {boolean} is */
async function play(is) {
  const own = ++plays;
  if (is && grown && at >= grown.pictures.length - 1) at = 0;
  isPlaying = is;
  draw();
  while (isPlaying && grown) {
    // Five hours a second.
    await new Promise((done) => setTimeout(done, 50));
    if (!isPlaying || own !== plays) return;
    if (++at >= grown.pictures.length - 1 || $("#view-nodes").hidden) isPlaying = false;
    draw();
  }
}

function draw() {
  put($("#wall-play"), isPlaying ? html`${icon("pause")}Pause` : html`${icon("play")}Play`);
  $("#wall-play").disabled = !grown;
  const picture = grown?.pictures[Math.min(at, grown.pictures.length - 1)];
  $("#wall-time").value = at;
  const root = `M${X(0)} ${Y(0)}`;
  const way = path.map((node) => `L${X(places[node].at[0])} ${Y(places[node].at[1])}`).join("");
  const stem = picture ? `<path class="stem" d="M${picture.stem.map(([x, y]) => `${X(x)} ${Y(y)}`).join("L")}"/>` : "";
  const focused = /** @type {any} */ (document.activeElement)?.dataset?.node;
  $("#wall").innerHTML =
    `<path class="soil" d="M0 ${Y(0)}H440"/><path class="way" d="${root}${way}"/>${places.map((place, node) => nodeOf(place, node, picture)).join("")}${stem}`;
  if (focused !== undefined) $(`#wall [data-node="${focused}"]`)?.focus({ preventScroll: true });
  put($("#wall-says"), html`${words(picture)}`);
}

/** @param {Place} place @param {number} node @param {Picture | undefined} picture */
function nodeOf({ name, at: [x, y] }, node, picture) {
  const { level = 0, sees = false, done = false } = picture?.nodes[node] ?? {};
  const isOn = path.includes(node);
  const state = level ? "lit" : sees ? "sees the plant" : done ? "done" : "dark";
  const classes = `node${isOn ? " on" : ""}${level ? " lit" : ""}`;
  const glow = level ? `<circle class="glow" cx="${X(x)}" cy="${Y(y)}" r="34"/>` : "";
  return `<g tabindex="0" role="button" data-node="${node}" aria-pressed="${isOn}" aria-label="${name}: ${isOn ? "on the path" : "not on the path"}, ${state}">${glow}<circle class="${classes}" cx="${X(x)}" cy="${Y(y)}" r="16"/><circle class="t-hit" cx="${X(x)}" cy="${Y(y)}" r="26"/><text class="mark" x="${X(x)}" y="${Y(y) + 40}" text-anchor="middle">${state}</text></g>`;
}

/** What is seen, in words. @param {Picture | undefined} picture */
function words(picture) {
  if (!grown || !picture) return "The bean grows …";
  const lit = picture.nodes.flatMap(({ level }, node) => (level ? [places[node].name] : []));
  const now = `${num(picture.hours, 1)} h, ${lit.length ? `${lit.join(" and ")} lit` : "all dark"}`;
  if (at < grown.pictures.length - 1) return `${now}.`;
  const right = grown.decisions.filter(({ is_right }) => is_right).length;
  return `${now}: the end. The tip passed ${right} of ${path.length} levels on the side of the path.`;
}
