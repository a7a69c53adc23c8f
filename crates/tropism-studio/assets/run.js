// A run, live: the plant first, then what happens next, then figures.
// @ts-check
import { $, banner, command, get, html, listen, num, plural, put, refuse } from "./studio.js";
import { state } from "./control.js";
import { cursor, series, seriesTable } from "./curves.js";
import { facts, next } from "./facts.js";
import { health } from "./health.js";
import { keep } from "./keep.js";
import { path } from "./path.js";
import { frameFor } from "./photo.js";
import { age, photograph, strip } from "./photograph.js";
import { at, run, step } from "./record.js";
import { predict, targets } from "./targets.js";

/** Tells the run from another in its folder. */
let identity = "";
let isThere = true;

let keptAs = "";
/** What can be kept of the run, once its name and its state are known, and again when it is over. */
function keepAbout() {
  const isOver = run.status.state === "over";
  if (!run.about.name || !run.status.state || keptAs === String(isOver)) return;
  keptAs = String(isOver);
  keep("run", at, { name: run.about.name, isOver });
}

/** What changes by itself, once a second. */
function tick() {
  age();
  next();
}

const PARTS = [state, photograph, facts, next, path, series, cursor, targets, health, strip, seriesTable, keepAbout];
/** Parts that are still to be drawn. @type {(() => void)[]} */
let due = [];
/** Draws what changed, a part a frame: none of them holds up a finger. */
function all() {
  if (!due.length) requestAnimationFrame(some);
  due = [...PARTS];
}
function some() {
  due.shift()?.();
  if (due.length) requestAnimationFrame(some);
}

/** What is expected takes the server a while: what is known comes first. */
const PREDICTS_AFTER_MS = 1500;

// Both are asked for at once: neither waits for the other.
listen(
  "run",
  at,
  (data) => {
    const isFirst = !run.steps.length;
    // Another run lies in the folder now: nothing of the one before is kept.
    const own = data.status.state === "gone" ? null : data.status.identity;
    if (own && identity && own !== identity) return location.reload();
    identity = own ?? identity;
    run.steps = [...run.steps.slice(0, data.from), ...data.rows.map(step)];
    run.events = [...run.events.slice(0, data.events_from), ...data.events];
    run.status = data.status;
    if (run.shown !== null && run.shown >= run.steps.length) run.shown = null;
    if (isFirst) PARTS.filter((part) => part !== strip).forEach((part) => part());
    else all();
    if (isFirst) setTimeout(predict, PREDICTS_AFTER_MS);
  },
  (is, seconds) => {
    [run.isLost, run.lostFor] = [is, seconds];
    state();
    facts();
    tick();
  },
  () => {
    isThere = false;
    $("#dock").hidden = true;
    document.body.classList.remove("has-dock");
    put(
      $("#banner"),
      banner(
        "bad",
        "alert",
        html`<strong>There is no run here.</strong> It was deleted, renamed or moved, or the address is wrong. All that is there is
          in the <a href="./">overview</a>.`,
      ),
    );
  },
);
setInterval(tick, 1000);
setInterval(predict, 60_000);
get("api/run", { at }).then((known) => {
  run.about = known;
  $("#name").textContent = known.name;
  $("#path-title").textContent = known.line.length ? "Path and form" : known.targets.length ? "Path and targets" : "Path";
  document.title = `${known.name} · tropism studio`;
  if (known.width) frameFor(known.width, known.height);
  put(
    $("#about"),
    html`Steered by ${known.controller}, ${num(known.period_min, known.period_min % 1 ? 1 : 0)} min a step, at most
    ${plural(known.max_steps, "step")}.`,
  );
  keepAbout();
  put($("#commands"), [command(known.commands.status), command(known.commands.stop), command(known.commands.resume)]);
  all();
}, (error) => isThere && refuse(error));
