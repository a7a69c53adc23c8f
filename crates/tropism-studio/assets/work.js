// A study, sweep, transfer, comparison of replicates or tuned rule: how far it is.
// @ts-check
import { keep } from "./keep.js";
import { $, asked, chip, command, get, html, listen, num, put, refuse, session, span } from "./studio.js";

const at = asked.get("at") ?? "";

/** Rows of name, done, of all, and what is counted. @param {import("./types.d.ts").StatusResults} status @returns {[string, number, number, string][]} */
function parts(status) {
  // A run has a page of its own.
  if (!("parts" in status)) return [];
  return status.parts.map(({ name, done, total, unit, best, seconds }) => [
    name,
    done,
    total,
    `${unit}${best === null ? "" : `, best ${num(best)}`}${seconds ? `, ${span(seconds)}` : ""}`,
  ]);
}

/** The name of the work, once it is known. */
let named = "";
async function read() {
  const { kind, name, status, is_at_work: isAtWork, commands, drawing } = await get("api/work", { at });
  $("#kind").textContent = kind;
  $("#name").textContent = name;
  document.title = `${name} · tropism studio`;
  const isOver = "parts" in status ? status.is_over : status.state === "over";
  put($("#state"), chip(isOver ? "over" : isAtWork ? "live" : "stopped"));
  const rows = parts(status);
  $("#stages-sheet").hidden = rows.length === 0;
  const row = (/** @type {typeof rows[0]} */ [stage, done, total, unit]) =>
    html`<tr>
      <th scope="row">${stage}</th>
      <td class="n">${done} of ${total}</td>
      <td>${unit}</td>
      <td><progress max="${Math.max(1, total)}" value="${done}" aria-label="${stage}"></progress></td>
    </tr>`;
  put(
    $("#stages"),
    html`<thead>
        <tr>
          <th scope="col">Part</th>
          <th scope="col" class="n">Done</th>
          <th scope="col">What</th>
          <th scope="col"><span class="vh">How far</span></th>
        </tr>
      </thead>
      <tbody>
        ${rows.map(row)}
      </tbody>`,
  );
  put($("#commands"), commands.map(command));
  if (named !== name) keep(kind, at, { name });
  named = name;
  $("#compare").href = `compare?${new URLSearchParams({ at })}`;
  $("#compare").hidden = !isOver || kind === "rule";
  $("#try").href = `draw?${new URLSearchParams({ at, drawing: JSON.stringify(drawing) })}`;
  $("#try").hidden = !drawing;
}

session.then(({ session: own }) => {
  if (!own) return;
  const again = () => read().then(() => put($("#banner"), ""), refuse);
  again();
  listen("items", "", again);
});
