// Draw targets, way points and obstacles, or a form of the stem; evolve or tune a controller for them, try it on a virtual bean, save the task.
// @ts-check
import { $, $$, asked, command, get, html, listen, num, pageOf, plural, post, put, say, session, toast } from "./studio.js";
import { fit, line, plot } from "./figure.js";
import { best, drawing, free, learn, mode, take } from "./drawing.js";
import { draw, view } from "./plane.js";
import { drawn, setMode } from "./editor.js";
import { begin, pause, play } from "./trial.js";

// Phases.
/** @param {"draw" | "evolve" | "try"} to @param {"you"} [who] steers */
export function enter(to, who) {
  view.phase = document.body.dataset.phase = to;
  for (const name of ["draw", "evolve", "try"]) $(`#p-${name}`).hidden = name !== to;
  $("#hint").hidden = $("#mode").hidden = $("#tool").hidden = to !== "draw";
  $("#steer").hidden = to !== "try" || view.who !== "you";
  pause();
  const now = ["draw", "evolve", "try"].indexOf(to);
  $$("#flow li").forEach((item, index) => {
    item.classList.toggle("done", index < now);
    if (index === now) item.setAttribute("aria-current", "step");
    else item.removeAttribute("aria-current");
  });
  $("#live").textContent = { draw: "Draw targets.", evolve: "Evolving.", try: "A bean to try it on." }[to];
  if (to === "try") {
    begin(who);
  } else {
    draw();
  }
}

// Evolve.
/** @type {import("./types.d.ts").EvolutionNews | undefined} */
let evolution;
$("#name").value = free();
/** Names of what was made from this page: what is made next has another, and is saved under the same. @type {Set<string>} */
const made = new Set();
/** Asks for an evolution, or for a rule. @param {"evolve" | "tune"} method */
async function make(method) {
  $("#evolve").disabled = $("#tune").disabled = true;
  try {
    if (made.has($("#name").value.trim())) $("#name").value = free();
    const name = $("#name").value.trim();
    const request = {
      name,
      drawing: drawing(),
      method,
      runs: Number($("#runs").value),
      generations: Number($(method === "tune" ? "#rule-generations" : "#generations").value),
      seed: Number($("#seed").value),
      model: $("#model").value || null,
    };
    const found = await post("api/draw/evolve", request);
    view.at = found.at;
    put($("#commands"), found.commands.map(command));
    made.add(name);
    evolution = undefined;
    searched.length = 0;
    $("#p-evolve h2").textContent = method === "tune" ? "Tuning a rule" : "Evolving";
    $("#whole").href = pageOf(method === "tune" ? "rule" : "evolution", view.at);
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

/** Says how long a job waits, or why it failed; whether it may still come. @param {string} own @param {import("./types.d.ts").ShownJob[] | null} queue */
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
  const own = view.at;
  for (; view.at === own && view.phase === "evolve"; await new Promise((done) => setTimeout(done, 500))) {
    /** @type {import("./types.d.ts").ShownWork | null} */
    const found = await get("api/work", { at: own }).catch(() => null);
    if (view.at !== own || view.phase !== "evolve") return;
    const status = /** @type {import("./types.d.ts").WorkStatus | undefined} */ (found?.status);
    if (!status) {
      const { queue } = await get("api/items").catch(() => ({ queue: [] }));
      if (!waits(own, queue)) return;
    } else if (status.is_over) {
      enter("try");
      return play(true);
    } else {
      const { done: generation, total, best: top } = status.parts[0];
      searches = total;
      $("#generation").textContent = `generation ${generation} of ${total}`;
      $("#evolving").textContent = "The mean of the best rule of each generation. The page may be closed.";
      if (generation > (searched.at(-1)?.[0] ?? 0)) searched.push([generation, top]);
      curve();
    }
  }
}

/** Waits until the evolution is there, then listens to it. */
async function follow() {
  const own = view.at;
  for (;;) {
    const found = await get("api/evolution", { at: own }).catch(() => null);
    if (view.at !== own || view.phase !== "evolve") return;
    if (found) break;
    const { queue } = await get("api/items").catch(() => ({ queue: [] }));
    if (!waits(own, queue)) return;
    await new Promise((done) => setTimeout(done, 500));
  }
  const end = listen("evolution", own, (found) => {
    if (view.at !== own) return end();
    evolution = found;
    $("#generation").textContent =
      `generation ${Math.floor(found.done / Math.max(1, found.best.length))} of ${found.generations}`;
    $("#evolving").textContent =
      found.state === "over" ? "Done." : `${found.rate ? `${found.rate} evaluations a second. ` : ""}The page may be closed.`;
    curve();
    if (found.state === "over" && view.phase === "evolve") {
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

/** Names under which this page has saved: what changed since takes the place of what it saved itself. @type {Set<string>} */
const saved = new Set();

// Save.
$("#save").onclick = async () => {
  try {
    const name = $("#name").value.trim();
    const found = await post("api/draw/save", { name, drawing: drawing(), replace: saved.has(name) });
    saved.add(name);
    put($("#commands"), found.commands.map(command));
    toast(`${found.file} is written.`);
  } catch (error) {
    say(error);
  }
};

try {
  const given = asked.get("drawing");
  if (given) {
    take(JSON.parse(given));
  } else {
    const draft = JSON.parse(sessionStorage.getItem("draft") ?? "null");
    if (draft) {
      take(draft.drawing);
      $("#name").value = draft.name;
      for (const name of draft.saved) saved.add(name);
    }
  }
} catch {
  // The paper's targets stand in.
}
// A page that is loaded again has what was drawn on it. Phones end a page that is hidden.
document.addEventListener("visibilitychange", keepDraft);
addEventListener("pagehide", keepDraft);
function keepDraft() {
  try {
    sessionStorage.setItem("draft", JSON.stringify({ drawing: drawing(), name: $("#name").value, saved: [...saved] }));
  } catch {
    // Without storage the drawing ends with the page.
  }
}
setMode(mode);

session.then(async ({ session: own }) => {
  if (!own) return;
  drawn();
  listen("items", "", () => {});
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
  if (view.at) enter("try");
  else enter("draw");
  /** @type {import("./types.d.ts").ToldReach | null} */
  const found = await get("api/reach").catch(() => null);
  if (!found) return;
  learn(found);
  drawn();
});
