// Figures: SVG in the pixels at hand, drawn again when the width changes.
// @ts-check
import { escaped, lampClass } from "./studio.js";

/** @param {number} value */
const tenth = (value) => (Math.round(value * 10) / 10).toString();
/** @param {number} value */
const label = (value) => String(Math.round(value * 1000) / 1000).replace("-", "−");

/** Round numbers from `from` to `to`, some `count` of them. @param {number} from @param {number} to @param {number} [count] */
export function ticks(from, to, count = 5) {
  const raw = Math.max(1e-9, (to - from) / count);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= raw) ?? raw;
  const all = [];
  for (let value = Math.ceil(from / step - 1e-9) * step; value <= to + step * 1e-6; value += step) all.push(value);
  return all;
}

/** Stands where a figure comes when its numbers are known. */
export const WAITS = '<div class="skeleton block"></div>';

/**
 * @typedef {(value: number) => number} Scale
 * @typedef {{ w: number, h: number, x: [number, number], y: [number, number], xt?: number[], yt?: number[], xl?: string, yl?: string,
 *   m?: { l: number, r: number, t: number, b: number }, body: (X: Scale, Y: Scale) => string, label: string }} Plot
 */

/** @param {Plot} plot */
export function plot({ w, h, x, y, xt, yt, xl, yl, m = { l: 44, r: 12, t: 10, b: 40 }, body, label: sentence }) {
  const X = (/** @type {number} */ value) => m.l + ((value - x[0]) / (x[1] - x[0])) * (w - m.l - m.r);
  const Y = (/** @type {number} */ value) => h - m.b - ((value - y[0]) / (y[1] - y[0])) * (h - m.t - m.b);
  const across = xt ?? ticks(x[0], x[1], w / 90);
  const up = yt ?? ticks(y[0], y[1], h / 60);
  const grid =
    across.map((value) => `M${tenth(X(value))} ${m.t}V${h - m.b}`).join("") +
    up.map((value) => `M${m.l} ${tenth(Y(value))}H${w - m.r}`).join("");
  const below = across.map(
    (value) => `<text x="${tenth(X(value))}" y="${h - m.b + 16}" text-anchor="middle">${label(value)}</text>`,
  );
  const beside = up.map((value) => `<text x="${m.l - 7}" y="${tenth(Y(value) + 4)}" text-anchor="end">${label(value)}</text>`);
  const names =
    (xl ? `<text class="label" x="${(m.l + w - m.r) / 2}" y="${h - 4}" text-anchor="middle">${xl}</text>` : "") +
    (yl
      ? `<text class="label" text-anchor="middle" transform="translate(12 ${(m.t + h - m.b) / 2}) rotate(-90)">${yl}</text>`
      : "");
  return `<svg class="figure" viewBox="0 0 ${w} ${h}" role="img" aria-label="${escaped(sentence)}"><path class="grid" d="${grid}"/>${body(X, Y)}<path class="axis" d="M${m.l} ${m.t}V${h - m.b}H${w - m.r}"/>${below.join("")}${beside.join("")}${names}</svg>`;
}

/** @param {number[]} xs @param {(number | null)[]} ys @param {Scale} X @param {Scale} Y */
export function line(xs, ys, X, Y) {
  let isDown = false;
  return ys
    .map((y, index) => {
      if (y === null || !Number.isFinite(y)) {
        isDown = false;
        return "";
      }
      const to = `${isDown ? "L" : "M"}${tenth(X(xs[index]))} ${tenth(Y(y))}`;
      isDown = true;
      return to;
    })
    .join("");
}

/** The line that a stem is to have. @param {[number, number][]} points @param {Scale} X @param {Scale} Y */
export function wantedLine(points, X, Y) {
  const d = line(
    points.map(([x]) => x),
    points.map(([, y]) => y),
    X,
    Y,
  );
  return d && `<path class="wanted" d="${d}"/><path class="wanted-line" d="${d}"/>`;
}

/** The area between two lines. @param {number[]} xs @param {number[]} low @param {number[]} high @param {Scale} X @param {Scale} Y */
export const band = (xs, low, high, X, Y) =>
  xs.length
    ? `<path class="band" d="${line(xs, high, X, Y)}${line([...xs].reverse(), [...low].reverse(), X, Y).replace("M", "L")}Z"/>`
    : "";

/** A target. @param {number} x @param {number} y @param {string | number} name @param {number} [r] */
export const cross = (x, y, name, r = 6) =>
  `<path class="cross" d="M${tenth(x - r)} ${tenth(y - r)}l${2 * r} ${2 * r}m0 ${-2 * r}l${-2 * r} ${2 * r}"/><text class="mark halo" x="${tenth(x)}" y="${tenth(y - r - 6)}" text-anchor="middle" font-size="13">${escaped(name)}</text>`;

/**
 * A path of a tip, in the colour of the lamp that is lit from each point on.
 * @param {{ x: number, y: number, lamp: string | null }[]} points @param {Scale} X @param {Scale} Y @param {string} [kind]
 */
export function lampPath(points, X, Y, kind = "bold") {
  /** @type {Record<string, string>} */
  const paths = {};
  let last = "";
  let [drawnX, drawnY] = [0, 0];
  points.slice(1).forEach((to, index) => {
    const from = points[index];
    const lamp = lampClass(from.lamp);
    const [x, y] = [X(to.x), Y(to.y)];
    paths[lamp] ??= "";
    if (lamp !== last) paths[lamp] += `M${tenth(X(from.x))} ${tenth(Y(from.y))}`;
    // What would be drawn within a pixel of the last point is left out, but where the line ends.
    const isEnd = index === points.length - 2 || lampClass(to.lamp) !== lamp;
    if (lamp !== last || isEnd || Math.abs(x - drawnX) + Math.abs(y - drawnY) > 1) {
      paths[lamp] += `L${tenth(x)} ${tenth(y)}`;
      [drawnX, drawnY] = [x, y];
    }
    last = lamp;
  });
  return Object.entries(paths)
    .map(([lamp, d]) => `<path class="stroke ${kind} ${lamp === "other" ? "quiet" : lamp}" d="${d}"/>`)
    .join("");
}

/** Narrower than its letters a figure is not drawn. */
const LEAST_PX = 80;

/**
 * Draws into `element` in its width, and again when that changes: letters keep their size. Returns what draws again.
 * @param {Element} element @param {(width: number) => string} draw
 */
export function fit(element, draw) {
  let width = 0;
  let waits = false;
  const go = () => {
    waits = false;
    width = Math.round(element.clientWidth);
    if (width > LEAST_PX) element.innerHTML = draw(width);
  };
  new ResizeObserver(() => {
    if (Math.round(element.clientWidth) !== width) go();
  }).observe(element);
  const again = () => {
    // Several changes within a frame are drawn once.
    if (!waits) requestAnimationFrame(go);
    waits = true;
  };
  again();
  return again;
}
