// The page in a browser: its modes, and the bean that is played with.
// @ts-check
import { mode as drawingMode, take, text } from "../crates/tropism-studio/assets/drawing.js";
import { enter } from "../crates/tropism-studio/assets/draw.js";
import { drawn, setMode } from "../crates/tropism-studio/assets/editor.js";
import { view } from "../crates/tropism-studio/assets/plane.js";
import { seed, setSeed } from "../crates/tropism-studio/assets/trial.js";
import { $, $$, championOf, html, icon, put, session, toast, toggleTheme } from "./studio.js";
import "./champion.js";
import { openMeasure } from "./measure.js";
import { openNodes } from "./nodes.js";
import { openPaper } from "./paper.js";
import { openPhotographs } from "./photographs.js";
import { light as lightTent, openTent } from "./tent.js";

const MODES = ["play", "draw", "paper", "photographs", "measure", "tent", "nodes"];
championOf.set(text(), "paper");

for (const element of $$("[data-ic]")) if (!element.querySelector(".ic")) element.insertAdjacentHTML("afterbegin", icon(element.dataset.ic).text);
$("#theme").onclick = toggleTheme;
// The numbers of the bean stand beside it.
const side = $("#view-plane .main-side > .stack:last-child");
side.append($("#play-sheet"), $("#champion-sheet"));
const rule = document.createElement("button");
Object.assign(rule, { type: "button", textContent: "Rule" });
rule.dataset.who = "rule";
rule.setAttribute("aria-pressed", "false");
$("[data-who=greedy]").after(rule);

let mode = "";
/** The evolution that was looked at last. */
let evolved = "";

/** Shows a mode. @param {string} next @param {URLSearchParams} asked */
function show(next, asked) {
  if (asked.has("task")) {
    try {
      take(JSON.parse(asked.get("task") ?? ""));
      setMode(drawingMode);
      drawn();
    } catch {
      toast("The link holds no task: the paper’s targets stand in.");
    }
  }
  if (/^\d{1,15}$/.test(asked.get("seed") ?? "")) setSeed(Number(asked.get("seed")));
  if (mode === next && !asked.size) return;
  if (mode === "draw") evolved = view.at;
  mode = next;
  document.body.dataset.view = mode;
  const isPlane = mode === "play" || mode === "draw";
  $("#view-plane").hidden = !isPlane;
  for (const other of MODES.slice(2)) $(`#view-${other}`).hidden = other !== mode;
  for (const link of $$("#modes a")) {
    const isOwn = link.getAttribute("href") === `#/${mode}`;
    if (isOwn) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
    // Once the page is laid out for its next frame: here it would be laid out for this alone.
    if (isOwn) requestAnimationFrame(() => link.scrollIntoView({ block: "nearest", inline: "nearest" }));
  }
  $("#view-plane h1").textContent = mode === "play" ? "Steer a bean" : "Draw a target";
  $("#play-sheet").hidden = mode !== "play";
  if (mode === "play") {
    view.at = championOf.get(text()) ?? "";
    $("[data-who=champion]").hidden = !view.at;
    enter("try", "you");
  } else if (mode === "draw") {
    view.at = evolved;
    $("[data-who=champion]").hidden = false;
    enter("draw");
  } else if (mode === "paper") openPaper();
  else if (mode === "photographs") openPhotographs();
  else if (mode === "measure") openMeasure();
  else if (mode === "tent") openTent();
  else openNodes();
}

function route() {
  // With a stroke, so that no element has the name.
  const [name, query] = location.hash.replace(/^#\/?/, "").split("?");
  show(MODES.includes(name) ? name : mode || "play", new URLSearchParams(query));
}
addEventListener("hashchange", route);
addEventListener("keydown", ({ key }) => {
  if (mode === "tent" && (key === "ArrowLeft" || key === "ArrowRight")) lightTent(key === "ArrowLeft" ? "left" : "right");
});
$("#redraw").addEventListener("click", () => {
  location.hash = "/draw";
});
$("#share").onclick = () => {
  const link = `${location.href.split("#")[0]}#/play?${new URLSearchParams({ seed: String(seed), task: text() })}`;
  put($("#share-says"), html`<a href="${link}">${link}</a>`);
  navigator.clipboard?.writeText(link).then(
    () => toast("Copied: seed and targets are in the link."),
    () => {},
  );
};
// After what the modules of the studio do first.
session.then(route);
if (document.body.dataset.worker) navigator.serviceWorker?.register(document.body.dataset.worker).catch(() => {});
