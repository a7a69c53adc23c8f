// The numbers of a run that matter now: which lamp, when the next photograph is due, where the tip is, how fast it grows.
// @ts-check
import { $, capital, html, lampClass, mmss, now, num, put } from "./studio.js";
import { isOn, lampNow, run } from "./record.js";

function growth() {
  const last = run.steps.findLast((one) => one.y !== null);
  if (!last) return null;
  const before = run.steps.findLast((one) => one.y !== null && one.hours <= last.hours - 0.99);
  if (!before) return null;
  const hours = last.hours - before.hours;
  const of = (/** @type {"y" | "length"} */ key) => (last[key] === null || before[key] === null ? null : (last[key] - before[key]) / hours);
  return { height: of("y"), length: of("length") };
}

export function facts() {
  const last = run.steps.at(-1);
  const lamp = lampNow();
  const has = isOn() && lamp;
  const lit = run.steps.findLast((one) => one.lamp);
  const since = run.steps.findLastIndex((one) => one.lamp && one.lamp !== lamp);
  const first = run.steps[since + 1];
  const hours = last && first ? last.hours - first.hours : 0;
  const unknown = run.status.still_lit ? `${run.status.still_lit} may still be lit` : isOn() ? "not decided yet" : "off";
  const name = has
    ? html`<span class="lamp ${lampClass(lamp)}">${capital(lamp)}</span>`
    : html`<span class="lamp">${(run.status.state === "died" || run.status.state === "gone") && !run.status.still_lit ? "Unknown" : capital(unknown)}</span>`;
  const detail = has
    ? html`<span class="sub"
        >for ${num(hours, 1)} h${lit?.isConfirmed ? ", confirmed" : ", not confirmed yet"}${run.status.programme ? `; ${run.status.programme}` : ""}</span
      >`
    : "";
  put($("#lamp"), [name, detail]);
  put($("#dock-lamp"), name);
  $("#lampline").dataset.lamp = has && !run.isLost ? lampClass(lamp) : "";
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

/** How long it is until the next photograph. */
export function next() {
  const left = run.status.next_unix ? run.status.next_unix - now() : null;
  const text =
    !isOn() || run.isLost ? "–" : left === null ? "soon" : left >= 0 ? mmss(left + 0.99) : left > -10 ? "now" : `${mmss(-left)} late`;
  $("#next").textContent = text;
  $("#dock-next").textContent = text;
  $("#drop").value = left !== null && run.status.period_s ? Math.min(1, Math.max(0, 1 - left / run.status.period_s)) : 0;
}
