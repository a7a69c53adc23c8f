// Draw targets, way points and obstacles, or a form of the stem; evolve or tune a controller for them, try it on a virtual bean, save the task.
// @ts-check
import {
  $,
  $$,
  asked,
  command,
  escaped,
  get,
  html,
  icon,
  listen,
  num,
  pageOf,
  plural,
  post,
  put,
  say,
  session,
  toast,
  wordOf,
} from "./studio.js";
import { cross, fit, line, plot, wantedLine } from "./figure.js";
import { STEM_CM, distance, outline, shape } from "./obstacle.js";

/** @typedef {[number, number]} Pair */
/**
 * Something that is drawn: a target or a way point has one point, a disc its centre and a radius, a box two corners, a line
 * two ends. Of a form of the stem: a node of its line, the apex of its bow, its inflection, each a point. A further kind has
 * its place here and in `KINDS`.
 * @typedef {{ kind: "target" | "way" | "disc" | "box" | "line" | "node" | "apex" | "inflection", points: Pair[], radius: number }} Item
 */
/** @typedef {{ x: number, y: number, lamp: string | null, stem: [number, number][], touches: boolean, off?: number }} Frame */
/** @typedef {{ frames: Frame[], fitness: number[], crossings: any[], isOver: boolean, at: number, lights: string }} Trial */

const MOST = 8;
/** Of a line, at most. */
const MOST_NODES = 20;
/** The plane in pixels of its drawing: 34 in a centimetre, the root at 340, 600. */
const [W, H, U, ROOT, SOIL] = [680, 660, 34, 340, 600];
const X = (/** @type {number} */ x) => ROOT + U * x;
const Y = (/** @type {number} */ y) => SOIL - U * y;

const KINDS = {
  target: { name: "Target", points: ["x", "y"] },
  way: { name: "Way point", points: ["x", "y"] },
  disc: { name: "Disc", points: ["x", "y"] },
  box: { name: "Box", points: ["x", "y", "x to", "y to"] },
  line: { name: "Line", points: ["x", "y", "x to", "y to"] },
  node: { name: "Point", points: ["x", "y"] },
  apex: { name: "Apex", points: ["x", "y"] },
  inflection: { name: "Inflection", points: ["x", "y"] },
};
/** How far anything may be moved to the side and up, in cm. */
const [SIDE, LOW, HIGH] = [9.5, 0.5, 17];

/** @param {Pair} point @returns {Item} */
const target = (point) => ({ kind: "target", points: [point], radius: 0 });
const node = (/** @type {Pair} */ point) => /** @type {Item} */ ({ kind: "node", points: [point], radius: 0 });
/** Whether targets are drawn, or a form of the stem. @type {"targets" | "form"} */
let mode = "targets";
/** What is drawn, and what was drawn in the other mode. @type {Item[]} */
let items = [target([3, 6]), target([-5, 9]), target([-1, 13.5])];
/** @type {Item[]} */
let aside = [node([0.5, 3]), node([2, 6]), node([2.5, 9]), node([1, 12])];
/** What is wanted of a form in numbers; `null` for what is not. @type {Record<"radius_cm" | "lean_deg" | "within_cm" | "end_height_cm", number | null>} */
let numbers = { radius_cm: null, lean_deg: null, within_cm: null, end_height_cm: null };
/** What a touch of the plane places. @type {Item["kind"]} */
let tool = "target";
/** The best fitness that there can be, as the server says. */
let best = 0;
/** How far to the side tips and stems get by height. @type {Record<"tips" | "stems", [number, number][]>} */
let known = { tips: [], stems: [] };
/** That of what is drawn. @type {[number, number][]} */
let reach = [];
/** The steepest lean of a stem, in degrees. */
let steepest = 90;
/** @type {string[]} */
const past = [];
/** @type {"draw" | "evolve" | "try"} */
let phase = "draw";
/** The evolution whose champion is tried. */
let at = asked.get("at") ?? "";
/** @type {"champion" | "greedy" | "you"} */
let who = "champion";
/** @type {Record<string, Trial | undefined>} */
let trials = {};
let seed = 101;
let speed = 36;
let isPlaying = false;
let yours = "l";
/** @type {any} */
let evolution;

/** What the server is told of the drawing. */
function drawing() {
  const points = (/** @type {string} */ kind) => sorted(kind).map((item) => item.points[0]);
  const obstacles = items.filter(isObstacle).map(obstacleOf);
  if (mode === "targets") return { targets: points("target"), way_points: points("way"), obstacles };
  const [one] = points("apex");
  const [other] = points("inflection");
  return { form: { line: wanted(), apex: one ?? null, inflection: other ?? null, ...numbers } };
}
/** The line that the stem is to follow, from the root; empty for none. @returns {Pair[]} */
function wanted() {
  const nodes = sorted("node").map((item) => item.points[0]);
  return nodes.length ? [[0, 0], ...nodes] : [];
}
/** @param {any} drawn */
function take(drawn) {
  const point = (kind) => (/** @type {Pair} */ pair) => ({ kind, points: [pair], radius: 0 });
  const obstacle = ({ disc, radius_cm, box, line }) =>
    disc
      ? { kind: "disc", points: [disc], radius: radius_cm }
      : { kind: box ? "box" : "line", points: box ?? line, radius: 0 };
  if (drawn.form) {
    const { line: nodes, apex, inflection, ...rest } = drawn.form;
    // The root is part of every line.
    const [first, ...others] = nodes ?? [];
    const root = first && first[0] === 0 && first[1] === 0;
    setMode("form");
    items = [
      ...(root ? others : (nodes ?? [])).map(point("node")),
      ...[apex].filter(Boolean).map(point("apex")),
      ...[inflection].filter(Boolean).map(point("inflection")),
    ];
    numbers = { ...numbers, ...rest };
    return;
  }
  items = [
    ...drawn.targets.map(point("target")),
    ...(drawn.way_points ?? []).map(point("way")),
    ...(drawn.obstacles ?? []).map(obstacle),
  ];
}
/** The points of a kind, from the lowest to the highest. @param {string} kind */
function sorted(kind) {
  return items.filter((item) => item.kind === kind).sort((one, other) => one.points[0][1] - other.points[0][1]);
}
const targets = () => sorted("target");
const text = () => JSON.stringify(drawing());
/** @param {Item} item @returns {import("./obstacle.js").Obstacle} */
const obstacleOf = ({ kind, points, radius }) =>
  kind === "disc" ? { disc: points[0], radius_cm: radius } : /** @type {any} */ ({ [kind]: points });
const isObstacle = (/** @type {Item} */ { kind }) => isThing(kind);
/** Whether something of a kind is larger than a point. @param {Item["kind"]} kind */
const isThing = (kind) => kind === "disc" || kind === "box" || kind === "line";
/** How far to the side a tip gets by a height, in cm. @param {number} y */
function farthest(y) {
  const row = reach.findLast(([height]) => height <= y);
  return row ? row[1] : reach.length && y < reach[0][0] ? 0 : Infinity;
}
/** What there is to say of a thing that is drawn. @param {Item} item */
function word(item) {
  if (isObstacle(item)) return wordOfObstacle(obstacleOf(item));
  if (!reach.length) return { isFar: false, text: "" };
  if (mode === "form") return wordOfForm(item.points[0]);
  const [x, y] = item.points[0];
  const inside = items.find((other) => isObstacle(other) && distance(obstacleOf(other), [x, y]) < STEM_CM);
  if (inside && item.kind === "target")
    return { isFar: true, text: `in the ${KINDS[inside.kind].name.toLowerCase()}: no stem gets there without touching it` };
  if (y <= 4) return { isFar: true, text: "below the seedling’s tip, which begins at 4 cm" };
  const top = reach.at(-1)?.[0] ?? 0;
  if (y > top) return { isFar: true, text: `higher than beans grow here: ${num(top, 1)} cm` };
  const over = Math.abs(x) - farthest(y);
  return over > 0
    ? { isFar: true, text: `${num(over, 1)} cm out of reach on the ${x < 0 ? "left" : "right"}` }
    : { isFar: false, text: "within reach" };
}
/** Of a point at which a stem is to be. @param {Pair} point */
function wordOfForm([x, y]) {
  const top = reach.at(-1)?.[0] ?? 0;
  if (y > top) return { isFar: true, text: `higher than beans grow here: ${num(top, 1)} cm` };
  const over = Math.abs(x) - farthest(y);
  if (over <= 0) return { isFar: false, text: "within reach" };
  const where = y < 4 ? ": the stem stands nearly upright so low" : ` on the ${x < 0 ? "left" : "right"}`;
  return { isFar: true, text: `${num(over, 1)} cm out of reach${where}` };
}
/** @param {import("./obstacle.js").Obstacle} obstacle */
function wordOfObstacle(obstacle) {
  const seedling = Array.from({ length: 41 }, (_, tenth) => /** @type {Pair} */ ([0, tenth / 10]));
  if (seedling.some((point) => distance(obstacle, point) < STEM_CM))
    return { isFar: true, text: "touches the seedling from the start" };
  if (!reach.length) return { isFar: false, text: "" };
  const isMet = ([x, y]) => y <= (reach.at(-1)?.[0] ?? 0) && (y <= 4 ? Math.abs(x) < 1 : Math.abs(x) <= farthest(y));
  return outline(obstacle).some(isMet)
    ? { isFar: false, text: "where beans grow" }
    : { isFar: false, text: "out of reach: in nobody’s way" };
}

// The plane.
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
  if (phase !== "try") return backdrop ? "" : `<path class="bean" d="M${ROOT} ${SOIL}V${Y(4)}"/>`;
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
  if (!trial || phase !== "try") return "";
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
  if (phase !== "try") return null;
  const trial = trials[who];
  return trial?.frames[trial.at]?.lamp ?? (who === "you" ? (yours === "l" ? "left" : "right") : null);
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
  backdrop && phase === "draw"
    ? `<image href="${escaped(backdrop.href)}" x="${backdrop.x}" y="${backdrop.y}" width="${backdrop.w}" height="${backdrop.h}"/>`
    : "";

const HATCH =
  '<defs><pattern id="hatch" width="11" height="11" patternTransform="rotate(45)" patternUnits="userSpaceOnUse"><path class="hatch" d="M0 0V11"/></pattern></defs>';

function draw() {
  const lamp = lampNow();
  // A bean that is tried grows on the plane, not on the photograph.
  $("#plane").classList.toggle("on-photo", backdrop !== null && phase === "draw");
  $("#lampline").dataset.lamp = lamp ?? "";
  const grid = Array.from({ length: 9 }, (_, index) => `M0 ${Y(2 * index)}H${W}M${X(2 * index - 8)} 0V${SOIL}`).join("");
  const heights = [4, 8, 12].map((y) => `<text x="8" y="${Y(y) - 5}">${y}${y === 12 ? " cm" : ""}</text>`);
  const lampAt = (side, name) => {
    const x = side < 0 ? 58 : W - 58;
    const isLit = lamp === name;
    const letter = name[0];
    return `${isLit ? `<circle class="glow ${letter}" cx="${x}" cy="62" r="74"/>` : ""}<circle class="lamp-${letter} ${isLit ? "lit" : ""}" cx="${x}" cy="62" r="22"/><text class="halo" x="${x - side * 34}" y="68" text-anchor="${side < 0 ? "start" : "end"}">${name}</text>`;
  };
  const trial = trials[who];
  const others = Object.entries(trials).filter(([name]) => phase === "try" && name !== who);
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
  const size = Math.max(1, (0.7 * W) / Math.max(1, $("#plane").clientWidth));
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
    const crossed = phase === "try" && trial?.crossings[index] && trial.crossings[index].step <= trial.at;
    const ring =
      isFar || crossed
        ? `<circle class="ring ${isFar && !crossed ? "far" : ""}" cx="${X(x)}" cy="${Y(y)}" r="18"/>`
        : "";
    return `<g>${ring}${cross(X(x), Y(y), index + 1, 9 * size)}</g>`;
  });
  const isPart = ({ kind }) => kind === "node" || kind === "apex" || kind === "inflection";
  const parts = items.filter(isPart).map((item) => {
    const [x, y] = item.points[0];
    const isFar = word(item).isFar && phase === "draw";
    const ring = isFar ? `<circle class="ring far" cx="${X(x)}" cy="${Y(y)}" r="18"/>` : "";
    if (item.kind === "node") return ring + (phase === "draw" ? `<circle class="knob" cx="${X(x)}" cy="${Y(y)}" r="${5 * size}"/>` : "");
    const side = x < 0 ? -1 : 1;
    return `${ring}<circle class="way" cx="${X(x)}" cy="${Y(y)}" r="${7 * size}"/><text class="halo" x="${X(x) + 14 * side * size}" y="${Y(y) + 5}" text-anchor="${side < 0 ? "end" : "start"}">${KINDS[item.kind].name.toLowerCase()}</text>`;
  });
  const grips = phase === "draw" ? items.flatMap((item, index) => handles(item).map((handle, place) => grip(item, index, handle, place))) : [];
  const dotted = all.map(({ points: [[, y]] }) => `<path class="dotted" d="M0 ${Y(y)}H${W}"/>`);
  const pot =
    backdrop && phase === "draw"
      ? ""
      : `<path class="pot" d="M${ROOT - 52} ${SOIL}H${ROOT + 52}L${ROOT + 42} ${H}H${ROOT - 42}Z"/>`;
  const scale = Math.max(1, W / Math.max(1, $("#plane").clientWidth));
  $("#plane").style.setProperty("--u", scale.toFixed(2));
  const focused = /** @type {any} */ (document.activeElement)?.dataset?.grip;
  $("#plane").innerHTML =
    `<svg class="figure" viewBox="0 0 ${W} ${H}">${HATCH}${behind()}<path class="grid" d="${grid}"/>${area()}${heights.join("")}${dotted.join("")}${lampAt(-1, "left")}${lampAt(1, "right")}${pot}<path class="soil" d="M0 ${SOIL}H${W}"/>${form}${things.join("")}${ghosts.join("")}${trail(trial)}${plant(trial)}${ways.join("")}${parts.join("")}${marks.join("")}${grips.join("")}</svg>`;
  if (focused !== undefined) $(`#plane [data-grip="${focused}"]`)?.focus();
}
/** Half of what a finger meets, whatever the scale of the drawing. */
const hit = () => Math.max(22, (22 * W) / Math.max(1, $("#plane").clientWidth));

/**
 * What a thing is held by: where, what it is called, and what moves with it.
 * @param {Item} item @returns {{ at: Pair, name: string, move: (to: Pair) => void, isWhole: boolean }[]}
 */
function handles(item) {
  const { kind, points } = item;
  const middle = /** @type {Pair} */ ([0, 1].map((axis) => points.reduce((sum, point) => sum + point[axis], 0) / points.length));
  const whole = {
    at: middle,
    name: "",
    isWhole: true,
    move: (/** @type {Pair} */ to) => {
      const by = [0, 1].map((axis) => snapped(to[axis] - middle[axis]));
      item.points = points.map(([x, y]) => [x + by[0], y + by[1]]);
    },
  };
  if (kind === "disc") {
    const rim = {
      at: /** @type {Pair} */ ([points[0][0] + item.radius, points[0][1]]),
      name: ", its rim",
      isWhole: false,
      move: (/** @type {Pair} */ [x, y]) => {
        item.radius = Math.min(6, Math.max(0.5, snapped(Math.hypot(x - points[0][0], y - points[0][1]))));
      },
    };
    return [whole, rim];
  }
  if (points.length < 2) return [whole];
  const ends = points.map((at, place) => ({
    at,
    name: kind === "box" ? `, corner ${place + 1}` : `, end ${place + 1}`,
    isWhole: false,
    move: (/** @type {Pair} */ to) => {
      item.points[place] = to;
    },
  }));
  return [whole, ...ends];
}

/** Whether a stem has one of a kind at most. @param {Item["kind"]} kind */
const isOne = (kind) => kind === "apex" || kind === "inflection";
/** What a thing is called: targets by their order, the others by theirs. @param {Item} item */
function nameOf(item) {
  if (isOne(item.kind)) return KINDS[item.kind].name;
  const same = isThing(item.kind) ? items.filter(({ kind }) => kind === item.kind) : sorted(item.kind);
  return `${KINDS[item.kind].name} ${same.indexOf(item) + 1}`;
}

/** @param {Item} item @param {number} index @param {ReturnType<typeof handles>[0]} handle @param {number} place */
function grip(item, index, { at: [x, y], name, isWhole }, place) {
  const { text } = word(item);
  const size = item.kind === "disc" && isWhole ? `, radius ${num(item.radius, 1)} cm` : "";
  const knob = isWhole && !isObstacle(item) ? "" : `<circle class="knob" cx="${X(x)}" cy="${Y(y)}" r="${(hit() / 4).toFixed(1)}"/>`;
  const label = `${nameOf(item)}${name} at ${num(x, 1)}, ${num(y, 1)} cm${size}${isWhole && text ? `, ${text}` : ""}. Arrow keys move it, Delete removes it.`;
  return `<g tabindex="0" role="button" data-grip="${index}.${place}" aria-label="${label}">${knob}<circle class="ring" stroke-opacity="0" cx="${X(x)}" cy="${Y(y)}" r="18"/><circle class="t-hit" cx="${X(x)}" cy="${Y(y)}" r="${hit()}"/></g>`;
}

// By mouse, finger and keys.
const keep = () => {
  past.push(JSON.stringify({ mode, items, numbers }));
  past.splice(0, past.length - 50);
};
const snapped = (/** @type {number} */ value) => Math.round(value * 2) / 2;
/** How low a thing of a kind may stand, in cm. @param {Item["kind"]} kind */
const lowest = (kind) => (kind === "target" || kind === "way" ? 4.5 : LOW);
/** @param {Item} item */
function bound(item) {
  const low = lowest(item.kind);
  item.points = item.points.map(([x, y]) => [Math.min(SIDE, Math.max(-SIDE, x)), Math.min(HIGH, Math.max(low, y))]);
  if (item.points.length === 2 && String(item.points[0]) === String(item.points[1])) item.points[1][0] += item.points[1][0] < SIDE ? 0.5 : -0.5;
  if (isObstacle(item) || isOne(item.kind)) return;
  // Two at one height cannot be told apart.
  const [point] = item.points;
  const isTaken = () => items.some((other) => other !== item && other.kind === item.kind && other.points[0][1] === point[1]);
  for (let tries = 0; isTaken() && tries < 2 * MOST; tries++) point[1] += point[1] >= HIGH - 0.5 ? -0.5 : 0.5;
}
/** @param {PointerEvent} event @returns {Pair} */
function pointed(event) {
  const box = $("#plane svg").getBoundingClientRect();
  return [
    snapped((((event.clientX - box.left) / box.width) * W - ROOT) / U),
    snapped((SOIL - ((event.clientY - box.top) / box.height) * H) / U),
  ];
}
/** The thing that is dragged, and the handle that it is dragged by. @type {{ item: Item, place: number, from: Pair | null } | null} */
let dragged = null;
$("#plane").addEventListener("pointerdown", (event) => {
  if (phase !== "draw") return;
  const mark = event.target.closest?.("[data-grip]");
  if (mark) {
    keep();
    const [index, place] = mark.dataset.grip.split(".").map(Number);
    dragged = { item: items[index], place, from: null };
  } else {
    const point = pointed(event);
    if (point[1] < lowest(tool) - 0.5) return;
    const item = add(tool, point);
    // A drag from here on gives an obstacle its size: by the rim of a disc, by the other end of the others. A line of the
    // stem is drawn by it.
    if (item) dragged = { item, place: tool === "disc" ? 1 : isThing(tool) ? 2 : 0, from: point };
  }
  $("#plane").setPointerCapture(event.pointerId);
  event.preventDefault();
  drawn();
});
$("#plane").addEventListener("pointermove", (event) => {
  if (!dragged) return;
  const { item, place, from } = dragged;
  const to = pointed(event);
  if (from && item.kind === "node") return stroke(from, event);
  // A tap that trembles leaves a new obstacle as large as it is.
  if (from && isObstacle(item) && Math.hypot(to[0] - from[0], to[1] - from[1]) < 1) return;
  dragged.from = null;
  handles(item)[place].move(to);
  bound(item);
  drawn();
});
/** A line that is drawn by hand, in place of the one there was: a point for every 1.5 cm of height. @param {Pair} from @param {PointerEvent} event */
function stroke(from, event) {
  const box = $("#plane svg").getBoundingClientRect();
  const x = (((event.clientX - box.left) / box.width) * W - ROOT) / U;
  const [, y] = pointed(event);
  if (!isStroke) {
    if (Math.hypot(x - from[0], y - from[1]) < 1) return;
    isStroke = true;
    items = [...items.filter(({ kind }) => kind !== "node"), node([...from])];
    bound(items[items.length - 1]);
  }
  const isNear = items.some((item) => item.kind === "node" && Math.abs(item.points[0][1] - y) < 1.5);
  if (isNear || y < LOW || y > HIGH) return;
  const item = node([Math.round(10 * x) / 10, y]);
  items.push(item);
  bound(item);
  drawn();
}
let isStroke = false;
for (const name of ["pointerup", "pointercancel"]) {
  $("#plane").addEventListener(name, () => {
    dragged = null;
    isStroke = false;
  });
}
$("#plane").addEventListener("keydown", (event) => {
  const grip = event.target.dataset?.grip;
  const by = { ArrowLeft: [-0.5, 0], ArrowRight: [0.5, 0], ArrowUp: [0, 0.5], ArrowDown: [0, -0.5] }[event.key];
  if (grip === undefined || phase !== "draw") return;
  const [index, place] = grip.split(".").map(Number);
  const item = items[index];
  if (by) {
    event.preventDefault();
    keep();
    const { at: from, move } = handles(item)[place];
    move([from[0] + by[0], from[1] + by[1]]);
    bound(item);
    drawn();
    const { at: to } = handles(item)[place];
    $("#live").textContent =
      `${num(to[0], 1)}, ${num(to[1], 1)} cm${item.kind === "disc" ? `, radius ${num(item.radius, 1)} cm` : ""}, ${word(item).text}`;
  } else if (event.key === "Delete" || event.key === "Backspace") {
    remove(index);
    $("#live").textContent = "Removed.";
  }
});
/** Adds a thing of a kind at a point, if there is room. @param {Item["kind"]} kind @param {Pair} point */
function add(kind, point) {
  const isAlike = isThing(kind) ? isObstacle : (item) => item.kind === kind;
  const most = kind === "node" ? MOST_NODES : MOST;
  if (items.filter(isAlike).length >= most) {
    toast(`${most} ${{ target: "targets", way: "way points", node: "points" }[kind] ?? "obstacles"} are the most.`);
    return null;
  }
  keep();
  if (isOne(kind)) items = items.filter((item) => item.kind !== kind);
  const [x, y] = point;
  /** @type {Item} */
  const item = { kind, points: [point], radius: kind === "disc" ? 1 : 0 };
  if (kind === "box") item.points.push([x + 2, y + 1]);
  if (kind === "line") item.points.push([x + 3, y]);
  items.push(item);
  bound(item);
  return item;
}
/** @param {number} index */
function remove(index) {
  keep();
  items.splice(index, 1);
  drawn();
}
$("#add").onclick = () => {
  const highest = Math.max(4, ...items.filter(({ kind }) => kind === tool).map(({ points: [[, y]] }) => y));
  const at = snapped(Math.min(HIGH, highest + (isThing(tool) ? 3 : 2)));
  add(tool, isThing(tool) ? [3, at] : isOne(tool) ? [2, 7] : [0, at]);
  drawn();
};
$("#tool").onclick = (event) => {
  const button = event.target.closest("[data-tool]");
  if (!button) return;
  use(button.dataset.tool);
};
/** @param {Item["kind"]} next */
function use(next) {
  tool = next;
  for (const button of $$("[data-tool]")) button.setAttribute("aria-pressed", String(button.dataset.tool === next));
  const name = KINDS[next].name.toLowerCase();
  $("#add").textContent = `Add ${/^[aeiou]/.test(name) ? "an" : "a"} ${name}`;
}
/** @param {"targets" | "form"} next */
function setMode(next) {
  if (next !== mode) {
    [items, aside] = [aside, items];
    mode = next;
  }
  const isForm = mode === "form";
  reach = isForm ? known.stems : known.tips;
  for (const button of $$("[data-mode]")) button.setAttribute("aria-pressed", String(button.dataset.mode === mode));
  for (const button of $$("[data-tool]")) button.hidden = ["node", "apex", "inflection"].includes(button.dataset.tool) !== isForm;
  $("#list-name").textContent = isForm ? "Line of the stem" : "Targets";
  $("#others").setAttribute("aria-label", isForm ? "Apex and inflection" : "Way points and obstacles");
  $("#form-numbers").hidden = !isForm;
  $("#hint").textContent = isForm
    ? "Draw the line that the stem is to have, from the root upwards, or touch the plane for single points and drag them. It counts when the tip is as high as the line’s end."
    : "Touch the plane to place what is chosen above, drag it to move it. The tip is to pass the targets from the lowest to the highest, and the stem must touch no obstacle; way points are to steer by.";
  use(isForm ? "node" : "target");
}
$("#mode").onclick = (event) => {
  const button = event.target.closest("[data-mode]");
  if (!button || button.dataset.mode === mode) return;
  keep();
  setMode(button.dataset.mode);
  $("#name").value = free();
  drawn();
};
for (const field of $$("[data-number]")) {
  field.onchange = () => {
    const value = field.value === "" ? null : Number(field.value);
    if (value !== null && !Number.isFinite(value)) return;
    keep();
    numbers[/** @type {"lean_deg"} */ (field.dataset.number)] = value;
    drawn();
  };
}
$("#undo").onclick = () => {
  const before = past.pop();
  if (!before) return toast("Nothing to undo.");
  const then = JSON.parse(before);
  setMode(then.mode);
  ({ items, numbers } = then);
  drawn();
};

/** A number of a thing: a coordinate, or the radius. @param {Item} item @param {number | string} key */
const valueOf = ({ points, radius }, key) => (key === "radius" ? radius : points.flat()[Number(key)]);

/**
 * Shows a list of things with their fields. Where only numbers change, the fields stay: who types goes on in the next one.
 * @param {any} place @param {Item[]} list @param {(item: Item) => any} row @param {any} none
 */
function rows(place, list, row, none) {
  const form = list.map((item) => `${items.indexOf(item)} ${item.kind}`).join();
  if (place.form !== form) {
    place.form = form;
    place.shown = undefined;
    put(place, list.length ? list.map(row) : none);
    return;
  }
  for (const field of $$("input", place)) {
    const value = String(valueOf(items[Number(field.dataset.index)], field.dataset.key));
    if (field.value !== value) field.value = value;
  }
  $$(".say", place).forEach((say, index) => {
    const { isFar, text } = word(list[index]);
    say.textContent = text;
    say.classList.toggle("out", isFar);
  });
}

let timer = 0;
/** What follows from a change of the drawing. */
function drawn() {
  draw();
  const field = (index, key, name, label, value) =>
    html`<label class="field"
      ><span>${name} (cm)</span
      ><input
        type="number"
        step="0.5"
        inputmode="decimal"
        value="${value}"
        data-index="${index}"
        data-key="${key}"
        aria-label="${label}, ${name}"
    /></label>`;
  const row = (/** @type {Item} */ item) => {
    const { isFar, text } = word(item);
    const index = items.indexOf(item);
    const label = nameOf(item);
    const names = KINDS[item.kind].points;
    const fields = names.map((name, key) => field(index, key, name, label, valueOf(item, key)));
    if (item.kind === "disc") fields.push(field(index, "radius", "radius", label, item.radius));
    return html`<div class="target-row ${{ target: "", node: "", disc: "named three" }[item.kind] ?? "named"}">
      <span class="mark">${item.kind === "target" || item.kind === "node" ? sorted(item.kind).indexOf(item) + 1 : label}</span>${fields}
      <button class="btn quiet square" type="button" data-remove="${index}" aria-label="Remove ${label.toLowerCase()}">
        ${icon("bin")}
      </button>
      <span class="say ${isFar ? "out" : ""}">${text}</span>
    </div>`;
  };
  const isForm = mode === "form";
  const all = isForm ? sorted("node") : targets();
  rows($("#targets"), all, row, html`<p class="soft">${isForm ? "No line: the stem is to follow none." : "No target yet."}</p>`);
  const others = isForm ? items.filter(({ kind }) => isOne(kind)) : [...sorted("way"), ...items.filter(isObstacle)];
  $("#others").hidden = others.length === 0;
  rows($("#others"), others, row, "");
  for (const field of $$("[data-number]")) field.value = String(numbers[/** @type {"lean_deg"} */ (field.dataset.number)] ?? "");
  tell();
  $("#evolve").disabled = $("#tune").disabled = !hasGoal();
  clearTimeout(timer);
  timer = setTimeout(async () => {
    if (!hasGoal()) return;
    const found = await get("api/task", { drawing: text() }).catch((error) => ({ task: wordOf(error), best: 0 }));
    $("#task").textContent = found.task;
    best = found.best;
    tell();
  }, 300);
}
/** Whether there is anything to do for a plant. */
const hasGoal = () =>
  mode === "form" ? items.length > 0 || numbers.radius_cm !== null || numbers.lean_deg !== null : targets().length > 0;
/** Says what can be reached at best. */
function tell() {
  if (mode === "form") {
    const far = items.filter((item) => word(item).isFar).length;
    const isSteep = Math.abs(numbers.lean_deg ?? 0) > steepest;
    const isBlind = hasGoal() && !items.some(({ kind }) => kind === "node" || kind === "apex");
    $("#possible").textContent = hasGoal()
      ? `An upright seedling differs from this form by ${num(best, 1)} cm, and as much is the best possible fitness.${far ? ` ${plural(far, "point")} out of reach.` : ""}${isSteep ? ` No bean here leans by more than ${steepest}°.` : ""}${isBlind ? " The greedy rule and tuned rules steer along a line or to an apex, and here is neither: evolve a network." : ""}`
      : "Draw a line, or say what the bow of the stem is to be.";
    return;
  }
  const far = targets().filter((item) => word(item).isFar).length;
  const touching = items.some((item) => isObstacle(item) && word(item).isFar);
  $("#possible").textContent = targets().length
    ? `Best possible fitness ${num(best, 1)}.${far ? ` ${plural(far, "target")} out of reach: the last centimetres will be missing.` : ""}${touching ? " The seedling touches an obstacle: no plant can do this task." : ""}`
    : "";
}
for (const id of ["#targets", "#others"]) {
  $(id).addEventListener("change", (event) => {
    const { index, key } = event.target.dataset;
    const value = Number(event.target.value);
    if (index === undefined || !Number.isFinite(value)) return;
    keep();
    const item = items[Number(index)];
    if (key === "radius") item.radius = Math.min(6, Math.max(0.1, value));
    else item.points[Math.floor(Number(key) / 2)][Number(key) % 2] = value;
    bound(item);
    drawn();
  });
  $(id).addEventListener("click", (event) => {
    const button = event.target.closest("[data-remove]");
    if (!button) return;
    remove(Number(button.dataset.remove));
    $("#add").focus();
  });
}

// Phases.
/** @param {"draw" | "evolve" | "try"} to */
function enter(to) {
  phase = to;
  for (const name of ["draw", "evolve", "try"]) $(`#p-${name}`).hidden = name !== to;
  $("#hint").hidden = $("#mode").hidden = $("#tool").hidden = to !== "draw";
  $("#steer").hidden = to !== "try" || who !== "you";
  isPlaying = false;
  const now = ["draw", "evolve", "try"].indexOf(to);
  $$("#flow li").forEach((item, index) => {
    item.classList.toggle("done", index < now);
    if (index === now) item.setAttribute("aria-current", "step");
    else item.removeAttribute("aria-current");
  });
  $("#live").textContent = { draw: "Draw targets.", evolve: "Evolving.", try: "A bean to try it on." }[to];
  if (to === "try") {
    trials = {};
    steer(at ? "champion" : "greedy");
  } else {
    draw();
  }
}

// Evolve.
/** A name that is not taken. */
const free = () => `${mode === "form" ? "form" : "targets"}-${new Date().toISOString().slice(0, 19).replace(/[-:]/g, "").replace("T", "-")}`;
$("#name").value = free();
/** Asks for an evolution, or for a rule. @param {"evolve" | "tune"} method */
async function make(method) {
  $("#evolve").disabled = $("#tune").disabled = true;
  try {
    const request = {
      name: $("#name").value.trim(),
      drawing: drawing(),
      method,
      runs: Number($("#runs").value),
      generations: Number($(method === "tune" ? "#rule-generations" : "#generations").value),
      seed: Number($("#seed").value),
      model: $("#model").value || null,
    };
    const found = await post("api/draw/evolve", request);
    at = found.at;
    put($("#commands"), found.commands.map(command));
    $("#name").value = free();
    evolution = undefined;
    searched.length = 0;
    $("#p-evolve h2").textContent = method === "tune" ? "Tuning a rule" : "Evolving";
    $("#whole").href = pageOf(method === "tune" ? "rule" : "evolution", at);
    $("#early").hidden = method === "tune";
    $("#generation").textContent = "";
    $("#evolving").textContent = "Waits for its turn in the queue. The page may be closed.";
    enter("evolve");
    curve();
    if (method === "tune") search();
    else follow();
  } catch (error) {
    say(error);
  }
  $("#evolve").disabled = $("#tune").disabled = false;
}
$("#evolve").onclick = () => make("evolve");
$("#tune").onclick = () => make("tune");

/** Generations of a search for a rule, and the best of each, as they were heard of. @type {[number, number][]} */
const searched = [];
let searches = 0;

/** Says how long a job waits, or why it failed; whether it may still come. @param {string} own @param {any} queue */
function waits(own, queue) {
  const job = queue?.findLast((one) => one.at === own);
  if (job?.state === "failed") {
    $("#evolving").textContent = `It failed: ${job.problem}`;
    return false;
  }
  const before = queue?.filter((one) => one.state === "waiting" || one.state === "running").findIndex((one) => one.at === own);
  $("#evolving").textContent =
    before > 0
      ? `Waits for ${plural(before, "other job")}. The page may be closed.`
      : "Makes the model of virtual beans first: some seconds.";
  return true;
}

/** Waits for a rule, and says how far its search is. */
async function search() {
  const own = at;
  for (; at === own && phase === "evolve"; await new Promise((done) => setTimeout(done, 500))) {
    const found = await get("api/work", { at: own }).catch(() => null);
    if (at !== own || phase !== "evolve") return;
    if (!found) {
      const { queue } = await get("api/items").catch(() => ({ queue: [] }));
      if (!waits(own, queue)) return;
    } else if (found.status.is_over) {
      enter("try");
      return play(true);
    } else {
      const { generation, generations, best_fitness: top } = found.status;
      searches = generations;
      $("#generation").textContent = `generation ${generation} of ${generations}`;
      $("#evolving").textContent = "The mean of the best rule of each generation. The page may be closed.";
      if (generation > (searched.at(-1)?.[0] ?? 0)) searched.push([generation, top]);
      curve();
    }
  }
}

/** Waits until the evolution is there, then listens to it. */
async function follow() {
  const own = at;
  for (;;) {
    const found = await get("api/evolution", { at: own }).catch(() => null);
    if (at !== own || phase !== "evolve") return;
    if (found) break;
    const { queue } = await get("api/items").catch(() => ({ queue: [] }));
    if (!waits(own, queue)) return;
    await new Promise((done) => setTimeout(done, 500));
  }
  listen(`api/evolution/events?${new URLSearchParams({ at: own })}`, "evolution", (found) => {
    if (at !== own) return;
    evolution = found;
    $("#generation").textContent =
      `generation ${Math.floor(found.done / Math.max(1, found.best.length))} of ${found.generations}`;
    $("#evolving").textContent =
      found.state === "over" ? "Done." : `${found.rate ? `${found.rate} evaluations a second. ` : ""}The page may be closed.`;
    curve();
    if (found.state === "over" && phase === "evolve") {
      enter("try");
      play(true);
    }
  });
}
const curve = fit($("#curve"), (width) => {
  const marks = evolution?.marks ?? searched.map(([generation]) => generation);
  const top = evolution?.top ?? searched.map(([, value]) => value);
  const median = evolution?.median ?? [];
  if (!marks.length) return "";
  const generations = evolution?.generations ?? searches;
  const low = Math.min(0, ...median, ...(evolution ? [] : top));
  return plot({
    w: width,
    h: 190,
    x: [0, generations],
    y: [Math.max(-2 * best, low), Math.max(best, ...top) * 1.08],
    xl: "generation",
    yl: "best",
    label: `Best fitness so far ${num(top.at(-1))} of ${num(best, 1)}`,
    body: (x, y) =>
      `<path class="dotted" d="M${x(0)} ${y(best)}H${x(generations)}"/><path class="stroke thin quiet" d="${line(marks, median, x, y)}"/><path class="stroke bold best" d="${line(marks, top, x, y)}"/>`,
  });
});
$("#early").onclick = () => enter("try");
$("#redraw").onclick = () => enter("draw");

// Try.
const SAYS = {
  champion: "The network that evolved, which sees only where the tip is; or the rule that was tuned.",
  greedy: "Lights the lamp on the side of the next target, or of the next point of the line: the rule that a person would write by hand.",
  you: "You light the lamps: buttons, or the left and right arrow keys. Light early: the bean answers late.",
};
/** @param {"champion" | "greedy" | "you"} next */
async function steer(next) {
  who = next;
  for (const button of $$("[data-who]")) button.setAttribute("aria-pressed", String(button.dataset.who === next));
  $("#who-says").textContent = SAYS[next];
  $("#steer").hidden = next !== "you";
  await ready();
}
/** The trial of whoever steers: the bean of this seed from its start. */
async function ready() {
  const own = who;
  if (!trials[own]) {
    try {
      const found = await get("api/try", {
        who: own,
        drawing: text(),
        at: own === "champion" ? at : null,
        seed,
        lights: own === "you" ? "" : null,
      });
      trials[own] ??= {
        frames: found.frames,
        fitness: found.fitness,
        crossings: found.crossings,
        isOver: found.is_over,
        at: 0,
        lights: "",
      };
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
  $("#goal").textContent = isForm ? "Off the form" : "Targets";
  const row = (name, title) => {
    const trial = trials[name];
    const passed = trial ? trial.crossings.filter((one) => one && one.step <= trial.at).length : 0;
    const value = trial && trial.at > 0 ? num(trial.fitness[trial.at] ?? 0, 1) : "–";
    return html`<tr class="${name === who ? "now" : ""}">
      <th scope="row">${title}</th>
      <td class="n">${isForm ? off(trial) : `${passed} of ${targets().length}`}</td>
      ${hasObstacles ? html`<td class="n">${trial ? touched(trial) : "–"}</td>` : ""}
      <td class="n">${value}${name === who ? html` <span class="soft">of ${num(best, 1)}</span>` : ""}</td>
    </tr>`;
  };
  put($("#score"), [row("champion", "Champion"), row("greedy", "Greedy"), row("you", "You")]);
  const trial = trials[who];
  const step = trial?.at ?? 0;
  const frame = trial?.frames[step];
  const isEnd = trial && isDone(trial);
  const says =
    !frame || step === 0
      ? "the bean is 4 cm high"
      : isEnd
        ? "the end"
        : `${frame.lamp ?? "no"} lamp, tip ${num(frame.x, 1)}, ${num(frame.y, 1)} cm${frame.touches ? ", touches an obstacle" : ""}`;
  put($("#hour"), html`<b>${Math.floor(step / 12)} h ${String((step % 12) * 5).padStart(2, "0")}</b> ${says}`);
  put($("#play"), isPlaying ? html`${icon("pause")}Pause` : html`${icon("play")}${isEnd ? "Again" : "Play"}`);
  $("#left").setAttribute("aria-pressed", String(yours === "l"));
  $("#right").setAttribute("aria-pressed", String(yours === "r"));
}
/** How far the stem is from the form. @param {Trial | undefined} trial */
function off(trial) {
  const value = trial?.frames[trial.at]?.off;
  return value === undefined ? "–" : `${num(value, 1)} cm`;
}
/** Steps so far at which the stem touched an obstacle. @param {Trial} trial */
const touched = (trial) => trial.frames.slice(0, trial.at + 1).filter((one) => one.touches).length;
/** @param {Trial} trial */
const isDone = (trial) => trial.at >= trial.frames.length - 1 && (who !== "you" || trial.isOver || trial.lights.length >= 1000);

/** @param {boolean} is */
async function play(is) {
  const trial = trials[who];
  if (is && trial && isDone(trial)) trials[who] = undefined;
  isPlaying = is;
  await ready();
}
$("#play").onclick = () => play(!isPlaying);
$("#again").onclick = () => {
  trials[who] = undefined;
  ready();
};
$("#other").onclick = () => {
  seed += 1;
  trials = {};
  play(true);
};
$("#who").onclick = (event) => {
  const button = event.target.closest("[data-who]");
  if (!button) return;
  if (button.dataset.who === "champion" && !at) return toast("Evolve first: there is no champion yet.");
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
  yours = letter;
  if (!isPlaying) play(true);
  scores();
};
$("#left").onclick = () => light("l");
$("#right").onclick = () => light("r");
$("#right").insertAdjacentHTML("beforeend", icon("right").text);
addEventListener("keydown", (event) => {
  if (phase !== "try" || who !== "you" || /** @type {Element} */ (event.target).matches("input,select")) return;
  if (event.key === "ArrowLeft") light("l");
  if (event.key === "ArrowRight") light("r");
});

let last = 0;
let debt = 0;
let isAsking = false;
/** Gives the bean of a person the light of the next steps. @param {Trial} trial @param {number} steps */
async function grow(trial, steps) {
  isAsking = true;
  const lights = trial.lights + yours.repeat(steps);
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
  const seconds = Math.min(0.1, (time - last) / 1000);
  last = time;
  const trial = trials[who];
  if (isPlaying && phase === "try" && trial) {
    debt += seconds * speed;
    if (
      who === "you" &&
      !isAsking &&
      !trial.isOver &&
      trial.lights.length < 1000 &&
      trial.frames.length - 1 - trial.at < speed / 5
    )
      grow(trial, Math.max(2, Math.round(speed / 8)));
    const steps = Math.min(Math.floor(debt), trial.frames.length - 1 - trial.at);
    debt = Math.min(1, debt - steps);
    if (steps > 0) trial.at += steps;
    if (isDone(trial) && !isAsking) isPlaying = false;
    if (steps > 0 || !isPlaying) {
      draw();
      scores();
    }
  }
  requestAnimationFrame(frame);
}
requestAnimationFrame(frame);

// Save.
$("#save").onclick = async () => {
  try {
    const name = $("#name").value.trim();
    const found = await post("api/draw/save", { name, drawing: drawing() });
    put($("#commands"), found.commands.map(command));
    toast(`${found.file} is written.`);
  } catch (error) {
    say(error);
  }
};

setMode(mode);
const given = asked.get("drawing");
if (given) {
  try {
    take(JSON.parse(given));
  } catch {
    // The paper's targets stand in.
  }
}

session.then(async ({ session: own }) => {
  if (!own) return;
  drawn();
  listen("api/events", "items", () => {});
  get("api/items").then(({ items: all }) => {
    const runs = all.filter((item) => item.kind === "run" && item.photo_name);
    put($("#backdrop"), [
      html`<option value="">no run</option>`,
      runs.map((run) => html`<option value="${run.at}">${run.name}</option>`),
    ]);
  }, say);
  get("api/models").then(
    ({ models }) =>
      put($("#model"), [html`<option value="">of virtual beans</option>`, models.map((name) => html`<option>${name}</option>`)]),
    say,
  );
  if (at) enter("try");
  else enter("draw");
  const found = await get("api/reach").catch(() => null);
  if (!found) return;
  [known, steepest] = [found, found.lean_deg];
  reach = mode === "form" ? known.stems : known.tips;
  drawn();
});
new ResizeObserver(draw).observe($("#plane"));
