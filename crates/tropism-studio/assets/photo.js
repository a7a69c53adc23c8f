// A photograph on a page, and what is drawn over it.
// @ts-check
import { $ } from "./dom.js";

/** Where a tip was found, or anything else at one place. @param {number} x @param {number} y @param {number} r @param {string} [kind] */
export const ring = (x, y, r, kind = "") =>
  `<circle class="dark" cx="${x}" cy="${y}" r="${r}"/><circle class="ring ${kind}" cx="${x}" cy="${y}" r="${r}"/>`;

/** @param {[number, number][] | null | undefined} points */
export const stemLine = (points) => (points?.length ? `<path class="stem" d="M${points.map((point) => point.join(" ")).join("L")}"/>` : "");

/** The region in which a plant is looked for. @param {number[]} region */
export const regionOf = ([x, y, width, height]) => `<rect class="region" x="${x}" y="${y}" width="${width}" height="${height}"/>`;

/** Gives `#photo` the form of photographs of this size, and `#over` their pixels. @param {number} width @param {number} height */
export function frameFor(width, height) {
  $("#over").setAttribute("viewBox", `0 0 ${width} ${height}`);
  $("#photo").style.aspectRatio = `${width} / ${height}`;
}

/** Shows the plant larger, or the whole photograph. @param {boolean} is */
export function nearer(is) {
  $("#photo").classList.toggle("near", is);
  $("#near").setAttribute("aria-pressed", String(is));
}
const near = $("#near");
if (near) near.onclick = () => nearer(!$("#photo").classList.contains("near"));
