// Begin work: forms whose values become a command of tropism, and the queue of what waits and runs.
// @ts-check
import { $, asked, chip, command, folded, get, html, insist, listen, post, put, refuse, say, session, toast, wordOf } from "./studio.js";

/**
 * @typedef {import("./types.d.ts").ShownField} Field
 * @typedef {import("./types.d.ts").ShownForm} Form
 */

/** @type {Form[]} */
let forms = [];
const form = () => forms.find(({ name }) => name === $("#what").value) ?? forms[0];
/** Values by fields, as they were filled in. @type {Record<string, string>} */
const values = Object.fromEntries([...asked].filter(([name]) => name !== "form"));

/** @param {Field} field */
function control({ name, kind, offered, is_needed: isNeeded }) {
  const value = values[name] ?? "";
  const needed = isNeeded ? "required" : "";
  if (kind === "choice")
    return html`<select name="${name}">
      ${isNeeded ? "" : html`<option value=""></option>`}${offered.map(
        (one) => html`<option ${one === value ? html`selected` : ""}>${one}</option>`,
      )}
    </select>`;
  if (kind === "number") return html`<input name="${name}" value="${value}" inputmode="numeric" pattern="[0-9]*" ${needed} />`;
  const list = offered.length ? html`<datalist id="offered-${name}">${offered.map((one) => html`<option value="${one}"></option>`)}</datalist>` : "";
  return html`<input name="${name}" value="${value}" list="offered-${name}" spellcheck="false" autocapitalize="none" ${needed} />${list}`;
}

/** @param {Field} field */
const field = (field) =>
  field.kind === "flag"
    ? html`<label class="check"><input type="checkbox" name="${field.name}" /><span>${field.label}</span></label>`
    : html`<label class="field"><span>${field.label}${field.is_needed ? "" : " (optional)"}</span>${control(field)}</label>`;

/** Whether one has begun to fill in, or tried to send: what is missing is not told before. */
let isTouched = false;
/** The first field that has to be filled in. */
const missing = () => shownFields().find(({ name, kind, is_needed: isNeeded }) => isNeeded && kind !== "flag" && !$(`#fields [name="${name}"]`).value.trim());

function draw() {
  const shown = form();
  isTouched = false;
  $("#says").textContent = shown.says;
  for (const { name, preset, kind, offered, is_needed: isNeeded } of shown.fields) {
    values[name] ||= preset;
    if (kind === "choice" && (isNeeded || values[name]) && !offered.includes(values[name])) values[name] = preset || (offered[0] ?? "");
  }
  put($("#fields"), shown.fields.map(field));
  look();
}

/** The form as it is filled in. */
function filled() {
  const all = shownFields().map(({ name, kind }) => {
    const input = $(`#fields [name="${name}"]`);
    return [name, kind === "flag" ? String(input.checked) : input.value];
  });
  return { form: form().name, values: Object.fromEntries(all) };
}
const shownFields = () => form().fields;

let timer = 0;
/** Shows the command, or what is missing, soon after the last key. */
function look() {
  clearTimeout(timer);
  timer = setTimeout(async () => {
    const lacks = missing();
    if (lacks) {
      put($("#command"), "");
      $("#problem").textContent = isTouched ? `${lacks.label}: fill it in.` : "";
      return;
    }
    const own = JSON.stringify(filled());
    try {
      const { command: line } = await get("api/begin/command", { form: own });
      put($("#command"), command(line));
      $("#problem").textContent = "";
    } catch (error) {
      put($("#command"), "");
      $("#problem").textContent = wordOf(error);
    }
  }, 150);
}

$("#what").onchange = draw;
$("#fields").oninput = ({ target }) => {
  values[target.name] = target.value;
  isTouched = true;
  look();
};
// The browser says so at the field, and sends nothing.
$("#form").addEventListener(
  "invalid",
  () => {
    isTouched = true;
    look();
  },
  true,
);
$("#form").onsubmit = async (event) => {
  event.preventDefault();
  $("#go").disabled = true;
  try {
    const { at, job } = await post("api/begin", filled());
    if (job === null) {
      const page = form().name === "make-rig" ? `devices?${new URLSearchParams({ rig: at })}` : `run?${new URLSearchParams({ at })}`;
      return location.assign(page);
    }
    toast("It is in the queue.");
    values.out = "";
    draw();
  } catch (error) {
    $("#problem").textContent = wordOf(error);
  } finally {
    $("#go").disabled = false;
  }
};

// The queue.
const SAVED = /\.(gif|mp4|csv|tar|json|html)$/;
const WORDS = { waiting: ["waiting", "Waits"], running: ["live", "Runs"], done: ["over", "Done"], stopped: ["stopped", "Stopped"], failed: ["broken", "Failed"] };
/** @param {import("./types.d.ts").ShownJob} job */
const row = (job) =>
  html`<li class="stack">
    <div class="row">
      ${chip(WORDS[job.state][0], WORDS[job.state][1])}<b>${job.at || job.commands[0]}</b>
      <span class="push row">
        ${job.state === "waiting" ? html`<button class="btn quiet change" type="button" data-do="remove" data-number="${job.number}">Take out</button>` : ""}
        ${job.state === "running" ? html`<button class="btn quiet change" type="button" data-do="cancel" data-number="${job.number}">Cancel</button>` : ""}
        ${job.state === "done" && SAVED.test(job.at) ? html`<a class="btn" href="api/file?${new URLSearchParams({ at: job.at })}" download>Save</a>` : ""}
        ${job.state === "waiting" ? "" : html`<button class="btn quiet" type="button" data-do="log" data-number="${job.number}">Log</button>`}
      </span>
    </div>
    ${job.problem ? html`<div class="small">${folded(job.problem)}</div>` : ""}
  </li>`;

let logged = 0;
async function readLog() {
  try {
    const { log } = await get("api/queue/log", { number: logged });
    $("#said").textContent = log || "It has said nothing yet.";
  } catch (error) {
    $("#said").textContent = wordOf(error);
  }
}
setInterval(() => $("#log").open && readLog(), 2000);

$("#queue").onclick = async ({ target }) => {
  const { do: what, number } = target.closest("button")?.dataset ?? {};
  if (!what) return;
  if (what === "log") {
    logged = Number(number);
    await readLog();
    $("#log").showModal();
    return;
  }
  await insist(what === "cancel" ? "api/queue/cancel" : "api/queue/remove", { number: Number(number) }, "This").catch(say);
};

listen("items", "", ({ queue }) => {
  if (queue) put($("#queue"), queue.length ? html`<ol class="steps">${[...queue].reverse().map(row)}</ol>` : html`<p class="soft">Nothing waits and nothing runs.</p>`);
});

session.then(async ({ session: own }) => {
  if (!own) return;
  try {
    ({ forms } = await get("api/forms"));
  } catch (error) {
    return refuse(error);
  }
  put($("#what"), forms.map(({ name, title }) => html`<option value="${name}">${title}</option>`));
  $("#what").value = asked.get("form") ?? forms[0].name;
  draw();
});
