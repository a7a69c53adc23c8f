// A run as its page knows it: steps and events as they were heard, and the step that is looked at.
// @ts-check
import { asked, moment, num } from "./studio.js";

/** The place of the run below the folder of the studio. */
export const at = asked.get("at") ?? "";

/**
 * @typedef {import("./types.d.ts").ShownStatus} Status
 * @typedef {import("./types.d.ts").RunNow} RunNow
 */

/** A step, from a row that the server sends. @param {import("./types.d.ts").Row} row */
export const step = ([number, hours, x, y, length, lamp, confirmed, isCarried, status, confidence, unix, photo, px, py, v, steered]) => ({
  number,
  hours,
  x,
  y,
  length,
  lamp,
  isConfirmed: Boolean(confirmed),
  isCarriedForward: Boolean(isCarried),
  status,
  confidence,
  unix,
  photo,
  px,
  py,
  v,
  isNight: steered === 0,
});

export const run = {
  /** @type {ReturnType<typeof step>[]} */
  steps: [],
  /** @type {import("./types.d.ts").ShownEvent[]} */
  events: [],
  /** Nothing before anything was heard. @type {Partial<Omit<Status, "state">> & { state?: RunNow["state"] }} */
  status: {},
  /** What does not change; nothing before it is known. @type {Partial<import("./types.d.ts").AboutRun>} */
  about: {},
  /** What is expected. @type {import("./types.d.ts").Prediction | undefined} */
  prediction: undefined,
  /** Place of the step that is looked at; the latest one if it is `null`. @type {number | null} */
  shown: null,
  /** Place of the step under the pointer. @type {number | null} */
  pointed: null,
  isLost: false,
  /** Seconds since anything was heard. */
  lostFor: 0,
};

export const isOn = () => run.status.state === "live" || run.status.state === "overdue";
export const place = () => run.shown ?? run.steps.length - 1;
/** The step that is looked at. */
export const stepShown = () => run.steps[place()];
export const lampNow = () => run.steps.findLast((one) => one.lamp)?.lamp ?? null;
/** When a step was. @param {ReturnType<typeof step>} one */
export const when = (one) => (one.unix ? moment(one.unix) : `${num(one.hours, 1)} h`);

/** What draws again when another step is looked at, or lies under the pointer. @type {(() => void)[]} */
export const onLook = [];
/** Looks at a step; at the latest one, and those that follow, if it is `null`. @param {number | null} to */
export function look(to) {
  run.shown = to === null || to >= run.steps.length - 1 ? null : Math.max(0, to);
  onLook.forEach((draw) => draw());
}
/** @type {(() => void)[]} */
export const onPoint = [];
/** @param {number | null} to */
export function point(to) {
  if (to === run.pointed) return;
  run.pointed = to;
  onPoint.forEach((draw) => draw());
}

/**
 * Lets a drawing name the step under a pointer or a finger, and look at it on a click.
 * @param {HTMLElement} drawing @param {(event: PointerEvent | MouseEvent) => number | null} stepAt
 */
export function answerPointer(drawing, stepAt) {
  drawing.addEventListener("pointermove", (event) => point(stepAt(event)));
  drawing.addEventListener("pointerleave", () => point(null));
  drawing.addEventListener("click", (event) => {
    const at = stepAt(event);
    if (at !== null) look(at);
  });
}
