// A study, sweep, transfer or comparison of laboratories: how far it is.
// @ts-check
import { $, asked, chip, command, get, html, listen, put, session, span } from "./studio.js";

const at = asked.get("at") ?? "";

/** Rows of name, done, of all, and what is counted. @param {any} status @returns {[string, number, number, string][]} */
function stages(status) {
  if (status.stages)
    return status.stages.map((stage) => [
      stage.name,
      stage.done,
      stage.total,
      `${stage.unit}${stage.seconds ? `, ${span(stage.seconds)}` : ""}`,
    ]);
  if (status.worlds) return status.worlds.map((world) => [world.world, world.controllers_done, world.controllers, "controllers"]);
  if (status.controllers) return status.controllers.map((one) => [one.name, one.plants, status.plants, "plants"]);
  return [["units", status.done, status.total, "units"]];
}

async function read() {
  const { kind, name, status, command: line } = await get("api/work", { at });
  $("#kind").textContent = kind;
  $("#name").textContent = name;
  document.title = `${name} · tropism studio`;
  put($("#state"), chip(status.is_over ? "over" : status.process ? "live" : "stopped"));
  const row = ([stage, done, total, unit]) =>
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
          <th scope="col">Stage</th>
          <th scope="col" class="n">Done</th>
          <th scope="col">What</th>
          <th scope="col"></th>
        </tr>
      </thead>
      <tbody>
        ${stages(status).map(row)}
      </tbody>`,
  );
  put($("#commands"), command(line));
  $("#compare").href = `compare?${new URLSearchParams({ at })}`;
  $("#compare").hidden = !status.is_over || kind === "transfer" || kind === "laboratories";
}

session.then(({ session: own }) => {
  if (!own) return;
  const again = () =>
    read().then(
      () => put($("#banner"), ""),
      (error) => put($("#banner"), html`<div class="banner bad" role="alert"><div>${error.message}</div></div>`),
    );
  again();
  listen("api/events", "items", again);
});
