// The editor: mouse, finger and keys on the plane, and the lists beside it.
// @ts-check
import { $, $$, get, html, icon, num, plural, put, toast, wordOf } from "./studio.js";
import {
  HIGH,
  KINDS,
  LOW,
  add,
  beginLine,
  best,
  bound,
  free,
  handles,
  hasGoal,
  isObstacle,
  isOne,
  isThing,
  items,
  keep,
  lowest,
  mode,
  nameOf,
  node,
  numbers,
  redo,
  removeAt,
  setBest,
  snapped,
  sorted,
  steepest,
  targets,
  text,
  turnTo,
  undo,
  word,
} from "./drawing.js";
import { H, ROOT, SOIL, U, W, draw, view } from "./plane.js";

/** @typedef {import("./drawing.js").Item} Item */
/** @typedef {import("./drawing.js").Pair} Pair */

/** What a touch of the plane places. @type {Item["kind"]} */
let tool = "target";

/** @param {PointerEvent} event @returns {Pair} */
function pointed(event) {
  const box = $("#plane svg").getBoundingClientRect();
  return [
    snapped((((event.clientX - box.left) / box.width) * W - ROOT) / U),
    snapped((SOIL - ((event.clientY - box.top) / box.height) * H) / U),
  ];
}
/** Where a finger touched the plane that may be lifted there again. @type {Pair | null} */
let tapped = null;
/** How far a finger that taps may stray, in pixels. */
const STRAY_PX = 12;
/** Adds what is chosen where the pointer is, if it may stand there. @param {PointerEvent} event */
function placed(event) {
  const point = pointed(event);
  return point[1] < lowest(tool) - 0.5 ? null : add(tool, point);
}
/** The thing that is dragged, and the handle that it is dragged by. @type {{ item: Item, place: number, from: Pair | null } | null} */
let dragged = null;
$("#plane").addEventListener("pointerdown", (event) => {
  if (view.phase !== "draw") return;
  const mark = event.target.closest?.("[data-grip]");
  if (mark) {
    keep();
    const [index, place] = mark.dataset.grip.split(".").map(Number);
    dragged = { item: items[index], place, from: null };
  } else {
    // A finger that swipes scrolls the page; one that taps places, when it is lifted. A stem is drawn by finger, too.
    if (event.pointerType === "touch" && tool !== "node") {
      tapped = [event.clientX, event.clientY];
      return;
    }
    const item = placed(event);
    if (!item) return;
    const [point] = item.points;
    // A drag from here on gives an obstacle its size: by the rim of a disc, by the other end of the others. A line of the
    // stem is drawn by it.
    dragged = { item, place: tool === "disc" ? 1 : isThing(tool) ? 2 : 0, from: [point[0], point[1]] };
  }
  $("#plane").setPointerCapture(event.pointerId);
  event.preventDefault();
  drawn();
});
$("#plane").addEventListener("pointermove", (event) => {
  if (!dragged) return;
  const { item, place, from } = dragged;
  const to = pointed(event);
  if (from && item.kind === "node") return stroke(from, event);
  // A tap that trembles leaves a new obstacle as large as it is.
  if (from && isObstacle(item) && Math.hypot(to[0] - from[0], to[1] - from[1]) < 1) return;
  dragged.from = null;
  handles(item)[place].move(to);
  bound(item);
  drawn();
});
/** A line that is drawn by hand, in place of the one there was: a point for every 1.5 cm of height. @param {Pair} from @param {PointerEvent} event */
function stroke(from, event) {
  const box = $("#plane svg").getBoundingClientRect();
  const x = (((event.clientX - box.left) / box.width) * W - ROOT) / U;
  const [, y] = pointed(event);
  if (!isStroke) {
    if (Math.hypot(x - from[0], y - from[1]) < 1) return;
    isStroke = true;
    beginLine(from);
  }
  const isNear = items.some((item) => item.kind === "node" && Math.abs(item.points[0][1] - y) < 1.5);
  if (isNear || y < LOW || y > HIGH) return;
  const item = node([Math.round(10 * x) / 10, y]);
  items.push(item);
  bound(item);
  drawn();
}
let isStroke = false;
for (const name of ["pointerup", "pointercancel"]) {
  $("#plane").addEventListener(name, (event) => {
    const isTap = tapped && name === "pointerup" && Math.hypot(event.clientX - tapped[0], event.clientY - tapped[1]) < STRAY_PX;
    tapped = null;
    if (isTap && placed(event)) drawn();
    dragged = null;
    isStroke = false;
  });
}
$("#plane").addEventListener("keydown", (event) => {
  const grip = event.target.dataset?.grip;
  const by = { ArrowLeft: [-0.5, 0], ArrowRight: [0.5, 0], ArrowUp: [0, 0.5], ArrowDown: [0, -0.5] }[event.key];
  if (grip === undefined || view.phase !== "draw") return;
  const [index, place] = grip.split(".").map(Number);
  const item = items[index];
  if (by) {
    event.preventDefault();
    keep();
    const { at: from, move } = handles(item)[place];
    move([from[0] + by[0], from[1] + by[1]]);
    bound(item);
    drawn();
    const { at: to } = handles(item)[place];
    $("#live").textContent =
      `${num(to[0], 1)}, ${num(to[1], 1)} cm${item.kind === "disc" ? `, radius ${num(item.radius, 1)} cm` : ""}, ${word(item).text}`;
  } else if (event.key === "Delete" || event.key === "Backspace") {
    remove(index);
    $("#live").textContent = "Removed.";
  }
});
/** @param {number} index */
function remove(index) {
  removeAt(index);
  drawn();
}
$("#add").onclick = () => {
  const highest = Math.max(4, ...items.filter(({ kind }) => kind === tool).map(({ points: [[, y]] }) => y));
  const at = snapped(Math.min(HIGH, highest + (isThing(tool) ? 3 : 2)));
  add(tool, isThing(tool) ? [3, at] : isOne(tool) ? [2, 7] : [0, at]);
  drawn();
};
$("#tool").onclick = (event) => {
  const button = event.target.closest("[data-tool]");
  if (!button) return;
  use(button.dataset.tool);
};
/** @param {Item["kind"]} next */
function use(next) {
  tool = next;
  for (const button of $$("[data-tool]")) button.setAttribute("aria-pressed", String(button.dataset.tool === next));
  const name = KINDS[next].name.toLowerCase();
  $("#add").textContent = `Add ${/^[aeiou]/.test(name) ? "an" : "a"} ${name}`;
}
/** @param {"targets" | "form"} next */
export function setMode(next) {
  turnTo(next);
  const isForm = mode === "form";
  for (const button of $$("[data-mode]")) button.setAttribute("aria-pressed", String(button.dataset.mode === mode));
  for (const button of $$("[data-tool]")) button.hidden = ["node", "apex", "inflection"].includes(button.dataset.tool) !== isForm;
  $("#list-name").textContent = isForm ? "Line of the stem" : "Targets";
  $("#others").setAttribute("aria-label", isForm ? "Apex and inflection" : "Way points and obstacles");
  $("#form-numbers").hidden = !isForm;
  $("#plane").classList.toggle("by-hand", isForm);
  $("#hint").textContent = isForm
    ? "Draw the line that the stem is to have, from the root upwards, or touch the plane for single points and drag them. It counts when the tip is as high as the line’s end."
    : "Touch the plane to place what is chosen above, drag it to move it. The tip is to pass the targets from the lowest to the highest, and the stem must touch no obstacle; way points are to steer by.";
  use(isForm ? "node" : "target");
}
$("#mode").onclick = (event) => {
  const button = event.target.closest("[data-mode]");
  if (!button || button.dataset.mode === mode) return;
  keep();
  setMode(button.dataset.mode);
  $("#name").value = free();
  drawn();
};
for (const field of $$("[data-number]")) {
  field.onchange = () => {
    const value = field.value === "" ? null : Number(field.value);
    if (value !== null && !Number.isFinite(value)) return;
    keep();
    numbers[/** @type {"lean_deg"} */ (field.dataset.number)] = value;
    drawn();
  };
}
/** @param {() => boolean} turn @param {string} says */
function turn(turn, says) {
  if (!turn()) return toast(says);
  setMode(mode);
  drawn();
}
$("#undo").onclick = () => turn(undo, "Nothing to undo.");
const again = $("#redo");
if (again) again.onclick = () => turn(redo, "Nothing to redo.");
addEventListener("keydown", (event) => {
  const isTyping = /** @type {Element} */ (event.target).matches?.("input, select, textarea");
  if (view.phase !== "draw" || isTyping || !(event.ctrlKey || event.metaKey)) return;
  const key = event.key.toLowerCase();
  if (key !== "z" && key !== "y") return;
  event.preventDefault();
  if (key === "y" || event.shiftKey) turn(redo, "Nothing to redo.");
  else turn(undo, "Nothing to undo.");
});

/** A number of a thing: a coordinate, or the radius. @param {Item} item @param {number | string} key */
const valueOf = ({ points, radius }, key) => (key === "radius" ? radius : points.flat()[Number(key)]);

/**
 * Shows a list of things with their fields. Where only numbers change, the fields stay: who types goes on in the next one.
 * @param {any} place @param {Item[]} list @param {(item: Item) => any} row @param {any} none
 */
function rows(place, list, row, none) {
  const form = list.map((item) => `${items.indexOf(item)} ${item.kind}`).join();
  if (place.form !== form) {
    place.form = form;
    place.shown = undefined;
    put(place, list.length ? list.map(row) : none);
    return;
  }
  for (const field of $$("input", place)) {
    const value = String(valueOf(items[Number(field.dataset.index)], field.dataset.key));
    // What somebody is typing stays: an answer about what was typed before may come meanwhile.
    if (field.value !== value && !field.dataset.typed) field.value = value;
  }
  $$(".say", place).forEach((say, index) => {
    const { isFar, text } = word(list[index]);
    say.textContent = text;
    say.classList.toggle("out", isFar);
  });
}

let timer = 0;
/** What follows from a change of the drawing. */
export function drawn() {
  draw();
  const field = (index, key, name, label, value) =>
    html`<label class="field"
      ><span>${name} (cm)</span
      ><input
        type="number"
        step="0.5"
        inputmode="decimal"
        value="${value}"
        data-index="${index}"
        data-key="${key}"
        aria-label="${label}, ${name}"
    /></label>`;
  const row = (/** @type {Item} */ item) => {
    const { isFar, text } = word(item);
    const index = items.indexOf(item);
    const label = nameOf(item);
    const names = KINDS[item.kind].points;
    const fields = names.map((name, key) => field(index, key, name, label, valueOf(item, key)));
    if (item.kind === "disc") fields.push(field(index, "radius", "radius", label, item.radius));
    return html`<div class="target-row ${{ target: "", node: "", disc: "named three" }[item.kind] ?? "named"}">
      <span class="mark">${item.kind === "target" || item.kind === "node" ? sorted(item.kind).indexOf(item) + 1 : label}</span>${fields}
      <button class="btn quiet square" type="button" data-remove="${index}" aria-label="Remove ${label.toLowerCase()}">
        ${icon("bin")}
      </button>
      <span class="say ${isFar ? "out" : ""}">${text}</span>
    </div>`;
  };
  const isForm = mode === "form";
  const all = isForm ? sorted("node") : targets();
  rows($("#targets"), all, row, html`<p class="soft">${isForm ? "No line: the stem is to follow none." : "No target yet."}</p>`);
  const others = isForm ? items.filter(({ kind }) => isOne(kind)) : [...sorted("way"), ...items.filter(isObstacle)];
  $("#others").hidden = others.length === 0;
  rows($("#others"), others, row, "");
  for (const field of $$("[data-number]")) field.value = String(numbers[/** @type {"lean_deg"} */ (field.dataset.number)] ?? "");
  tell();
  $("#evolve").disabled = $("#tune").disabled = !hasGoal();
  clearTimeout(timer);
  timer = setTimeout(async () => {
    if (!hasGoal()) return;
    const found = await get("api/task", { drawing: text() }).catch((error) => ({ task: wordOf(error), best: 0 }));
    $("#task").textContent = found.task;
    setBest(found.best);
    tell();
  }, 300);
}
/** Says what can be reached at best. */
function tell() {
  if (mode === "form") {
    const far = items.filter((item) => word(item).isFar).length;
    const isSteep = Math.abs(numbers.lean_deg ?? 0) > steepest;
    const isBlind = hasGoal() && !items.some(({ kind }) => kind === "node" || kind === "apex");
    $("#possible").textContent = hasGoal()
      ? `An upright seedling differs from this form by ${num(best, 1)} cm, and as much is the best possible fitness.${far ? ` ${plural(far, "point")} out of reach.` : ""}${isSteep ? ` No bean here leans by more than ${steepest}°.` : ""}${isBlind ? " The greedy rule and tuned rules steer along a line or to an apex, and here is neither: evolve a network." : ""}`
      : "Draw a line, or say what the bow of the stem is to be.";
    return;
  }
  const far = targets().filter((item) => word(item).isFar).length;
  const touching = items.some((item) => isObstacle(item) && word(item).isFar);
  $("#possible").textContent = targets().length
    ? `${best ? `Best possible fitness ${num(best, 1)}.` : "Working out what can be reached."}${far ? ` ${plural(far, "target")} out of reach: the last centimetres will be missing.` : ""}${touching ? " The seedling touches an obstacle: no plant can do this task." : ""}`
    : "";
}
for (const id of ["#targets", "#others"]) {
  $(id).addEventListener("input", (event) => {
    event.target.dataset.typed = "yes";
  });
  $(id).addEventListener("change", (event) => {
    delete event.target.dataset.typed;
    const { index, key } = event.target.dataset;
    const value = Number(event.target.value);
    if (index === undefined || !Number.isFinite(value)) return;
    keep();
    const item = items[Number(index)];
    if (key === "radius") item.radius = Math.min(6, Math.max(0.1, value));
    else item.points[Math.floor(Number(key) / 2)][Number(key) % 2] = value;
    bound(item);
    drawn();
  });
  $(id).addEventListener("click", (event) => {
    const button = event.target.closest("[data-remove]");
    if (!button) return;
    remove(Number(button.dataset.remove));
    $("#add").focus();
  });
}
