// Obstacles as task files have them: how they are drawn, how far away they are, and what is drawn of a task.
// @ts-check

/**
 * @typedef {import("./types.d.ts").Point} Pair
 * @typedef {import("./types.d.ts").Obstacle} Obstacle
 * @typedef {(value: number) => number} Scale
 */

/** Radius of a stem, in cm, as tasks have it by default. */
export const STEM_CM = 0.15;

/** An obstacle as the shape of a figure. @param {Obstacle} obstacle @param {Scale} X @param {Scale} Y */
export function shape({ disc, radius_cm, box, line }, X, Y) {
  const to = (/** @type {number} */ value) => value.toFixed(1);
  if (disc && radius_cm) {
    // Ellipses, where a figure has two scales.
    const [rx, ry] = [Math.abs(X(radius_cm) - X(0)), Math.abs(Y(radius_cm) - Y(0))];
    return `<ellipse class="obstacle" cx="${to(X(disc[0]))}" cy="${to(Y(disc[1]))}" rx="${to(rx)}" ry="${to(ry)}"/>`;
  }
  const [[x, y], [u, v]] = box ?? line ?? [
    [0, 0],
    [0, 0],
  ];
  if (line) return `<path class="obstacle bar" d="M${to(X(x))} ${to(Y(y))}L${to(X(u))} ${to(Y(v))}"/>`;
  const [left, top] = [Math.min(X(x), X(u)), Math.min(Y(y), Y(v))];
  return `<rect class="obstacle" x="${to(left)}" y="${to(top)}" width="${to(Math.abs(X(u) - X(x)))}" height="${to(Math.abs(Y(v) - Y(y)))}"/>`;
}

/** The point of a bar that is nearest to a point. @param {Pair} point @param {[Pair, Pair]} bar @returns {Pair} */
function nearest([px, py], [[x, y], [u, v]]) {
  const [dx, dy] = [u - x, v - y];
  const square = dx * dx + dy * dy;
  const share = square > 0 ? Math.min(1, Math.max(0, ((px - x) * dx + (py - y) * dy) / square)) : 0;
  return [x + share * dx, y + share * dy];
}

/** Distance from a point to an obstacle, in cm; below 0 inside. @param {Obstacle} obstacle @param {Pair} point */
export function distance({ disc, radius_cm, box, line }, point) {
  const to = (/** @type {Pair} */ [x, y]) => Math.hypot(point[0] - x, point[1] - y);
  if (disc) return to(disc) - (radius_cm ?? 0);
  if (line) return to(nearest(point, line));
  if (!box) return Infinity;
  const [[x, y], [u, v]] = box;
  const across = Math.max(Math.min(x, u) - point[0], point[0] - Math.max(x, u));
  const up = Math.max(Math.min(y, v) - point[1], point[1] - Math.max(y, v));
  return Math.max(across, up) < 0 ? Math.max(across, up) : Math.hypot(Math.max(0, across), Math.max(0, up));
}

/** Points of an obstacle, for a rough look at where it stands. @param {Obstacle} obstacle @returns {Pair[]} */
export function outline({ disc, radius_cm, box, line }) {
  if (disc) {
    const r = radius_cm ?? 0;
    return [disc, [disc[0] + r, disc[1]], [disc[0] - r, disc[1]], [disc[0], disc[1] + r], [disc[0], disc[1] - r]];
  }
  const [[x, y], [u, v]] = box ?? line ?? [
    [0, 0],
    [0, 0],
  ];
  const ends = /** @type {Pair[]} */ ([
    [x, y],
    [u, v],
    [(x + u) / 2, (y + v) / 2],
  ]);
  return box ? [...ends, [x, v], [u, y]] : ends;
}
