// Curves of a run over the hours, and the cursor that is the same time on them, on the path and for the photograph.
// @ts-check
import { $, $$, escaped, html, lampClass, lampText, num, put } from "./studio.js";
import { WAITS, fit, line, plot, ticks } from "./figure.js";
import { markOnPath } from "./path.js";
import { answerPointer, onLook, onPoint, run, stepShown } from "./record.js";

/** Hours of the step that was taken at the number, or last before it. @param {number} number */
const hoursOf = (number) => run.steps.findLast((one) => one.number <= number)?.hours ?? 0;
/** How many hours are shown; all if it is 0. */
let span = 0;
/** The first and the last hour that are shown: around the step that is looked at. */
function shownHours() {
  const until = Math.max(1, run.steps.at(-1)?.hours ?? 0);
  if (!span || span >= until) return [0, until];
  const from = Math.min(until - span, Math.max(0, (stepShown()?.hours ?? until) - span / 2));
  return [from, from + span];
}
$("#span").onclick = ({ target }) => {
  if (target.dataset.hours === undefined) return;
  span = Number(target.dataset.hours);
  for (const button of $$("#span button")) button.setAttribute("aria-pressed", String(button === target));
  series();
  cursor();
};
/** Space left and right of the curves, in pixels. */
const [BEFORE, BEHIND] = [44, 12];
export const series = fit($("#series"), (width) => {
  if (!run.status.state) return WAITS;
  if (run.steps.length < 2) return '<p class="soft">After two photographs.</p>';
  const [from, until] = shownHours();
  const steps = run.steps.filter((one) => one.hours >= from && one.hours <= until);
  const every = Math.max(1, Math.ceil(steps.length / Math.max(200, width)));
  const kept = steps.filter((_, index) => index % every === 0 || index === steps.length - 1);
  const hours = kept.map((one) => one.hours);
  /** What `draw` makes of each stretch of steps with the same value, from one hour to another. */
  const stretches = (of, draw) => {
    let parts = "";
    for (let from = 0; from < steps.length - 1;) {
      let to = from + 1;
      while (to < steps.length - 1 && of(steps[to]) === of(steps[from])) to++;
      parts += draw(of(steps[from]), steps[from].hours, steps[to].hours);
      from = to;
    }
    return parts;
  };
  /** A rectangle between two hours. */
  const band = (X, kind, from, to, y, height) =>
    `<rect class="${kind}" x="${X(from).toFixed(1)}" y="${y}" width="${(X(to) - X(from)).toFixed(1)}" height="${height}"/>`;
  const ribbon = (X) =>
    stretches(
      (one) => one.lamp,
      (lamp, from, to) => (lamp && lamp !== "dark" ? band(X, `lit ${lampClass(lamp)}`, from, to, 0, 7) : ""),
    );
  /** The times at which a programme does not let the controller steer. */
  const nights = (X, height) =>
    stretches(
      (one) => one.isNight,
      (isNight, from, to) => (isNight ? band(X, "night", from, to, 10, height - 10) : ""),
    );
  const noted = run.events
    .filter((event) => event.kind === "note")
    .map((event) => ({ ...event, hours: hoursOf(event.step) }))
    .filter((event) => event.hours >= from && event.hours <= until);
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
      x: [from, until],
      y,
      xt: isLast ? undefined : [],
      yt: ticks(y[0], y[1], 3),
      yl,
      xl: isLast ? "hours" : "",
      m: { l: BEFORE, r: BEHIND, t: 10, b: isLast ? 38 : 8 },
      label: `${yl} from hour ${num(from, 1)} to ${num(until, 1)}, at last ${known.length ? num(known.at(-1), 2) : "unknown"}`,
      body: (X, Y) => {
        const heights = aims.map((aim) => `<path class="dotted" d="M${X(from)} ${Y(aim).toFixed(1)}H${X(until)}"/>`);
        return `${nights(X, isLast ? 102 : 104)}${ribbon(X)}${marks(X, isLast ? 102 : 104)}${heights.join("")}<path class="stroke bold" d="${line(hours, values, X, Y)}"/>`;
      },
    });
  };
  // Both go through the steps once, the one an hour behind the other.
  let behind = 0;
  /** @type {typeof kept[0] | null} */
  let before = null;
  const hourly = kept.map((now) => {
    for (; behind < run.steps.length && run.steps[behind].hours <= now.hours - 0.99; behind++)
      if (run.steps[behind].y !== null) before = run.steps[behind];
    return now.y === null || !before ? null : (now.y - before.y) / (now.hours - before.hours);
  });
  // Heights of the targets that were crossed, and of the next one: all of them would press the curve flat.
  const highest = Math.max(...kept.map((one) => one.y ?? 0));
  const aims = (run.about.targets ?? []).map((target) => target.y).sort((one, other) => one - other);
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
export function cursor() {
  const at = run.pointed ?? run.shown;
  const one = at === null ? undefined : run.steps[at];
  const width = $("#series").clientWidth;
  const line = $("#cursor");
  const [from, until] = shownHours();
  line.hidden = !one || run.steps.length < 2 || one.hours < from || one.hours > until;
  $("#read").textContent = "";
  markOnPath(one);
  if (!one) return;
  line.style.left = `${BEFORE + ((width - BEFORE - BEHIND) * (one.hours - from)) / (until - from)}px`;
  const tip = one.x === null ? "no plant found" : `x ${num(one.x, 1)}, y ${num(one.y, 1)} cm`;
  const noted = run.events.filter((event) => event.kind === "note" && event.step === one.number).map((event) => `. ${event.text}`);
  $("#read").textContent = `${num(one.hours, 1)} h: ${tip}${one.lamp ? `, ${lampText(one.lamp)}` : ""}${noted.join("")}`;
}
/** The place of the step nearest to where the pointer is. @param {PointerEvent | MouseEvent} event */
function pointedAt(event) {
  if (run.steps.length < 2) return null;
  const { left, width } = $("#series").getBoundingClientRect();
  const [from, until] = shownHours();
  const hours = from + ((event.clientX - left - BEFORE) / (width - BEFORE - BEHIND)) * (until - from);
  const after = run.steps.findIndex((one) => one.hours >= hours);
  if (after <= 0) return after === 0 ? 0 : run.steps.length - 1;
  return hours - run.steps[after - 1].hours < run.steps[after].hours - hours ? after - 1 : after;
}
answerPointer($("#time-line"), pointedAt);
onLook.push(cursor, () => span && series());
onPoint.push(cursor);

const numbers = $("#series-table").closest("details");
numbers.addEventListener("toggle", () => seriesTable());
export function seriesTable() {
  if (!numbers.open) return;
  const every = Math.max(1, Math.ceil(run.steps.length / 12));
  const kept = run.steps.filter((_, index) => index % every === 0 || index === run.steps.length - 1);
  const row = (/** @type {typeof kept[0]} */ one) =>
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

