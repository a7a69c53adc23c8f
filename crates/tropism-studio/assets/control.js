// What state a run is in, what to do about it, and what ends it.
// @ts-check
import { $, $$, banner, chip, cutOff, hold, html, insist, num, ofBest, onYes, post, put, say, toast, virtual } from "./studio.js";
import { at, isOn, run } from "./record.js";

export function state() {
  const last = run.steps.at(-1);
  const resume = (primary) =>
    html`<button class="btn ${primary ? "primary" : ""} change" type="button" id="resume">
      Resume from step ${last ? last.number + 1 : 0}
    </button>`;
  const word = run.status.state;
  /** @type {any} */
  let what = "";
  if (run.isLost) {
    what = cutOff(
      run.lostFor,
      html`The run itself goes on: it does not need this page. To stop it meanwhile, at its computer:
        <code>${run.about.commands?.stop ?? "tropism stop"}</code>`,
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
    const lit = run.status.still_lit ? html` <b>The ${run.status.still_lit} lamp may still be lit</b>: use Safe state.` : "";
    what = banner(
      "bad",
      "alert",
      html`<strong>The run’s process is gone.</strong> It did not say goodbye: a kill, a crash or a power cut. All ${run.steps.length}
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
      html`<strong>The run waits for you.</strong> ${run.events.findLast((event) => event.kind === "paused")?.text ?? ""}`,
      resume(true),
    );
  } else if (word === "over") {
    const fitness =
      run.status.fitness === null || run.status.fitness === undefined
        ? ""
        : ` Fitness ${num(run.status.fitness)}${ofBest(run.about.best)} ${run.about.unit}.`;
    what = banner("calm", "status", html`<strong>The run is over.</strong>${fitness}`);
  } else if (word === "live" && !run.steps.length) {
    what = banner("calm", "status", html`<strong>No photograph yet.</strong> The first one comes soon.`);
  }
  put($("#banner"), what);
  put($("#state"), [
    chip(word ?? "waiting", word === "live" && !run.steps.length ? "Starting" : undefined),
    run.about.is_virtual ? virtual("virtual bean") : "",
  ]);
  const hasDock = Boolean(word) && word !== "over" && word !== "gone";
  for (const [buttons, can] of /** @type {const} */ ([[".stop", isOn()], [".safe", hasDock]])) {
    for (const button of $$(buttons)) {
      button.hidden = !can;
      button.setAttribute("aria-disabled", String(run.isLost));
    }
  }
  $("#can").hidden = !hasDock;
  $("#ask-button").hidden = !isOn();
  $("#dock").hidden = !hasDock;
  document.body.classList.toggle("has-dock", hasDock);
}

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
$("#ask-button").onclick = () => $("#ask").showModal();
onYes($("#ask"), stop);
$("#banner").onclick = async (event) => {
  if (event.target.id !== "resume") return;
  event.target.disabled = true;
  await post("api/run/resume", { at }).then(() => toast("It goes on."), say);
};
