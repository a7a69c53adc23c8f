// What is drawn: targets, way points and obstacles, or a form of the stem; and what there is to say of it.
// @ts-check
import { num, toast } from "./studio.js";
import { STEM_CM, distance, outline } from "./obstacle.js";

/** @typedef {import("./types.d.ts").Point} Pair */
/**
 * Something that is drawn: a target or a way point has one point, a disc its centre and a radius, a box two corners, a line
 * two ends. Of a form of the stem: a node of its line, the apex of its bow, its inflection, each a point. A further kind has
 * its place here and in `KINDS`.
 * @typedef {{ kind: "target" | "way" | "disc" | "box" | "line" | "node" | "apex" | "inflection", points: Pair[], radius: number }} Item
 */

const MOST = 8;
/** Of a line, at most. */
const MOST_NODES = 20;

export const KINDS = {
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
const SIDE = 9.5;
export const [LOW, HIGH] = [0.5, 17];

/** @param {Pair} point @returns {Item} */
const target = (point) => ({ kind: "target", points: [point], radius: 0 });
export const node = (/** @type {Pair} */ point) => /** @type {Item} */ ({ kind: "node", points: [point], radius: 0 });
/** Whether targets are drawn, or a form of the stem. @type {"targets" | "form"} */
export let mode = "targets";
/** What is drawn, and what was drawn in the other mode. @type {Item[]} */
export let items = [target([3, 6]), target([-5, 9]), target([-1, 13.5])];
/** @type {Item[]} */
let aside = [node([0.5, 3]), node([2, 6]), node([2.5, 9]), node([1, 12])];
/** What is wanted of a form in numbers; `null` for what is not. @type {Record<"radius_cm" | "lean_deg" | "within_cm" | "end_height_cm", number | null>} */
export let numbers = { radius_cm: null, lean_deg: null, within_cm: null, end_height_cm: null };
/** The best fitness that there can be, as the server says. */
export let best = 0;
/** How far to the side tips and stems get by height. @type {Record<"tips" | "stems", [number, number][]>} */
let known = { tips: [], stems: [] };
/** That of what is drawn. @type {[number, number][]} */
export let reach = [];
/** The steepest lean of a stem, in degrees. */
export let steepest = 90;
/** What was drawn before, and what was taken back. @type {string[]} */
const past = [];
/** @type {string[]} */
const future = [];

/** The drawing as the server reads it. @returns {import("./types.d.ts").AskedDrawing} */
export function drawing() {
  const points = (/** @type {string} */ kind) => sorted(kind).map((item) => item.points[0]);
  const obstacles = items.filter(isObstacle).map(obstacleOf);
  if (mode === "targets") return { targets: points("target"), way_points: points("way"), obstacles };
  const [one] = points("apex");
  const [other] = points("inflection");
  return { form: { line: wanted(), apex: one ?? null, inflection: other ?? null, ...numbers } };
}
/** The line that the stem is to follow, from the root; empty for none. @returns {Pair[]} */
export function wanted() {
  const nodes = sorted("node").map((item) => item.points[0]);
  return nodes.length ? [[0, 0], ...nodes] : [];
}
/** @param {import("./types.d.ts").AskedDrawing} drawn */
export function take(drawn) {
  const point = (/** @type {Item["kind"]} */ kind) => (/** @type {Pair} */ pair) => ({ kind, points: [pair], radius: 0 });
  /** @param {import("./obstacle.js").Obstacle} obstacle @returns {Item} */
  const obstacle = ({ disc, radius_cm: radius, box, line }) =>
    disc ? { kind: "disc", points: [disc], radius } : { kind: box ? "box" : "line", points: box ?? line, radius: 0 };
  if (drawn.form) {
    const { line: nodes, apex, inflection, ...rest } = drawn.form;
    // The root is part of every line.
    const [first, ...others] = nodes ?? [];
    const root = first && first[0] === 0 && first[1] === 0;
    turnTo("form");
    items = [
      ...(root ? others : (nodes ?? [])).map(point("node")),
      ...[apex].filter(Boolean).map(point("apex")),
      ...[inflection].filter(Boolean).map(point("inflection")),
    ];
    numbers = { ...numbers, ...rest };
    return;
  }
  items = [
    ...(drawn.targets ?? []).map(point("target")),
    ...(drawn.way_points ?? []).map(point("way")),
    ...(drawn.obstacles ?? []).map(obstacle),
  ];
}
/** The points of a kind, from the lowest to the highest. @param {string} kind */
export function sorted(kind) {
  return items.filter((item) => item.kind === kind).sort((one, other) => one.points[0][1] - other.points[0][1]);
}
export const targets = () => sorted("target");
export const text = () => JSON.stringify(drawing());
/** @param {Item} item @returns {import("./obstacle.js").Obstacle} */
export const obstacleOf = ({ kind, points, radius }) =>
  kind === "disc" ? { disc: points[0], radius_cm: radius } : { [kind === "box" ? "box" : "line"]: [points[0], points[1]] };
export const isObstacle = (/** @type {Item} */ { kind }) => isThing(kind);
/** Whether something of a kind is larger than a point. @param {Item["kind"]} kind */
export const isThing = (kind) => kind === "disc" || kind === "box" || kind === "line";
/** How far to the side a tip gets by a height, in cm. @param {number} y */
function farthest(y) {
  const row = reach.findLast(([height]) => height <= y);
  return row ? row[1] : reach.length && y < reach[0][0] ? 0 : Infinity;
}
/** What there is to say of a thing that is drawn. @param {Item} item */
export function word(item) {
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
/** Whether a stem has one of a kind at most. @param {Item["kind"]} kind */
export const isOne = (kind) => kind === "apex" || kind === "inflection";
/** What a thing is called: targets by their order, the others by theirs. @param {Item} item */
export function nameOf(item) {
  if (isOne(item.kind)) return KINDS[item.kind].name;
  const same = isThing(item.kind) ? items.filter(({ kind }) => kind === item.kind) : sorted(item.kind);
  return `${KINDS[item.kind].name} ${same.indexOf(item) + 1}`;
}

/** Whether there is anything to do for a plant. */
export const hasGoal = () =>
  mode === "form" ? items.length > 0 || numbers.radius_cm !== null || numbers.lean_deg !== null : targets().length > 0;
/** A name that is not taken. */
export const free = () => `${mode === "form" ? "form" : "targets"}-${new Date().toISOString().slice(0, 19).replace(/[-:]/g, "").replace("T", "-")}`;

// How it changes.
const asText = () => JSON.stringify({ mode, items, numbers });
export const keep = () => {
  past.push(asText());
  past.splice(0, past.length - 50);
  future.length = 0;
};
export const snapped = (/** @type {number} */ value) => Math.round(value * 2) / 2;
/** How low a thing of a kind may stand, in cm. @param {Item["kind"]} kind */
export const lowest = (kind) => (kind === "target" || kind === "way" ? 4.5 : LOW);
/** @param {Item} item */
export function bound(item) {
  const low = lowest(item.kind);
  item.points = item.points.map(([x, y]) => [Math.min(SIDE, Math.max(-SIDE, x)), Math.min(HIGH, Math.max(low, y))]);
  if (item.points.length === 2 && String(item.points[0]) === String(item.points[1])) item.points[1][0] += item.points[1][0] < SIDE ? 0.5 : -0.5;
  if (isObstacle(item) || isOne(item.kind)) return;
  // Two at one height cannot be told apart.
  const [point] = item.points;
  const isTaken = () => items.some((other) => other !== item && other.kind === item.kind && other.points[0][1] === point[1]);
  for (let tries = 0; isTaken() && tries < 2 * MOST; tries++) point[1] += point[1] >= HIGH - 0.5 ? -0.5 : 0.5;
}
/** Adds a thing of a kind at a point, if there is room. @param {Item["kind"]} kind @param {Pair} point */
export function add(kind, point) {
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
/** Removes a thing. @param {number} index */
export function removeAt(index) {
  keep();
  items.splice(index, 1);
}
/** Begins the line of a stem anew, at a point. @param {Pair} from */
export function beginLine(from) {
  items = [...items.filter(({ kind }) => kind !== "node"), node([...from])];
  bound(items[items.length - 1]);
}
/** Turns to what is drawn in a mode. @param {"targets" | "form"} next */
export function turnTo(next) {
  if (next !== mode) {
    [items, aside] = [aside, items];
    mode = next;
  }
  reach = mode === "form" ? known.stems : known.tips;
}
/** Takes back the last change; false if there is none. */
export const undo = () => turnBack(past, future);
/** Does again what was taken back last; false if there is nothing. */
export const redo = () => turnBack(future, past);
/** @param {string[]} from @param {string[]} to */
function turnBack(from, to) {
  const text = from.pop();
  if (!text) return false;
  to.push(asText());
  const then = JSON.parse(text);
  turnTo(then.mode);
  ({ items, numbers } = then);
  return true;
}
/** Takes what the server knows of how far beans get. @param {import("./types.d.ts").ToldReach} found */
export function learn(found) {
  [known, steepest] = [found, found.lean_deg];
  turnTo(mode);
}
/** @param {number} fitness */
export function setBest(fitness) {
  best = fitness;
}

/**
 * What a thing is held by: where, what it is called, and what moves with it.
 * @param {Item} item @returns {{ at: Pair, name: string, move: (to: Pair) => void, isWhole: boolean }[]}
 */
export function handles(item) {
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
