// How a run is: checks, what happened, and notes.
// @ts-check
import { $, folded, html, icon, moment, post, put, say, size, span, toast } from "./studio.js";
import { isMissing } from "./photograph.js";
import { at, run, stepShown } from "./record.js";

export function health() {
  const missing = isMissing() ? stepShown() : undefined;
  const isGood = run.status.health === "good" && !missing;
  put(
    $("#health"),
    html`<span class="chip ${isGood ? "" : "warn"}"
      >${icon(isGood ? "done" : "warn")}${missing ? "photograph missing" : isGood ? "all checks pass" : "look here"}</span
    >`,
  );
  // What says the same again and again is shown once, with a count.
  /** @type {(import("./types.d.ts").ShownEvent & { count: number })[]} */
  const listed = [];
  if (missing)
    listed.push({ kind: "missing", is_warning: true, count: 1, step: missing.number, says: "This photograph could not be loaded.", todo: "Look whether its file is there, and at the network.", text: "", unix: null });
  for (const event of [...run.events].reverse()) {
    const same = listed.at(-1);
    if (same && same.kind === event.kind && event.kind !== "note") same.count++;
    else listed.push({ ...event, count: 1 });
  }
  const item = (/** @type {typeof listed[0]} */ event) =>
    html`<li class="event">
      ${icon(event.kind === "note" ? "pen" : event.is_warning ? "warn" : event.kind === "recovered" || event.kind === "finished" ? "done" : "info")}
      <span>${event.kind === "note" ? event.text : event.says}${event.count > 1 ? ` ${event.count} times in a row.` : ""}</span>
      <time>${event.unix ? `${moment(event.unix)}, ` : ""}step ${event.step}</time>
      ${event.todo ? html`<span class="todo"><b>${event.todo}</b></span>` : ""}
      ${event.text && event.todo ? html`<div class="todo">${folded(event.text)}</div>` : ""}
    </li>`;
  put($("#events"), listed.length ? listed.slice(0, 12).map(item) : html`<li class="soft">Nothing happened yet.</li>`);
  const row = (/** @type {string} */ name, /** @type {string | number} */ value) =>
    html`<tr>
      <th scope="row">${name}</th>
      <td class="n">${value}</td>
    </tr>`;
  put(
    $("#numbers"),
    html`<tbody>
      ${row("Photographs", `${run.steps.length}, ${run.status.carried_forward ?? 0} without plant`)}
      ${row("Lamps confirmed", `${run.steps.filter((one) => one.isConfirmed).length} of ${run.steps.filter((one) => one.lamp).length}`)}
      ${row("Late steps", run.status.counts?.late ?? 0)} ${row("Missed steps", run.status.counts?.missed ?? 0)}
      ${row("Size of the photographs", size(run.status.bytes ?? 0))}
      ${run.status.disk_gb === null || run.status.disk_gb === undefined ? "" : row("Room on the disk", `${run.status.disk_gb} GB${run.status.disk_days ? `, enough for ${span(run.status.disk_days * 86_400)}` : ""}`)}
      ${row("Process", run.status.process ? `${run.status.process}, at work` : "none")}
    </tbody>`,
  );
}
for (const event of ["load", "error"]) $("#img").addEventListener(event, () => queueMicrotask(health));

$("#note").onsubmit = async (event) => {
  event.preventDefault();
  const field = $("#note-text");
  const step = run.shown === null ? null : run.steps[run.shown].number;
  try {
    const { is_waiting: isWaiting } = await post("api/run/note", { at, text: field.value.trim(), step });
    toast(isWaiting ? "The run writes it down within seconds." : "Noted.");
    field.value = "";
  } catch (error) {
    say(error);
  }
};
