// A run, live: the plant first, then what happens next, then figures.
// @ts-check
import {
  $,
  $$,
  asked,
  banner,
  capital,
  chip,
  command,
  cutOff,
  escaped,
  get,
  hold,
  html,
  icon,
  insist,
  lampClass,
  lampText,
  listen,
  mmss,
  moment,
  now,
  num,
  ofBest,
  onYes,
  plural,
  post,
  put,
  refuse,
  say,
  size,
  span,
  toast,
  trusted,
  virtual,
  wordOf,
} from "./studio.js";
import { cross, fit, lampPath, line, plot, ticks, wantedLine } from "./figure.js";
import { keep } from "./keep.js";
import { shape } from "./obstacle.js";

const at = asked.get("at") ?? "";

/**
 * A step, from a row that the server sends.
 * @param {any[]} row
 */
const step = ([number, hours, x, y, length, lamp, confirmed, isCarried, status, confidence, unix, photo, px, py, v, steered]) => ({
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

/** @type {ReturnType<typeof step>[]} */
let steps = [];
/** @type {any[]} */
let events = [];
/** @type {any} */
let status = {};
/** @type {any} */
let about = {};
/** @type {any} */
let prediction;
/** Why there is none. */
let unpredicted = "";
/** Place of the photograph that is shown; the latest one if it is `null`. @type {number | null} */
let shown = null;
let hasOverlay = true;
/** Tells the run from another in its folder. */
let identity = "";
let isThere = true;
let lostFor = 0;
let isLost = false;
let film = 0;
/** @type {Map<number, [number, number][] | null>} */
const stems = new Map();

const isOn = () => status.state === "live" || status.state === "overdue";
const place = () => shown ?? steps.length - 1;
const lampNow = () => steps.findLast((one) => one.lamp)?.lamp ?? null;
const photoOf = (one, isSmall) =>
  `api/run/photo?${new URLSearchParams({ at, name: one.photo, v: one.v, ...(isSmall ? { small: "true" } : {}) })}`;
const when = (one) => (one.unix ? moment(one.unix) : `${num(one.hours, 1)} h`);

// The photograph and what is drawn over it.
function overlay() {
  const one = steps[place()];
  if (!one || !hasOverlay || !one.photo) return "";
  const marks = (about.targets ?? [])
    .filter((target) => target.px)
    .map(({ px: [x, y] }, index) => {
      const lines = `M${x - 8} ${y - 8}l16 16m0-16l-16 16`;
      return `<path class="dark" d="${lines}"/><path class="ring" d="${lines}"/><text x="${x}" y="${y - 14}">${index + 1}</text>`;
    });
  const pixels = (about.line ?? []).filter((point) => point.px).map((point) => point.px.join(" "));
  const wanted = pixels.length ? `<path class="wanted" d="M${pixels.join("L")}"/>` : "";
  const crop = about.crop;
  const region = crop ? `<rect class="region" x="${crop[0]}" y="${crop[1]}" width="${crop[2]}" height="${crop[3]}"/>` : "";
  const past = steps.slice(0, place() + 1).filter((past) => past.px !== null);
  const trail = lampPath(
    past.map((past) => ({ x: past.px, y: past.py, lamp: past.lamp })),
    (x) => x,
    (y) => y,
    "trail",
  )
    .replaceAll("stroke trail", "trail")
    .replaceAll("quiet", "other");
  const stem = stems.get(one.number);
  const stemLine = stem ? `<path class="stem" d="M${stem.map((point) => point.join(" ")).join("L")}"/>` : "";
  const tip =
    one.px === null
      ? ""
      : `<circle class="dark" cx="${one.px}" cy="${one.py}" r="11"/><circle class="ring ${one.isCarriedForward ? "carried_forward" : ""}" cx="${one.px}" cy="${one.py}" r="11"/>`;
  return region + wanted + trail + stemLine + marks.join("") + tip;
}

let stemTimer = 0;
function wantStem() {
  const one = steps[place()];
  if (!one || !hasOverlay || stems.has(one.number)) return;
  clearTimeout(stemTimer);
  stemTimer = setTimeout(async () => {
    const { stem } = await get("api/run/stem", { at, step: one.number }).catch(() => ({ stem: null }));
    stems.set(one.number, stem);
    if (steps[place()]?.number === one.number) put($("#over"), trusted(overlay()));
  }, 120);
}

/** Whether the photograph that is shown could not be loaded. */
const isMissing = () => $("#img").dataset.failed !== undefined && $("#img").dataset.of === $("#img").getAttribute("src");

function photograph() {
  const one = steps[place()];
  const image = $("#img");
  const latest = shown === null;
  $("#no-photo").hidden = Boolean(one?.photo) && !isMissing();
  image.hidden = !one?.photo;
  if (one?.photo) {
    const source = photoOf(one, false);
    if (image.getAttribute("src") !== source) image.src = source;
    const side = one.lamp ? ` Lit next: ${lampText(one.lamp)}.` : "";
    image.alt =
      one.x === null
        ? `Step ${one.number}: no plant found.`
        : `Step ${one.number}: the tip is at ${num(one.x, 1)}, ${num(one.y, 1)} cm.${side}`;
  }
  $("#no-photo").textContent = one?.photo
    ? "This photograph could not be loaded."
    : one
      ? "The camera gave no photograph at this step."
      : "No photograph yet.";
  put($("#over"), trusted(overlay()));
  wantStem();
  $("#frame").textContent = one?.photo ?? "";
  $("#note-about").textContent = latest || !one ? "now" : `step ${one.number}, ${when(one)}`;
  $("#where").textContent = latest
    ? "latest photograph"
    : `step ${one.number}, ${when(one)}${one.lamp ? `, then ${lampText(one.lamp)}` : ""}`;
  const scrub = $("#scrub");
  scrub.max = String(Math.max(0, steps.length - 1));
  scrub.value = String(place());
  scrub.setAttribute("aria-valuetext", one ? `step ${one.number}, ${when(one)}` : "none");
  for (const button of $$("#strip button")) {
    button.setAttribute("aria-pressed", String(button.dataset.from <= place() && place() < button.dataset.to));
  }
  tick();
}

let stripped = "";
function strip() {
  const count = Math.min(innerWidth < 600 ? 5 : 9, steps.length);
  const marks = Array.from({ length: count }, (_, index) => Math.round((index * (steps.length - 1)) / Math.max(1, count - 1)));
  // A strip that changed with every photograph would load all small ones anew: it grows by eighths.
  const key = `${count} ${Math.floor(Math.log2(Math.max(1, steps.length)) * 8)}`;
  if (key === stripped) return;
  stripped = key;
  const button = (mark, index) => {
    const one = steps[mark];
    const to = marks[index + 1] ?? 1e9;
    const picture = one.photo ? html`<img src="${photoOf(one, true)}" alt="" loading="lazy" />` : "";
    return html`<button type="button" data-from="${mark}" data-to="${to}" aria-label="Step ${one.number}, ${when(one)}">
      ${picture}
    </button>`;
  };
  put($("#strip"), marks.map(button));
}

// The small photographs come after the large one.
$("#img").addEventListener("load", strip);
for (const event of ["load", "error"])
  $("#img").addEventListener(event, () => {
    // After the handler of all images.
    queueMicrotask(() => {
      $("#no-photo").hidden = Boolean(steps[place()]?.photo) && !isMissing();
      health();
    });
  });

/** @param {number | null} to */
function show(to) {
  shown = to === null || to >= steps.length - 1 ? null : Math.max(0, to);
  photograph();
  cursor();
}

function stopFilm() {
  clearInterval(film);
  film = 0;
  $("#film span").textContent = "Film";
}

$("#strip").onclick = (event) => {
  const button = event.target.closest("button");
  if (button) show(Number(button.dataset.from));
};
$("#scrub").oninput = (event) => show(Number(event.target.value));
$("#back").onclick = () => show(place() - 1);
$("#forth").onclick = () => show(place() + 1);
$("#latest").onclick = () => {
  stopFilm();
  show(null);
};
$("#overlay").onclick = () => {
  hasOverlay = !hasOverlay;
  $("#overlay").setAttribute("aria-pressed", String(hasOverlay));
  photograph();
};
/** @param {boolean} is */
const nearer = (is) => {
  $("#photo").classList.toggle("near", is);
  $("#near").setAttribute("aria-pressed", String(is));
};
$("#near").onclick = () => nearer(!$("#photo").classList.contains("near"));
nearer(innerWidth < 600);
$("#film").onclick = () => {
  if (film) return stopFilm();
  if (shown === null) show(0);
  $("#film span").textContent = "Pause";
  const stride = Math.max(1, Math.round(steps.length / 300));
  const go = () => {
    // The next picture is shown when this one is there: a slow network makes a slower film, not a torn one.
    if (!$("#img").complete) return;
    show(place() + stride);
    if (shown === null) stopFilm();
  };
  film = setInterval(go, 80);
};

// Facts.
function growth() {
  const last = steps.findLast((one) => one.y !== null);
  if (!last) return null;
  const before = steps.findLast((one) => one.y !== null && one.hours <= last.hours - 0.99);
  if (!before) return null;
  const hours = last.hours - before.hours;
  const of = (key) => (last[key] === null || before[key] === null ? null : (last[key] - before[key]) / hours);
  return { height: of("y"), length: of("length") };
}

function facts() {
  const last = steps.at(-1);
  const lamp = lampNow();
  const has = isOn() && lamp;
  const lit = steps.findLast((one) => one.lamp);
  const since = steps.findLastIndex((one) => one.lamp && one.lamp !== lamp);
  const first = steps[since + 1];
  const hours = last && first ? last.hours - first.hours : 0;
  const unknown = status.still_lit ? `${status.still_lit} may still be lit` : isOn() ? "not decided yet" : "off";
  const name = has
    ? html`<span class="lamp ${lampClass(lamp)}">${capital(lamp)}</span>`
    : html`<span class="lamp">${(status.state === "died" || status.state === "gone") && !status.still_lit ? "Unknown" : capital(unknown)}</span>`;
  const detail = has
    ? html`<span class="sub"
        >for ${num(hours, 1)} h${lit?.isConfirmed ? ", confirmed" : ", not confirmed yet"}${status.programme ? `; ${status.programme}` : ""}</span
      >`
    : "";
  put($("#lamp"), [name, detail]);
  put($("#dock-lamp"), name);
  $("#lampline").dataset.lamp = has && !isLost ? lampClass(lamp) : "";
  const tip =
    last && last.x !== null
      ? html`${num(last.x, 1)}, ${num(last.y, 1)} <small>cm</small
          ><span class="sub"
            >${last.isCarriedForward ? html`<b>kept</b>: not found in the photograph` : `measured, confidence ${num(last.confidence, 2)}`}</span
          >`
      : "–";
  put($("#tip"), tip);
  const grown = growth();
  put(
    $("#growth"),
    grown
      ? html`${num(grown.height, 2)} <small>cm/h</small
          ><span class="sub">in height${grown.length === null ? "" : `, ${num(grown.length, 2)} in length`}</span>`
      : html`–<span class="sub">after the first hour</span>`,
  );
}

// Curves.
/** Hours of the step that was taken at the number, or last before it. @param {number} number */
const hoursOf = (number) => steps.findLast((one) => one.number <= number)?.hours ?? 0;
/** Space left and right of the curves, in pixels. */
const [BEFORE, BEHIND] = [44, 12];
const series = fit($("#series"), (width) => {
  if (steps.length < 2) return '<p class="soft">After two photographs.</p>';
  const every = Math.max(1, Math.ceil(steps.length / Math.max(200, width)));
  const kept = steps.filter((_, index) => index % every === 0 || index === steps.length - 1);
  const hours = kept.map((one) => one.hours);
  const until = Math.max(1, steps.at(-1).hours);
  const ribbon = (X) => {
    let parts = "";
    for (let from = 0; from < steps.length - 1;) {
      let to = from + 1;
      while (to < steps.length - 1 && steps[to].lamp === steps[from].lamp) to++;
      const lamp = steps[from].lamp;
      if (lamp && lamp !== "dark")
        parts += `<rect class="lit ${lampClass(lamp)}" x="${X(steps[from].hours).toFixed(1)}" y="0" width="${(X(steps[to].hours) - X(steps[from].hours)).toFixed(1)}" height="7"/>`;
      from = to;
    }
    return parts;
  };
  /** The times at which a programme does not let the controller steer. */
  const nights = (X, height) => {
    let parts = "";
    for (let from = 0; from < steps.length - 1;) {
      let to = from + 1;
      while (to < steps.length - 1 && steps[to].isNight === steps[from].isNight) to++;
      const [left, right] = [X(steps[from].hours), X(steps[to].hours)];
      if (steps[from].isNight)
        parts += `<rect class="night" x="${left.toFixed(1)}" y="10" width="${(right - left).toFixed(1)}" height="${height - 10}"/>`;
      from = to;
    }
    return parts;
  };
  const noted = events.filter((event) => event.kind === "note").map((event) => ({ ...event, hours: hoursOf(event.step) }));
  const marks = (X, height) =>
    noted
      .map(({ hours, text }) => `<path class="noted" d="M${X(hours).toFixed(1)} 8V${height}"><title>${escaped(text)}</title></path>`)
      .join("");
  const one = (values, yl, isLast, aims = []) => {
    const known = values.filter((value) => value !== null);
    let [low, high] = [Math.min(...known, ...aims), Math.max(...known, ...aims)];
    if (!known.length) [low, high] = [0, 1];
    const margin = Math.max(0.2, (high - low) * 0.1);
    const y = /** @type {[number, number]} */ ([low - margin, high + margin]);
    return plot({
      w: width,
      h: isLast ? 140 : 112,
      x: [0, until],
      y,
      xt: isLast ? undefined : [],
      yt: ticks(y[0], y[1], 3),
      yl,
      xl: isLast ? "hours" : "",
      m: { l: BEFORE, r: BEHIND, t: 10, b: isLast ? 38 : 8 },
      label: `${yl} over ${num(until, 1)} hours, now ${known.length ? num(known.at(-1), 2) : "unknown"}`,
      body: (X, Y) => {
        const heights = aims.map((aim) => `<path class="dotted" d="M${X(0)} ${Y(aim).toFixed(1)}H${X(until)}"/>`);
        return `${nights(X, isLast ? 102 : 104)}${ribbon(X)}${marks(X, isLast ? 102 : 104)}${heights.join("")}<path class="stroke bold" d="${line(hours, values, X, Y)}"/>`;
      },
    });
  };
  // Both go through the steps once, the one an hour behind the other.
  let behind = 0;
  /** @type {any} */
  let before = null;
  const hourly = kept.map((now) => {
    for (; behind < steps.length && steps[behind].hours <= now.hours - 0.99; behind++)
      if (steps[behind].y !== null) before = steps[behind];
    return now.y === null || !before ? null : (now.y - before.y) / (now.hours - before.hours);
  });
  // Heights of the targets that were crossed, and of the next one: all of them would press the curve flat.
  const highest = Math.max(...kept.map((one) => one.y ?? 0));
  const aims = (about.targets ?? []).map((target) => target.y).sort((one, other) => one - other);
  const next = aims.findIndex((y) => y > highest);
  const heights = next < 0 ? aims : aims.slice(0, next + 1);
  return (
    one(
      kept.map((one) => one.x),
      "x (cm)",
    ) +
    one(
      kept.map((one) => one.y),
      "y (cm)",
      false,
      heights,
    ) +
    one(hourly, "cm/h", true)
  );
});

// One time for photograph, path and curves: that of the step that is shown, or that the pointer is on.
/** Place of the step under the pointer. @type {number | null} */
let pointed = null;
/** Scales of the path, once it is drawn. @type {[(x: number) => number, (y: number) => number] | null} */
let onPath = null;
function cursor() {
  const at = pointed ?? shown;
  const one = at === null ? undefined : steps[at];
  const width = $("#series").clientWidth;
  const line = $("#cursor");
  line.hidden = !one || steps.length < 2;
  $("#read").textContent = "";
  $("#on-path")?.remove();
  if (!one) return;
  const until = Math.max(1, steps.at(-1)?.hours ?? 0);
  line.style.left = `${BEFORE + ((width - BEFORE - BEHIND) * one.hours) / until}px`;
  const tip = one.x === null ? "no plant found" : `x ${num(one.x, 1)}, y ${num(one.y, 1)} cm`;
  const noted = events.filter((event) => event.kind === "note" && event.step === one.number).map((event) => `. ${event.text}`);
  $("#read").textContent = `${num(one.hours, 1)} h: ${tip}${one.lamp ? `, ${lampText(one.lamp)}` : ""}${noted.join("")}`;
  if (one.x === null || !onPath) return;
  const [X, Y] = onPath;
  $("#path svg")?.insertAdjacentHTML("beforeend", `<circle class="ring" id="on-path" cx="${X(one.x)}" cy="${Y(one.y)}" r="9"/>`);
}
/** The place of the step nearest to where the pointer is. @param {PointerEvent} event */
function pointedAt(event) {
  const { left, width } = $("#series").getBoundingClientRect();
  const until = Math.max(1, steps.at(-1)?.hours ?? 0);
  const hours = ((event.clientX - left - BEFORE) / (width - BEFORE - BEHIND)) * until;
  const after = steps.findIndex((one) => one.hours >= hours);
  if (after <= 0) return after === 0 ? 0 : steps.length - 1;
  return hours - steps[after - 1].hours < steps[after].hours - hours ? after - 1 : after;
}
const timeLine = $("#time-line");
timeLine.addEventListener("pointermove", (event) => {
  if (steps.length < 2) return;
  pointed = pointedAt(event);
  cursor();
});
timeLine.addEventListener("pointerleave", () => {
  pointed = null;
  cursor();
});
timeLine.addEventListener("click", (event) => {
  if (steps.length > 1) show(pointedAt(event));
});

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
  steps.forEach((one, place) => {
    if (one.x === null) return;
    const apart = Math.hypot(X(one.x) - event.clientX + left, Y(one.y) - event.clientY + top);
    if (apart < least) [nearest, least] = [place, apart];
  });
  return nearest;
}
$("#path").addEventListener("pointermove", (event) => {
  const at = nearestOnPath(event);
  if (at === pointed) return;
  pointed = at;
  cursor();
});
$("#path").addEventListener("pointerleave", () => {
  pointed = null;
  cursor();
});
$("#path").addEventListener("click", (event) => {
  const at = nearestOnPath(event);
  if (at !== null) show(at);
});

const numbers = $("#series-table").closest("details");
numbers.addEventListener("toggle", () => seriesTable());
function seriesTable() {
  if (!numbers.open) return;
  const every = Math.max(1, Math.ceil(steps.length / 12));
  const kept = steps.filter((_, index) => index % every === 0 || index === steps.length - 1);
  const row = (one) =>
    html`<tr>
      <th scope="row">${one.number}</th>
      <td class="n">${num(one.hours, 1)}</td>
      <td class="n">${one.x === null ? "–" : num(one.x, 1)}</td>
      <td class="n">${one.y === null ? "–" : num(one.y, 1)}</td>
      <td>${one.lamp ?? ""}</td>
    </tr>`;
  put(
    $("#series-table"),
    html`<thead>
        <tr>
          <th scope="col">Step</th>
          <th scope="col" class="n">Hours</th>
          <th scope="col" class="n">x (cm)</th>
          <th scope="col" class="n">y (cm)</th>
          <th scope="col">Lamp</th>
        </tr>
      </thead>
      <tbody>
        ${kept.map(row)}
      </tbody>`,
  );
}

/** How far beside each target the tip crossed its height. @param {any[]} crossings */
const besides = (crossings) =>
  crossings
    .map((crossed, index) => (crossed ? `${num(crossed.beside, 1)} cm beside target ${index + 1}` : `target ${index + 1} not yet`))
    .join(", ");

const path = fit($("#path"), (width) => {
  const targets = about.targets ?? [];
  const seen = steps.filter((one) => one.x !== null);
  const aim = about.line ?? [];
  const goals = [...targets, ...aim];
  const xs = [...seen.map((one) => one.x), ...goals.map((goal) => goal.x)];
  const ys = [...seen.map((one) => one.y), ...goals.map((goal) => goal.y)];
  const reach = Math.max(8, ...xs.map(Math.abs)) + 0.5;
  const low = Math.min(4, ...ys) - 0.3;
  const high = Math.max(low + 6, about.end_height ?? 0, ...ys) + 0.7;
  const height = Math.min(460, Math.max(240, (width * (high - low)) / (2 * reach)));
  const sentence = seen.length
    ? `Path of the tip, now at ${num(seen.at(-1).x, 1)}, ${num(seen.at(-1).y, 1)} cm${targets.length ? `; ${besides(status.crossings ?? [])}` : ""}.`
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
      const fan = (prediction?.paths ?? []).map(
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
      const obstacles = (about.obstacles ?? []).map((obstacle) => shape(obstacle, X, Y));
      return (
        form +
        obstacles.join("") +
        heights.join("") +
        fan.join("") +
        lampPath(seen, X, Y) +
        first +
        tip +
        targets.map((target, index) => cross(X(target.x), Y(target.y), index + 1)).join("")
      );
    },
  });
});

function targets() {
  const all = about.targets ?? [];
  const isForm = Boolean(status.off);
  $("#targets-scroll").hidden = all.length === 0 && !isForm;
  showEvents();
  if (isForm) return form();
  if (!all.length) return;
  const row = (target, index) => {
    const crossed = status.crossings?.[index];
    const name = html`<th scope="row" class="num">${index + 1} &nbsp;${num(target.x, 1)}, ${num(target.y, 1)}</th>`;
    if (crossed)
      return html`<tr>
        ${name}
        <td>at step ${crossed.step}, after ${num(crossed.hours, 1)} h</td>
        <td class="n">${num(crossed.beside, 1)}</td>
      </tr>`;
    const expected = isOn() && prediction?.targets?.find((one) => one.y === target.y);
    if (expected?.hours)
      return html`<tr>
        ${name}
        <td>in ${num(expected.hours[0], 1)} to ${num(expected.hours[1], 1)} h</td>
        <td class="n">${num(expected.beside[0], 1)} to ${num(expected.beside[1], 1)}</td>
      </tr>`;
    return html`<tr>
      ${name}
      <td>not yet</td>
      <td class="n">–</td>
    </tr>`;
  };
  put(
    $("#targets"),
    html`<thead>
        <tr>
          <th scope="col">Target</th>
          <th scope="col">Crosses its height</th>
          <th scope="col" class="n">Beside it (cm)</th>
        </tr>
      </thead>
      <tbody>
        ${all.map(row)}
      </tbody>`,
  );
}

/** A form of the stem: how far off it is now, and when it counts. */
function form() {
  const { now: own, end } = status.off;
  const height = steps.findLast((one) => one.y !== null);
  const expected = isOn() && prediction?.form;
  const value = (one) => (one === null || one === undefined ? "–" : num(one, 1));
  const between = (range) => `${num(range[0], 1)} to ${num(range[1], 1)}`;
  const when = end ? `at step ${end.step}, after ${num(end.hours, 1)} h` : expected?.hours ? `in ${between(expected.hours)} h` : "not yet";
  put(
    $("#targets"),
    html`<thead>
        <tr>
          <th scope="col">Form of the stem</th>
          <th scope="col">Counts</th>
          <th scope="col" class="n">Off (cm)</th>
        </tr>
      </thead>
      <tbody>
        <tr>
          <th scope="row">now</th>
          <td>${height ? `tip at ${num(height.y, 1)} cm` : "not yet"}</td>
          <td class="n">${value(own)}</td>
        </tr>
        <tr>
          <th scope="row">at ${num(about.end_height ?? 0, 1)} cm</th>
          <td>${when}</td>
          <td class="n">${end ? value(end.off) : expected?.off ? between(expected.off) : "–"}</td>
        </tr>
      </tbody>`,
  );
}

/** Says what is expected, or why nothing is. */
function showEvents() {
  $("#fan-key").hidden = !isOn() || !prediction;
  const text = () => {
    if (!isOn()) return "";
    if (!prediction) return unpredicted && `No prediction: ${unpredicted}.`;
    const { plants, model, form: reached, goes_through: isLoose } = prediction;
    const done = reached ? ` ${reached.done} of ${plants} come within ${num(about.within ?? 0, 1)} cm.` : "";
    const loose = isLoose ? " Nothing holds a stem back in the model: it goes through obstacles." : "";
    return `From ${plants} plants that go on in ${model} from what was seen so far, under the run’s controller: the range of eight in ten.${done}${loose} A guess, not a promise.`;
  };
  $("#predicted").textContent = text();
}

/** What is expected takes the server a while: what is known comes first. */
const PREDICTS_AFTER_MS = 1500;

async function predict() {
  if (!isOn() || steps.length < 2) return;
  try {
    prediction = await get("api/run/prediction", { at });
    unpredicted = "";
  } catch (error) {
    prediction = undefined;
    unpredicted = wordOf(error).replace(/\.$/, "");
  }
  path();
  targets();
}

// Health.
function health() {
  const missing = isMissing() ? steps[place()] : undefined;
  const isGood = status.health === "good" && !missing;
  put(
    $("#health"),
    html`<span class="chip ${isGood ? "" : "warn"}"
      >${icon(isGood ? "done" : "warn")}${missing ? "photograph missing" : isGood ? "all checks pass" : "look here"}</span
    >`,
  );
  // What says the same again and again is shown once, with a count.
  const listed = missing
    ? [{ kind: "missing", is_warning: true, count: 1, step: missing.number, says: "This photograph could not be loaded.", todo: "Look whether its file is there, and at the network." }]
    : [];
  for (const event of [...events].reverse()) {
    const same = listed.at(-1);
    if (same && same.kind === event.kind && event.kind !== "note") same.count++;
    else listed.push({ ...event, count: 1 });
  }
  const item = (event) =>
    html`<li class="event">
      ${icon(event.kind === "note" ? "pen" : event.is_warning ? "warn" : event.kind === "recovered" || event.kind === "finished" ? "done" : "info")}
      <span>${event.kind === "note" ? event.text : event.says}${event.count > 1 ? ` ${event.count} times in a row.` : ""}</span>
      <time>${event.unix ? `${moment(event.unix)}, ` : ""}step ${event.step}</time>
      ${event.todo ? html`<span class="todo"><b>${event.todo}</b></span>` : ""}
      ${event.text && event.todo ? html`<span class="todo">${event.text}</span>` : ""}
    </li>`;
  put($("#events"), listed.length ? listed.slice(0, 12).map(item) : html`<li class="soft">Nothing happened yet.</li>`);
  const row = (name, value) =>
    html`<tr>
      <th scope="row">${name}</th>
      <td class="n">${value}</td>
    </tr>`;
  put(
    $("#numbers"),
    html`<tbody>
      ${row("Photographs", `${steps.length}, ${status.carried_forward ?? 0} without plant`)}
      ${row("Lamps confirmed", `${steps.filter((one) => one.isConfirmed).length} of ${steps.filter((one) => one.lamp).length}`)}
      ${row("Late steps", status.counts?.late ?? 0)} ${row("Missed steps", status.counts?.missed ?? 0)}
      ${row("Size of the photographs", size(status.bytes ?? 0))}
      ${status.disk_gb === null || status.disk_gb === undefined ? "" : row("Room on the disk", `${status.disk_gb} GB${status.disk_days ? `, enough for ${span(status.disk_days * 86_400)}` : ""}`)}
      ${row("Process", status.process ? `${status.process}, at work` : "none")}
    </tbody>`,
  );
}

let keptAs = "";
/** What can be kept of the run, once its name is known, and again when it is over. */
function keepAbout() {
  const isOver = status.state === "over";
  if (!about.name || keptAs === String(isOver)) return;
  keptAs = String(isOver);
  keep("run", at, { name: about.name, isOver });
}

// What state the run is in, and what to do.
function state() {
  keepAbout();
  const last = steps.at(-1);
  const resume = (primary) =>
    html`<button class="btn ${primary ? "primary" : ""} change" type="button" id="resume">
      Resume from step ${last ? last.number + 1 : 0}
    </button>`;
  const word = status.state;
  /** @type {any} */
  let what = "";
  if (isLost) {
    what = cutOff(
      lostFor,
      html`The run itself goes on: it does not need this page. To stop it meanwhile, at its computer:
        <code>${about.commands?.stop ?? "tropism stop"}</code>`,
    );
  } else if (word === "gone") {
    what = banner(
      "bad",
      "alert",
      html`<strong>This run is not here any more.</strong> Its folder was deleted, renamed or moved since this page was opened;
        what you see is the last that was known. A renamed run is in the <a href="./">overview</a>.`,
    );
  } else if (word === "overdue") {
    what = banner(
      "",
      "status",
      html`<strong>The photograph is late.</strong> The camera does not answer; the run keeps trying. Look at the camera’s cable
        and network.`,
    );
  } else if (word === "died") {
    const lit = status.still_lit ? html` <b>The ${status.still_lit} lamp may still be lit</b>: use Safe state.` : "";
    what = banner(
      "bad",
      "alert",
      html`<strong>The run’s process is gone.</strong> It did not say goodbye: a kill, a crash or a power cut. All ${steps.length}
        steps are on the disk.${lit}`,
      resume(true),
    );
  } else if (word === "stopped") {
    what = banner(
      "calm",
      "status",
      html`<strong>Stopped in order${last ? ` at step ${last.number}` : ""}.</strong> Lamps and flash are off: the plant stands in
        the dark.`,
      resume(true),
    );
  } else if (word === "paused") {
    what = banner(
      "",
      "status",
      html`<strong>The run waits for you.</strong> ${events.findLast((event) => event.kind === "paused")?.text ?? ""}`,
      resume(true),
    );
  } else if (word === "over") {
    const fitness =
      status.fitness === null || status.fitness === undefined
        ? ""
        : ` Fitness ${num(status.fitness)}${ofBest(about.best)} ${about.unit}.`;
    what = banner("calm", "status", html`<strong>The run is over.</strong>${fitness}`);
  } else if (word === "live" && !steps.length) {
    what = banner("calm", "status", html`<strong>No photograph yet.</strong> The first one comes soon.`);
  }
  put($("#banner"), what);
  put($("#state"), [
    chip(word ?? "waiting", word === "live" && !steps.length ? "Starting" : undefined),
    about.is_virtual ? virtual("virtual bean") : "",
  ]);
  for (const button of $$(".stop")) button.setAttribute("aria-disabled", String(!isOn() || isLost));
  for (const button of $$(".safe")) button.setAttribute("aria-disabled", String(isLost || word === "gone"));
  $("#ask-button").hidden = !isOn();
  const hasDock = word !== "over" && word !== "gone";
  $("#dock").hidden = !hasDock;
  document.body.classList.toggle("has-dock", hasDock);
}

/** What changes by itself, once a second. */
function tick() {
  const latest = shown === null;
  const taken = status.photo_unix;
  const one = steps[place()];
  $("#age").textContent = !one ? "" : latest && taken ? `taken ${mmss(Math.max(0, now() - taken))} ago` : when(one);
  const photo = $("#photo");
  const isOld = latest && taken && isOn() && status.next_unix && now() > status.next_unix + Math.max(15, status.period_s ?? 0);
  const stale = isLost
    ? `Old: last heard ${span(lostFor)} ago`
    : isOld
      ? `Old: taken ${mmss(now() - taken)} ago, due ${mmss(now() - status.next_unix)} ago`
      : status.state === "died"
        ? "The last one before the run ended"
        : "";
  photo.classList.toggle("stale", Boolean(stale));
  photo.dataset.stale = stale;
  const left = status.next_unix ? status.next_unix - now() : null;
  const next =
    !isOn() || isLost ? "–" : left === null ? "soon" : left >= 0 ? mmss(left + 0.99) : left > -10 ? "now" : `${mmss(-left)} late`;
  $("#next").textContent = next;
  $("#dock-next").textContent = next;
  $("#drop").value = left !== null && status.period_s ? Math.min(1, Math.max(0, 1 - left / status.period_s)) : 0;
}

const PARTS = [state, photograph, facts, path, series, cursor, targets, health, strip, seriesTable];
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

// Changes.
async function stop() {
  try {
    toast("Stopping: the step that is under way is finished.");
    const { has_ended: hasEnded } = await insist("api/run/stop", { at }, "The stop");
    if (!hasEnded) toast("The run was asked to stop. Its step is not finished yet.");
  } catch (error) {
    say(error);
  }
}
for (const button of $$(".stop")) hold(button, stop, () => toast("Hold it for a second and a half."));
for (const button of $$(".safe")) {
  button.onclick = async () => {
    if (button.getAttribute("aria-disabled") === "true") return;
    try {
      const { devices, is_virtual: isVirtual } = await insist("api/run/safe-state", { at }, "Safe state");
      const failed = devices.filter((device) => !device.is_off);
      toast(
        isVirtual
          ? "The lamps are virtual: there is nothing to switch off."
          : failed.length
            ? `Not off: ${failed.map((device) => `${device.device}, ${device.problem}`).join("; ")}`
            : "Lamps and flash are off.",
      );
    } catch (error) {
      say(error);
    }
  };
}
$("#note").onsubmit = async (event) => {
  event.preventDefault();
  const field = $("#note-text");
  const about = shown === null ? null : steps[shown].number;
  try {
    const { is_waiting: isWaiting } = await post("api/run/note", { at, text: field.value.trim(), step: about });
    toast(isWaiting ? "The run writes it down within seconds." : "Noted.");
    field.value = "";
  } catch (error) {
    say(error);
  }
};
$("#ask-button").onclick = () => $("#ask").showModal();
onYes($("#ask"), stop);
$("#banner").onclick = async (event) => {
  if (event.target.id !== "resume") return;
  event.target.disabled = true;
  await post("api/run/resume", { at }).then(() => toast("It goes on."), say);
};

// Both are asked for at once: neither waits for the other.
listen(
  "run",
  at,
  (data) => {
    const isFirst = !steps.length;
    // Another run lies in the folder now: nothing of the one before is kept.
    if (data.status.identity && identity && data.status.identity !== identity) return location.reload();
    identity = data.status.identity ?? identity;
    steps = [...steps.slice(0, data.from), ...data.rows.map(step)];
    events = [...events.slice(0, data.events_from), ...data.events];
    status = data.status;
    if (shown !== null && shown >= steps.length) shown = null;
    if (isFirst) PARTS.filter((part) => part !== strip).forEach((part) => part());
    else all();
    if (isFirst) setTimeout(predict, PREDICTS_AFTER_MS);
  },
  (is, seconds) => {
    [isLost, lostFor] = [is, seconds];
    state();
    facts();
    tick();
  },
  () => {
    isThere = false;
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
  about = known;
  $("#name").textContent = about.name;
  $("#path-title").textContent = about.line.length ? "Path and form" : about.targets.length ? "Path and targets" : "Path";
  document.title = `${about.name} · tropism studio`;
  if (about.width) $("#over").setAttribute("viewBox", `0 0 ${about.width} ${about.height}`);
  if (about.width) $("#photo").style.aspectRatio = `${about.width} / ${about.height}`;
  put(
    $("#about"),
    html`Steered by ${about.controller}, ${num(about.period_min, about.period_min % 1 ? 1 : 0)} min a step, at most
    ${plural(about.max_steps, "step")}.`,
  );
  keepAbout();
  put($("#commands"), [command(about.commands.status), command(about.commands.stop), command(about.commands.resume)]);
  all();
}, (error) => isThere && refuse(error));
