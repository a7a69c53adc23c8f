// The path of a run's tip among its targets.
// @ts-check
import { $, lampClass, num } from "./studio.js";
import { WAITS, cross, fit, lampPath, line, plot, wantedLine } from "./figure.js";
import { shape } from "./obstacle.js";
import { answerPointer, lampNow, run } from "./record.js";

/** Scales of the path, once it is drawn. @type {[(x: number) => number, (y: number) => number] | null} */
let onPath = null;
/** The step whose tip is ringed. @type {ReturnType<typeof import("./record.js").step> | undefined} */
let ringed;

/** The ring of a step's tip. @param {(x: number) => number} X @param {(y: number) => number} Y */
const ring = (X, Y) =>
  ringed && ringed.x !== null ? `<circle class="ring" id="on-path" cx="${X(ringed.x)}" cy="${Y(ringed.y)}" r="9"/>` : "";

/** How far beside each target the tip crossed its height. @param {(import("./types.d.ts").ShownCrossing | null)[]} crossings */
const besides = (crossings) =>
  crossings
    .map((crossed, index) => (crossed ? `${num(crossed.beside, 1)} cm beside target ${index + 1}` : `target ${index + 1} not yet`))
    .join(", ");

export const path = fit($("#path"), (width) => {
  if (!run.status.state) return WAITS;
  const targets = run.about.targets ?? [];
  const seen = run.steps.filter((one) => one.x !== null);
  const aim = run.about.line ?? [];
  const goals = [...targets, ...aim];
  const xs = [...seen.map((one) => one.x), ...goals.map((goal) => goal.x)];
  const ys = [...seen.map((one) => one.y), ...goals.map((goal) => goal.y)];
  const reach = Math.max(8, ...xs.map(Math.abs)) + 0.5;
  const low = Math.min(4, ...ys) - 0.3;
  const high = Math.max(low + 6, run.about.end_height ?? 0, ...ys) + 0.7;
  const height = Math.min(460, Math.max(240, (width * (high - low)) / (2 * reach)));
  const sentence = seen.length
    ? `Path of the tip, now at ${num(seen.at(-1).x, 1)}, ${num(seen.at(-1).y, 1)} cm${targets.length ? `; ${besides(run.status.crossings ?? [])}` : ""}.`
    : "No tip yet.";
  return plot({
    w: width,
    h: Math.round(height),
    x: [-reach, reach],
    y: [low, high],
    xl: "tip x (cm)",
    yl: "tip y (cm)",
    label: sentence,
    body: (X, Y) => {
      onPath = [X, Y];
      const heights = targets.map((target) => `<path class="dotted" d="M${X(-reach)} ${Y(target.y).toFixed(1)}H${X(reach)}"/>`);
      const fan = (run.prediction?.paths ?? []).map(
        (points) =>
          `<path class="fan" d="${line(
            points.map((p) => p[0]),
            points.map((p) => p[1]),
            X,
            Y,
          )}"/>`,
      );
      const last = seen.at(-1);
      const tip = last
        ? `<circle cx="${X(last.x).toFixed(1)}" cy="${Y(last.y).toFixed(1)}" r="6" class="tip ${lampClass(last.lamp ?? lampNow())}"/>`
        : "";
      const first = seen[0] ? `<circle class="start" cx="${X(seen[0].x)}" cy="${Y(seen[0].y)}" r="5"/>` : "";
      const form = wantedLine(
        aim.map((point) => [point.x, point.y]),
        X,
        Y,
      );
      const obstacles = (run.about.obstacles ?? []).map((obstacle) => shape(obstacle, X, Y));
      return (
        form +
        obstacles.join("") +
        heights.join("") +
        fan.join("") +
        lampPath(seen, X, Y) +
        first +
        tip +
        targets.map((target, index) => cross(X(target.x), Y(target.y), index + 1)).join("") +
        ring(X, Y)
      );
    },
  });
});

/**
 * Rings the tip of a step, or none, also when the path is drawn anew.
 * @param {typeof ringed} one
 */
export function markOnPath(one) {
  ringed = one;
  $("#on-path")?.remove();
  if (onPath) $("#path svg")?.insertAdjacentHTML("beforeend", ring(...onPath));
}

/** How far from the path a pointer or a finger may be, in pixels. */
const NEAR_PX = 30;
/** The place of the step whose tip is nearest on the path. @param {PointerEvent | MouseEvent} event */
function nearestOnPath(event) {
  const drawn = $("#path svg");
  if (!drawn || !onPath) return null;
  const { left, top } = drawn.getBoundingClientRect();
  const [X, Y] = onPath;
  /** @type {number | null} */
  let nearest = null;
  let least = NEAR_PX;
  run.steps.forEach((one, place) => {
    if (one.x === null) return;
    const apart = Math.hypot(X(one.x) - event.clientX + left, Y(one.y) - event.clientY + top);
    if (apart < least) [nearest, least] = [place, apart];
  });
  return nearest;
}
answerPointer($("#path"), nearestOnPath);
