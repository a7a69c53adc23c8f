// The plane: what is drawn, and the plant that is tried.
// @ts-check
import { $, asked, escaped, get, num, say } from "./studio.js";
import { cross, line, wantedLine } from "./figure.js";
import { shape } from "./obstacle.js";
import { KINDS, handles, isObstacle, items, mode, nameOf, obstacleOf, reach, sorted, targets, wanted, word } from "./drawing.js";

/** @typedef {import("./drawing.js").Item} Item */
/** @typedef {import("./types.d.ts").TriedBean} TriedBean */
/** @typedef {Pick<TriedBean, "frames" | "fitness" | "crossings"> & { isOver: boolean, at: number, lights: string }} Trial */

/** Distance at its height from which a target counts as missed, in cm (`MISS_CM` of the library). */
const MISS_CM = 1;

/** The plane in pixels of its drawing: 34 in a centimetre, the root at 340, 600. */
export const [W, H, U, ROOT, SOIL] = [680, 660, 34, 340, 600];
const X = (/** @type {number} */ x) => ROOT + U * x;
const Y = (/** @type {number} */ y) => SOIL - U * y;

/**
 * What the page shows: its phase, the evolution whose champion is tried, who steers, their trials, and the lamp that you light.
 * @type {{ phase: "draw" | "evolve" | "try", at: string, who: "champion" | "greedy" | "rule" | "you", trials: Record<string, Trial | undefined>, yours: string }}
 */
export const view = { phase: "draw", at: asked.get("at") ?? "", who: "champion", trials: {}, yours: "l" };

function area() {
  if (!reach.length) return "";
  const edge = (/** @type {number} */ side) => reach.map(([y, x]) => `${X(side * x).toFixed(0)} ${Y(y).toFixed(0)}`);
  const one = (/** @type {number} */ side) => {
    const points = edge(side);
    const wall = side < 0 ? 0 : W;
    const low = `${ROOT} ${mode === "form" ? SOIL : Y(4)}`;
    return `<path class="out" d="M${wall} ${SOIL}L${ROOT} ${SOIL}L${low}L${points.join("L")}L${wall} ${points.at(-1)?.split(" ")[1]}Z"/><path class="edge" d="M${low}L${points.join("L")}"/>`;
  };
  return `${one(-1)}${one(1)}<text x="12" y="${SOIL - 70}">out of reach</text><text x="${W - 12}" y="${SOIL - 70}" text-anchor="end">out of reach</text>`;
}

/** A stem without the noise of its detection; both ends stay. @param {[number, number][]} points @returns {[number, number][]} */
function smooth(points) {
  const once = (line) =>
    line.map((point, index) =>
      index === 0 || index === line.length - 1
        ? point
        : [0, 1].map((axis) => (line[index - 1][axis] + 2 * point[axis] + line[index + 1][axis]) / 4),
    );
  return once(once(once(points)));
}

/** @param {Trial | undefined} trial */
function plant(trial) {
  if (view.phase !== "try") return backdrop ? "" : `<path class="bean" d="M${ROOT} ${SOIL}V${Y(4)}"/>`;
  const frame = trial?.frames[trial.at];
  if (!frame) return "";
  const stem = smooth([[0, 0], ...frame.stem]);
  const d = stem.map(([x, y], index) => `${index ? "L" : "M"}${X(x).toFixed(1)} ${Y(y).toFixed(1)}`).join("");
  const [x, y] = stem.at(-1) ?? [0, 4];
  const [px, py] = stem.at(-2) ?? [0, 0];
  const turn = (Math.atan2(X(x) - X(px), Y(py) - Y(y)) * 180) / Math.PI;
  const leaf = `<g transform="translate(${X(x).toFixed(1)} ${Y(y).toFixed(1)}) rotate(${turn.toFixed(0)})"><path class="leaf" d="M0 0c-10-14-26-14-34-8 6 12 22 14 34 8zM0 0c10-14 26-14 34-8-6 12-22 14-34 8z"/></g>`;
  return `<path class="bean ${frame.touches ? "touching" : ""}" d="${d}"/>${leaf}<circle class="tip ${frame.lamp ?? ""}" cx="${X(frame.x).toFixed(1)}" cy="${Y(frame.y).toFixed(1)}" r="7"/>`;
}

/** @param {Trial | undefined} trial */
function trail(trial) {
  if (!trial || view.phase !== "try") return "";
  const paths = { left: "", right: "" };
  let last = "";
  trial.frames.slice(0, trial.at + 1).forEach((to, index, all) => {
    const from = all[index - 1];
    if (!from?.lamp) return;
    if (from.lamp !== last) paths[/** @type {"left"} */ (from.lamp)] += `M${X(from.x).toFixed(1)} ${Y(from.y).toFixed(1)}`;
    paths[/** @type {"left"} */ (from.lamp)] += `L${X(to.x).toFixed(1)} ${Y(to.y).toFixed(1)}`;
    last = from.lamp;
  });
  return ["left", "right"]
    .map((lamp) => `<path class="stroke bold ${lamp}" d="${paths[/** @type {"left"} */ (lamp)]}"/>`)
    .join("");
}

function lampNow() {
  if (view.phase !== "try") return null;
  const trial = view.trials[view.who];
  return trial?.frames[trial.at]?.lamp ?? (view.who === "you" ? (view.yours === "l" ? "left" : "right") : null);
}

/** A photograph behind the drawing, in its own scale. @type {{ href: string, x: number, y: number, w: number, h: number } | null} */
let backdrop = null;
$("#backdrop").onchange = async () => {
  const run = $("#backdrop").value;
  backdrop = null;
  if (run !== "") {
    try {
      const [about, { items: all }] = await Promise.all([get("api/run", { at: run }), get("api/items")]);
      const name = all.find((item) => item.at === run)?.photo_name;
      if (!name || !about.base) throw new Error("This run has no photograph, or no scale.");
      const [x, y] = about.base.map((pixels) => pixels / about.px_per_cm);
      const href = `api/run/photo?${new URLSearchParams({ at: run, name })}`;
      backdrop = { href, x: X(-x), y: Y(y), w: (U * about.width) / about.px_per_cm, h: (U * about.height) / about.px_per_cm };
    } catch (error) {
      say(error);
    }
  }
  draw();
};
const behind = () =>
  backdrop && view.phase === "draw"
    ? `<image href="${escaped(backdrop.href)}" x="${backdrop.x}" y="${backdrop.y}" width="${backdrop.w}" height="${backdrop.h}"/>`
    : "";

const HATCH =
  '<defs><pattern id="hatch" width="11" height="11" patternTransform="rotate(45)" patternUnits="userSpaceOnUse"><path class="hatch" d="M0 0V11"/></pattern></defs>';

/** Width of the plane in pixels: none before it is laid out, nor while it is hidden. */
let width = 0;

export function draw() {
  const lamp = lampNow();
  // A bean that is tried grows on the plane, not on the photograph.
  $("#plane").classList.toggle("on-photo", backdrop !== null && view.phase === "draw");
  $("#lampline").dataset.lamp = lamp ?? "";
  // To ask for the width here would lay out the page at each of the steps in which it begins.
  if (!width) return;
  const grid = Array.from({ length: 9 }, (_, index) => `M0 ${Y(2 * index)}H${W}M${X(2 * index - 8)} 0V${SOIL}`).join("");
  const heights = [4, 8, 12].map((y) => `<text x="8" y="${Y(y) - 5}">${y}${y === 12 ? " cm" : ""}</text>`);
  const lampAt = (side, name) => {
    const x = side < 0 ? 58 : W - 58;
    const isLit = lamp === name;
    const letter = name[0];
    return `${isLit ? `<circle class="glow ${letter}" cx="${x}" cy="62" r="74"/>` : ""}<circle class="lamp-${letter} ${isLit ? "lit" : ""}" cx="${x}" cy="62" r="22"/><text class="halo" x="${x - side * 34}" y="68" text-anchor="${side < 0 ? "start" : "end"}">${name}</text>`;
  };
  const trial = view.trials[view.who];
  const others = Object.entries(view.trials).filter(([name]) => view.phase === "try" && name !== view.who);
  const ghosts = others.map(([, other]) =>
    other
      ? `<path class="edge" d="${line(
          other.frames.map((one) => one.x),
          other.frames.map((one) => one.y),
          X,
          Y,
        )}"/>`
      : "",
  );
  const all = targets();
  const form = wantedLine(wanted(), X, Y);
  // A cross is as large on a phone.
  const size = Math.max(1, (0.7 * W) / width);
  const things = items.filter(isObstacle).map((item) => {
    const drawn = shape(obstacleOf(item), X, Y);
    return word(item).isFar ? drawn.replace('class="obstacle', 'class="obstacle far') : drawn;
  });
  const ways = sorted("way").map(({ points: [[x, y]] }) => {
    const r = 7 * size;
    return `<path class="way" d="M${X(x)} ${Y(y) - r}l${r} ${r}l${-r} ${r}l${-r} ${-r}Z"/>`;
  });
  const marks = all.map((item, index) => {
    const [x, y] = item.points[0];
    const { isFar } = word(item);
    const crossing = view.phase === "try" ? trial?.crossings[index] : null;
    const isVisited = crossing && crossing.step <= (trial?.at ?? 0) && crossing.distance_cm < MISS_CM;
    const ring =
      isFar || isVisited
        ? `<circle class="ring ${isFar && !isVisited ? "far" : ""}" cx="${X(x)}" cy="${Y(y)}" r="18"/>`
        : "";
    return `<g>${ring}${cross(X(x), Y(y), index + 1, 9 * size)}</g>`;
  });
  const isPart = ({ kind }) => kind === "node" || kind === "apex" || kind === "inflection";
  const parts = items.filter(isPart).map((item) => {
    const [x, y] = item.points[0];
    const isFar = word(item).isFar && view.phase === "draw";
    const ring = isFar ? `<circle class="ring far" cx="${X(x)}" cy="${Y(y)}" r="18"/>` : "";
    if (item.kind === "node") return ring + (view.phase === "draw" ? `<circle class="knob" cx="${X(x)}" cy="${Y(y)}" r="${5 * size}"/>` : "");
    const side = x < 0 ? -1 : 1;
    return `${ring}<circle class="way" cx="${X(x)}" cy="${Y(y)}" r="${7 * size}"/><text class="halo" x="${X(x) + 14 * side * size}" y="${Y(y) + 5}" text-anchor="${side < 0 ? "end" : "start"}">${KINDS[item.kind].name.toLowerCase()}</text>`;
  });
  const grips = view.phase === "draw" ? items.flatMap((item, index) => handles(item).map((handle, place) => grip(item, index, handle, place))) : [];
  const dotted = all.map(({ points: [[, y]] }) => `<path class="dotted" d="M0 ${Y(y)}H${W}"/>`);
  const pot =
    backdrop && view.phase === "draw"
      ? ""
      : `<path class="pot" d="M${ROOT - 52} ${SOIL}H${ROOT + 52}L${ROOT + 42} ${H}H${ROOT - 42}Z"/>`;
  const scale = Math.max(1, W / width);
  $("#plane").style.setProperty("--u", scale.toFixed(2));
  const focused = /** @type {any} */ (document.activeElement)?.dataset?.grip;
  $("#plane").innerHTML =
    `<svg class="figure" viewBox="0 0 ${W} ${H}" role="group">${HATCH}${behind()}<path class="grid" d="${grid}"/>${area()}${heights.join("")}${dotted.join("")}${lampAt(-1, "left")}${lampAt(1, "right")}${pot}<path class="soil" d="M0 ${SOIL}H${W}"/>${form}${things.join("")}${ghosts.join("")}${trail(trial)}${plant(trial)}${ways.join("")}${parts.join("")}${marks.join("")}${grips.join("")}</svg>`;
  if (focused !== undefined) $(`#plane [data-grip="${focused}"]`)?.focus();
}
/** Half of what a finger meets, whatever the scale of the drawing. */
const hit = () => Math.max(22, (22 * W) / width);

/** @param {Item} item @param {number} index @param {ReturnType<typeof handles>[0]} handle @param {number} place */
function grip(item, index, { at: [x, y], name, isWhole }, place) {
  const { text } = word(item);
  const size = item.kind === "disc" && isWhole ? `, radius ${num(item.radius, 1)} cm` : "";
  const knob = isWhole && !isObstacle(item) ? "" : `<circle class="knob" cx="${X(x)}" cy="${Y(y)}" r="${(hit() / 4).toFixed(1)}"/>`;
  const label = `${nameOf(item)}${name} at ${num(x, 1)}, ${num(y, 1)} cm${size}${isWhole && text ? `, ${text}` : ""}. Arrow keys move it, Delete removes it.`;
  return `<g tabindex="0" role="button" data-grip="${index}.${place}" aria-label="${label}">${knob}<circle class="ring" stroke-opacity="0" cx="${X(x)}" cy="${Y(y)}" r="18"/><circle class="t-hit" cx="${X(x)}" cy="${Y(y)}" r="${hit()}"/></g>`;
}
new ResizeObserver(([{ contentRect }]) => {
  width = contentRect.width;
  draw();
}).observe($("#plane"));
