// The wall of nodes: draw a path, watch the nodes lead a virtual bean along it. Shared by the studio and the page in a browser.
// @ts-check
import { $, $$, get, html, icon, put, say } from "./studio.js";

const RULES = { machine: "Machine", "path-lit": "Path lit", dormant: "Dormant" };
/** Nodes whose heights differ by less are on one level, in cm. */
const SAME_LEVEL_CM = 0.5;

/** @typedef {import("./types.d.ts").ShownWall} Wall */
/** @typedef {import("./types.d.ts").WallPicture} Picture */

/** @type {Wall} */
let wall = { nodes: [], links: [], path: [] };
/** Name of the wall file, empty for the wall of three levels. */
let file = "";
let rule = "machine";
let seed = 1;
/** What is shown; `right` says on which levels the tip passed on the side of the path, and is missing of a real wall. @type {{ pictures: Picture[], right?: boolean[] } | null} */
let shown = null;
let at = 0;
let isPlaying = false;
/** Numbers the times that it plays: one that was paused does not go on beside the next. */
let plays = 0;
/** Numbers the plants: an answer of an earlier one is left out. */
let number = 0;

/** The drawing and its buttons. @param {any} more what stands below them */
export const wallMarkup = (more = "") =>
  html`<div class="cols main-side">
    <svg class="figure" id="wall" role="group" aria-label="The wall"></svg>
    <div class="stack">
      <section class="sheet">
        <div id="wall-steer">
          <h2>What runs in the nodes</h2>
          <div class="seg full" role="group" aria-label="What runs in the nodes" id="wall-rule">
            ${Object.entries(RULES).map(([name, title]) => html`<button type="button" data-rule="${name}">${title}</button>`)}
          </div>
        </div>
        <div class="row">
          <button class="btn primary" type="button" id="wall-play"></button>
          <button class="btn" type="button" id="wall-new">Another bean</button>
        </div>
        <label class="fields">Time<input type="range" id="wall-time" min="0" value="0" /></label>
        <p id="wall-says"></p>
      </section>
      ${more}
    </div>
  </div>`;

/** Puts life into the markup. */
export function enterWall() {
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
}

/** Names of the nodes on the path, with commas between them. */
export const pathNames = () => wall.path.map((node) => wall.nodes[node].name).join(",");

/** Shows a wall file, and grows a plant before it. @param {string} name */
export async function openWall(name) {
  wall = await get("api/wall", { file: name });
  file = name;
  $("#wall-steer").hidden = $("#wall-new").hidden = false;
  await grow({});
}

/** Shows what the nodes of a real wall said; its latest step unless an earlier one is looked at. @param {Wall} real @param {Picture[]} pictures */
export function showWatched(real, pictures) {
  number++;
  const isLatest = !shown || shown.right !== undefined || at >= shown.pictures.length - 1;
  [wall, shown] = [real, { pictures }];
  $("#wall-steer").hidden = $("#wall-new").hidden = true;
  $("#wall-time").max = Math.max(0, pictures.length - 1);
  if (isLatest) at = Math.max(0, pictures.length - 1);
  draw();
}

/** Lays the path through a node, and no longer through another one of its level. @param {HTMLElement | null} element */
function choose(element) {
  if (!element || (shown && shown.right === undefined)) return;
  const node = Number(element.dataset.node);
  const height = wall.nodes[node].at[1];
  const others = wall.path.filter((other) => Math.abs(wall.nodes[other].at[1] - height) >= SAME_LEVEL_CM);
  grow({ path: [...others, node].sort((one, other) => wall.nodes[one].at[1] - wall.nodes[other].at[1]) });
}

/** Grows a plant, with what is given changed. @param {{ path?: number[], rule?: string, seed?: number }} next */
async function grow(next) {
  const before = wall.path;
  ({ path: wall.path = wall.path, rule = rule, seed = seed } = next);
  const own = ++number;
  for (const button of $$("[data-rule]")) button.setAttribute("aria-pressed", String(button.dataset.rule === rule));
  isPlaying = false;
  shown = null;
  draw();
  try {
    const found = await get("api/wall/try", { file, path: pathNames(), rule: /** @type {"machine"} */ (rule), seed });
    if (own !== number) return;
    [shown, at] = [found, 0];
    $("#wall-time").max = found.pictures.length - 1;
    play(true);
  } catch (error) {
    say(error);
    // A path that no links allow: back to the last one.
    if (own === number && next.path) grow({ path: before });
  }
}

/** @param {boolean} is */
async function play(is) {
  const own = ++plays;
  if (is && shown && at >= shown.pictures.length - 1) at = 0;
  isPlaying = is;
  draw();
  while (isPlaying && shown) {
    // Five hours of a virtual plant a second.
    await new Promise((done) => setTimeout(done, 50));
    if (!isPlaying || own !== plays) return;
    if (++at >= shown.pictures.length - 1 || !$("#wall")?.checkVisibility()) isPlaying = false;
    draw();
  }
}

/** Pixels of the drawing: a centimetre is 22, and the root lies in the middle. */
const SCALE = 22;
let [width, height] = [440, 520];
/** @param {number} x */
const X = (x) => Math.round(width / 2 + SCALE * x);
/** @param {number} y */
const Y = (y) => Math.round(height - 20 - SCALE * y);

function draw() {
  const aside = Math.max(6, ...wall.nodes.map((node) => Math.abs(node.at[0])));
  [width, height] = [2 * SCALE * (aside + 4), SCALE * (Math.max(18, ...wall.nodes.map((node) => node.at[1])) + 4) + 20].map(Math.round);
  $("#wall").setAttribute("viewBox", `0 0 ${width} ${height}`);
  put($("#wall-play"), isPlaying ? html`${icon("pause")}Pause` : html`${icon("play")}Play`);
  $("#wall-play").disabled = !shown?.pictures.length;
  const picture = shown?.pictures[Math.min(at, shown.pictures.length - 1)];
  $("#wall-time").value = at;
  const way = wall.path.map((node) => `L${X(wall.nodes[node].at[0])} ${Y(wall.nodes[node].at[1])}`).join("");
  const stem = picture?.stem.length ? `<path class="stem" d="M${picture.stem.map(([x, y]) => `${X(x)} ${Y(y)}`).join("L")}"/>` : "";
  const focused = /** @type {any} */ (document.activeElement)?.dataset?.node;
  $("#wall").innerHTML =
    `<path class="soil" d="M0 ${Y(0)}H${width}"/><path class="way" d="M${X(0)} ${Y(0)}${way}"/>${wall.nodes.map((_, node) => nodeOf(node, picture).text).join("")}${stem}`;
  if (focused !== undefined) $(`#wall [data-node="${focused}"]`)?.focus({ preventScroll: true });
  put($("#wall-says"), html`${words(picture)}`);
}

/** @param {number} node @param {Picture | undefined} picture */
function nodeOf(node, picture) {
  const { name, at: place } = wall.nodes[node];
  const { level = 0, sees = false, done = false } = picture?.nodes[node] ?? {};
  const isOn = wall.path.includes(node);
  const state = picture && !picture.nodes[node] ? "silent" : level ? "lit" : sees ? "sees the plant" : done ? "done" : "dark";
  const [x, y] = [X(place[0]), Y(place[1])];
  const glow = level ? html`<circle class="glow" cx="${x}" cy="${y}" r="34" />` : "";
  const classes = `node${isOn ? " on" : ""}${level ? " lit" : ""}`;
  const drawing = html`${glow}<circle class="${classes}" cx="${x}" cy="${y}" r="16" /><circle class="t-hit" cx="${x}" cy="${y}" r="26" /><text class="mark" x="${x}" y="${y + 40}" text-anchor="middle">${state}</text>`;
  const label = `${name}: ${isOn ? "on the path" : "not on the path"}, ${state}`;
  if (shown && shown.right === undefined) return html`<g role="img" aria-label="${label}">${drawing}</g>`;
  return html`<g tabindex="0" role="button" data-node="${node}" aria-pressed="${isOn}" aria-label="${label}">${drawing}</g>`;
}

/** What is seen, in words. @param {Picture | undefined} picture */
function words(picture) {
  if (!shown) return "The bean grows …";
  if (!picture) return "The nodes said nothing yet.";
  const lit = picture.nodes.flatMap((node, place) => (node?.level ? [wall.nodes[place].name] : []));
  const now = `${picture.when}, ${lit.length ? `${lit.join(" and ")} lit` : "all dark"}`;
  if (!shown.right || at < shown.pictures.length - 1) return `${now}.`;
  const right = shown.right.filter((is) => is).length;
  return `${now}: the end. The tip passed ${right} of ${wall.path.length} levels on the side of the path.`;
}
