// Draw targets, evolve a controller for them, try it on a virtual bean, save the task.
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
  plural,
  post,
  put,
  say,
  session,
  toast,
} from "./studio.js";
import { cross, fit, line, plot } from "./figure.js";

/** @typedef {{ x: number, y: number }} Target */
/** @typedef {{ x: number, y: number, lamp: string | null, stem: [number, number][] }} Frame */
/** @typedef {{ frames: Frame[], fitness: number[], crossings: any[], isOver: boolean, at: number, lights: string }} Trial */

const MOST = 8;
/** The plane in pixels of its drawing: 34 in a centimetre, the root at 340, 600. */
const [W, H, U, ROOT, SOIL] = [680, 660, 34, 340, 600];
const X = (/** @type {number} */ x) => ROOT + U * x;
const Y = (/** @type {number} */ y) => SOIL - U * y;

/** @type {Target[]} */
let targets = [
  { x: 3, y: 6 },
  { x: -5, y: 9 },
  { x: -1, y: 13.5 },
];
/** @type {[number, number][]} */
let reach = [];
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

const given = asked.get("targets");
if (given) {
  try {
    targets = JSON.parse(given).map(([x, y]) => ({ x, y }));
  } catch {
    // The paper's targets stand in.
  }
}

const sorted = () => [...targets].sort((one, other) => one.y - other.y);
const pairs = () => JSON.stringify(sorted().map(({ x, y }) => [x, y]));
/** The way in x that the tip needs, in cm. */
function possible() {
  let from = 0;
  return sorted().reduce((sum, { x }) => {
    const way = Math.abs(x - from);
    from = x;
    return sum + way;
  }, 0);
}
/** How far to the side a tip gets by a height, in cm. @param {number} y */
function farthest(y) {
  const row = reach.findLast(([height]) => height <= y);
  return row ? row[1] : reach.length && y < reach[0][0] ? 0 : Infinity;
}
/** @param {Target} target */
function word({ x, y }) {
  if (!reach.length) return { isFar: false, text: "" };
  if (y <= 4) return { isFar: true, text: "below the seedling’s tip, which begins at 4 cm" };
  const top = reach.at(-1)?.[0] ?? 0;
  if (y > top) return { isFar: true, text: `higher than beans grow here: ${num(top, 1)} cm` };
  const over = Math.abs(x) - farthest(y);
  return over > 0
    ? { isFar: true, text: `${num(over, 1)} cm out of reach on the ${x < 0 ? "left" : "right"}` }
    : { isFar: false, text: "within reach" };
}

// The plane.
function area() {
  if (!reach.length) return "";
  const edge = (/** @type {number} */ side) => reach.map(([y, x]) => `${X(side * x).toFixed(0)} ${Y(y).toFixed(0)}`);
  const one = (/** @type {number} */ side) => {
    const points = edge(side);
    const wall = side < 0 ? 0 : W;
    const low = `${ROOT} ${Y(4)}`;
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
  return `<path class="bean" d="${d}"/>${leaf}<circle class="tip ${frame.lamp ?? ""}" cx="${X(frame.x).toFixed(1)}" cy="${Y(frame.y).toFixed(1)}" r="7"/>`;
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
      const [about, { items }] = await Promise.all([get("api/run", { at: run }), get("api/items")]);
      const name = items.find((item) => item.at === run)?.photo_name;
      if (!name || !about.base) throw new Error("This run has no photograph, or no scale.");
      const [x, y] = about.base.map((pixels) => pixels / about.px_per_cm);
      const href = `api/run/photo?${new URLSearchParams({ at: run, name })}`;
      backdrop = { href, x: X(-x), y: Y(y), w: (U * about.width) / about.px_per_cm, h: (U * about.height) / about.px_per_cm };
    } catch (error) {
      say(error);
    }
  }
  $("#plane").classList.toggle("on-photo", backdrop !== null);
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
  const all = sorted();
  // A cross is as large on a phone.
  const size = Math.max(1, (0.7 * W) / Math.max(1, $("#plane").clientWidth));
  const marks = all.map((target, index) => {
    const { isFar, text } = word(target);
    const crossed = phase === "try" && trial?.crossings[index] && trial.crossings[index].step <= trial.at;
    const ring =
      isFar || crossed
        ? `<circle class="ring ${isFar && !crossed ? "far" : ""}" cx="${X(target.x)}" cy="${Y(target.y)}" r="18"/>`
        : `<circle class="ring" stroke-opacity="0" cx="${X(target.x)}" cy="${Y(target.y)}" r="18"/>`;
    const body = `${ring}${cross(X(target.x), Y(target.y), index + 1, 9 * size)}`;
    if (phase !== "draw") return `<g>${body}</g>`;
    return `<g tabindex="0" role="button" data-target="${targets.indexOf(target)}" aria-label="Target ${index + 1} at ${num(target.x, 1)}, ${num(target.y, 1)} cm${text ? `, ${text}` : ""}. Arrow keys move it, Delete removes it.">${body}<circle class="t-hit" cx="${X(target.x)}" cy="${Y(target.y)}" r="${hit()}"/></g>`;
  });
  const dotted = all.map(({ y }) => `<path class="dotted" d="M0 ${Y(y)}H${W}"/>`);
  const pot =
    backdrop && phase === "draw"
      ? ""
      : `<path class="pot" d="M${ROOT - 52} ${SOIL}H${ROOT + 52}L${ROOT + 42} ${H}H${ROOT - 42}Z"/>`;
  const scale = Math.max(1, W / Math.max(1, $("#plane").clientWidth));
  $("#plane").style.setProperty("--u", scale.toFixed(2));
  const focused = /** @type {any} */ (document.activeElement)?.dataset?.target;
  $("#plane").innerHTML =
    `<svg class="figure" viewBox="0 0 ${W} ${H}">${HATCH}${behind()}<path class="grid" d="${grid}"/>${area()}${heights.join("")}${dotted.join("")}${lampAt(-1, "left")}${lampAt(1, "right")}${pot}<path class="soil" d="M0 ${SOIL}H${W}"/>${ghosts.join("")}${trail(trial)}${plant(trial)}${marks.join("")}</svg>`;
  if (focused !== undefined) $(`#plane [data-target="${focused}"]`)?.focus();
}
/** Half of what a finger meets, whatever the scale of the drawing. */
const hit = () => Math.max(22, (22 * W) / Math.max(1, $("#plane").clientWidth));

// Targets by mouse, finger and keys.
const keep = () => {
  past.push(JSON.stringify(targets));
  past.splice(0, past.length - 50);
};
const snapped = (value) => Math.round(value * 2) / 2;
/** @param {Target} target */
function bound(target) {
  target.x = Math.min(9.5, Math.max(-9.5, target.x));
  target.y = Math.min(17, Math.max(4.5, target.y));
  // Two at one height cannot be told apart.
  while (targets.some((other) => other !== target && other.y === target.y)) target.y += target.y >= 16.5 ? -0.5 : 0.5;
}
/** @param {PointerEvent} event */
function pointed(event) {
  const box = $("#plane svg").getBoundingClientRect();
  return {
    x: snapped((((event.clientX - box.left) / box.width) * W - ROOT) / U),
    y: snapped((SOIL - ((event.clientY - box.top) / box.height) * H) / U),
  };
}
/** @type {Target | null} */
let dragged = null;
$("#plane").addEventListener("pointerdown", (event) => {
  if (phase !== "draw") return;
  const mark = event.target.closest?.("[data-target]");
  if (mark) {
    keep();
    dragged = targets[Number(mark.dataset.target)];
  } else {
    const target = pointed(event);
    if (target.y < 4) return;
    dragged = add(target);
  }
  $("#plane").setPointerCapture(event.pointerId);
  event.preventDefault();
  drawn();
});
$("#plane").addEventListener("pointermove", (event) => {
  if (!dragged) return;
  Object.assign(dragged, pointed(event));
  bound(dragged);
  drawn();
});
for (const name of ["pointerup", "pointercancel"]) {
  $("#plane").addEventListener(name, () => {
    dragged = null;
  });
}
$("#plane").addEventListener("keydown", (event) => {
  const index = event.target.dataset?.target;
  const move = { ArrowLeft: [-0.5, 0], ArrowRight: [0.5, 0], ArrowUp: [0, 0.5], ArrowDown: [0, -0.5] }[event.key];
  if (index === undefined || phase !== "draw") return;
  const target = targets[Number(index)];
  if (move) {
    event.preventDefault();
    keep();
    target.x += move[0];
    target.y += move[1];
    bound(target);
    drawn();
    $("#live").textContent = `${num(target.x, 1)}, ${num(target.y, 1)} cm, ${word(target).text}`;
  } else if (event.key === "Delete" || event.key === "Backspace") {
    keep();
    targets.splice(Number(index), 1);
    drawn();
    $("#live").textContent = "Removed.";
  }
});
/** @param {Target} target */
function add(target) {
  if (targets.length >= MOST) {
    toast(`${MOST} targets are the most.`);
    return null;
  }
  keep();
  targets.push(target);
  bound(target);
  return target;
}
$("#add").onclick = () => {
  const highest = Math.max(4, ...targets.map((target) => target.y));
  add({ x: 0, y: snapped(Math.min(17, highest + 2)) });
  drawn();
};
$("#undo").onclick = () => {
  const before = past.pop();
  if (!before) return toast("Nothing to undo.");
  targets = JSON.parse(before);
  drawn();
};

let timer = 0;
/** What follows from a change of the drawing. */
function drawn() {
  draw();
  const row = (target, place) => {
    const { isFar, text } = word(target);
    const index = targets.indexOf(target);
    const field = (key, name) =>
      html`<label class="field"
        ><span>${name}</span
        ><input
          type="number"
          step="0.5"
          inputmode="decimal"
          value="${target[key]}"
          data-index="${index}"
          data-key="${key}"
          aria-label="Target ${place + 1}, ${name}"
      /></label>`;
    return html`<div class="target-row">
      <span class="mark">${place + 1}</span>${field("x", "x (cm)")}${field("y", "y (cm)")}
      <button class="btn quiet square" type="button" data-remove="${index}" aria-label="Remove target ${place + 1}">
        ${icon("bin")}
      </button>
      <span class="say ${isFar ? "out" : ""}">${text}</span>
    </div>`;
  };
  put($("#targets"), targets.length ? sorted().map(row) : html`<p class="soft">No target yet.</p>`);
  const far = targets.filter((target) => word(target).isFar).length;
  $("#possible").textContent = targets.length
    ? `Best possible fitness ${num(possible(), 1)} cm.${far ? ` ${plural(far, "target")} out of reach: the last centimetres will be missing.` : ""}`
    : "";
  $("#evolve").disabled = !targets.length;
  clearTimeout(timer);
  timer = setTimeout(async () => {
    if (!targets.length) return;
    const found = await get("api/task", { targets: pairs() }).catch(() => null);
    if (found) $("#task").textContent = found.task;
  }, 300);
}
$("#targets").addEventListener("change", (event) => {
  const { index, key } = event.target.dataset;
  const value = Number(event.target.value);
  if (index === undefined || !Number.isFinite(value)) return;
  keep();
  targets[Number(index)][key] = value;
  bound(targets[Number(index)]);
  drawn();
});
$("#targets").addEventListener("click", (event) => {
  const button = event.target.closest("[data-remove]");
  if (!button) return;
  keep();
  targets.splice(Number(button.dataset.remove), 1);
  drawn();
  $("#add").focus();
});

// Phases.
/** @param {"draw" | "evolve" | "try"} to */
function enter(to) {
  phase = to;
  for (const name of ["draw", "evolve", "try"]) $(`#p-${name}`).hidden = name !== to;
  $("#hint").hidden = to !== "draw";
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
const free = () => `targets-${new Date().toISOString().slice(0, 19).replace(/[-:]/g, "").replace("T", "-")}`;
$("#name").value = free();
$("#evolve").onclick = async () => {
  $("#evolve").disabled = true;
  try {
    const request = {
      name: $("#name").value.trim(),
      targets: JSON.parse(pairs()),
      runs: Number($("#runs").value),
      generations: Number($("#generations").value),
      seed: Number($("#seed").value),
      model: $("#model").value || null,
    };
    const found = await post("api/draw/evolve", request);
    at = found.at;
    put($("#commands"), found.commands.map(command));
    $("#name").value = free();
    evolution = undefined;
    $("#whole").href = `evolution?${new URLSearchParams({ at })}`;
    $("#evolving").textContent = "Waits for its turn in the queue. The page may be closed.";
    enter("evolve");
    follow();
  } catch (error) {
    say(error);
  }
  $("#evolve").disabled = false;
};

/** Waits until the evolution is there, then listens to it. */
async function follow() {
  const own = at;
  for (;;) {
    const found = await get("api/evolution", { at: own }).catch(() => null);
    if (at !== own || phase !== "evolve") return;
    if (found) break;
    const { queue } = await get("api/items").catch(() => ({ queue: [] }));
    const job = queue?.findLast((one) => one.at === own);
    if (job?.state === "failed") {
      $("#evolving").textContent = `It failed: ${job.problem}`;
      return;
    }
    const before = queue?.filter((one) => one.state === "waiting" || one.state === "running").findIndex((one) => one.at === own);
    $("#evolving").textContent =
      before > 0
        ? `Waits for ${plural(before, "other job")}. The page may be closed.`
        : "Makes the model of virtual beans first: a few seconds.";
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
  if (!evolution?.marks.length) return "";
  const { marks, top, median, generations } = evolution;
  const best = possible();
  const low = Math.min(0, ...median);
  return plot({
    w: width,
    h: 190,
    x: [0, generations],
    y: [Math.max(-best, low), Math.max(best, ...top) * 1.08],
    xl: "generation",
    yl: "best (cm)",
    label: `Best fitness so far ${num(top.at(-1))} of ${num(best, 1)} cm`,
    body: (x, y) =>
      `<path class="dotted" d="M${x(0)} ${y(best)}H${x(generations)}"/><path class="stroke thin quiet" d="${line(marks, median, x, y)}"/><path class="stroke bold best" d="${line(marks, top, x, y)}"/>`,
  });
});
$("#early").onclick = () => enter("try");
$("#redraw").onclick = () => enter("draw");

// Try.
const SAYS = {
  champion: "The network that evolved. It sees only where the tip is.",
  greedy: "Lights the lamp on the side of the next target: the rule that a person would write by hand.",
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
        targets: pairs(),
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
  const best = possible();
  const row = (name, title) => {
    const trial = trials[name];
    const passed = trial ? trial.crossings.filter((one) => one && one.step <= trial.at).length : 0;
    const value = trial && trial.at > 0 ? num(trial.fitness[trial.at] ?? 0, 1) : "–";
    return html`<tr class="${name === who ? "now" : ""}">
      <th scope="row">${title}</th>
      <td class="n">${passed} of ${targets.length}</td>
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
        : `${frame.lamp ?? "no"} lamp, tip ${num(frame.x, 1)}, ${num(frame.y, 1)} cm`;
  put($("#hour"), html`<b>${Math.floor(step / 12)} h ${String((step % 12) * 5).padStart(2, "0")}</b> ${says}`);
  put($("#play"), isPlaying ? html`${icon("pause")}Pause` : html`${icon("play")}${isEnd ? "Again" : "Play"}`);
  $("#left").setAttribute("aria-pressed", String(yours === "l"));
  $("#right").setAttribute("aria-pressed", String(yours === "r"));
}
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
    const found = await get("api/try", { who: "you", targets: pairs(), seed, lights, from: trial.frames.length - 1 });
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
    const found = await post("api/draw/save", { name, targets: JSON.parse(pairs()) });
    put($("#commands"), found.commands.map(command));
    toast(`${found.file} is written.`);
  } catch (error) {
    say(error);
  }
};

session.then(async ({ session: own }) => {
  if (!own) return;
  drawn();
  listen("api/events", "items", () => {});
  get("api/items").then(({ items }) => {
    const runs = items.filter((item) => item.kind === "run" && item.photo_name);
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
  reach = (await get("api/reach").catch(() => ({ reach: [] }))).reach;
  drawn();
});
new ResizeObserver(draw).observe($("#plane"));
