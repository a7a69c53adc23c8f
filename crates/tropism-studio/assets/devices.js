// Devices by hand: a lamp for a stated time, the flash, a photograph now, a live view with the tip marked.
// @ts-check
import { $, asked, capital, chip, command, folded, get, html, insist, lampClass, listen, mmss, num, post, put, refuse, session, toast, trusted, virtual, wordOf, banner } from "./studio.js";
import { clickIn } from "./calibrate.js";
import { frameFor, ring } from "./photo.js";

/** Pause between two photographs of the live view, in ms: enough to focus and to frame by. */
const LIVE_MS = 2000;
const ANSWER_MS = 130_000;

/** @type {import("./types.d.ts").AboutRig | null} */
let about = null;
/** What is lit, and when it goes off by this clock. @type {{ lit: string | null, until: number }} */
let state = { lit: null, until: 0 };
let isBusy = false;
let isLive = false;
let taken = 0;

const rig = () => $("#rig").value;

/** @param {import("./types.d.ts").RigState} found */
function know(found) {
  state = { lit: found.lit, until: Date.now() + 1000 * (found.left_s ?? 0) };
  put($("#banner"), found.problem ? banner("bad", "alert", html`<strong>A device does not obey.</strong> ${found.problem}`) : "");
  draw();
}

/** @param {string} name */
const left = (name) => (state.lit === name ? Math.max(0, (state.until - Date.now()) / 1000) : null);

function draw() {
  if (!about) return;
  const names = [...about.lamps, ...(about.has_flash ? ["flash"] : [])];
  const row = (/** @type {string} */ name) => {
    const seconds = left(name);
    return html`<li class="row">
      <span class="lamp ${seconds === null ? "" : lampClass(name)}">${capital(name)}</span>
      <span class="soft small num">${seconds === null ? "off" : `lit, ${mmss(seconds + 0.99)} left`}</span>
      <span class="push row change">
        ${
          seconds === null
            ? html`<button class="btn" type="button" data-light="${name}" aria-label="Light ${name}">Light</button>`
            : html`<button class="btn" type="button" data-off="" aria-label="Switch ${name} off">Off</button>`
        }
      </span>
    </li>`;
  };
  put($("#lamps"), names.map(row));
  $("#lampline").dataset.lamp = state.lit && state.lit !== "flash" ? lampClass(state.lit) : "";
}

/** @param {import("./types.d.ts").Wish} wish */
async function wish(wish) {
  know(await post("api/rig", wish, ANSWER_MS));
}

/** Says why a rig cannot be had. @param {any} error */
const problem = (error) => put($("#banner"), banner("bad", "alert", folded(wordOf(error))));

$("#lamps").onclick = async ({ target }) => {
  const button = target.closest("button");
  if (!button) return;
  if (button.dataset.off !== undefined) return dark();
  await wish({ do: "light", rig: rig(), lamp: button.dataset.light, seconds: Number($("#seconds").value) }).catch(problem);
};
async function dark() {
  stopLive();
  try {
    know(await insist("api/rig", { do: "dark", rig: rig() }, "Off"));
    toast("All light is off.");
  } catch (error) {
    problem(error);
  }
}
$("#dark").onclick = dark;

/** A rig that is known takes photographs, one at a time. */
function offer() {
  $("#take").disabled = isBusy || !about;
  $("#live").disabled = !about;
}

/** Takes a photograph and shows what is seen in it; whether there is one. */
async function photograph() {
  if (isBusy || !about) return false;
  isBusy = true;
  offer();
  try {
    const found = await post("api/rig", { do: "photo", rig: rig(), has_flash: $("#flash").checked }, ANSWER_MS);
    show(found.photo);
    know(found);
    return true;
  } catch (error) {
    problem(error);
    return false;
  } finally {
    isBusy = false;
    offer();
  }
}

/** @param {import("./types.d.ts").PhotoByHand} photo */
function show({ number, seen }) {
  taken = Date.now();
  const image = $("#img");
  image.hidden = false;
  $("#no-photo").hidden = true;
  const own = rig();
  image.onload = () => {
    if (!about?.size) frameFor(image.naturalWidth, image.naturalHeight);
    clickIn({ rig: own, number, size: [image.naturalWidth, image.naturalHeight] });
  };
  image.src = `api/rig/photo?number=${number}`;
  const { tip = null, tip_px: pixel = null } = seen ?? {};
  const text = tip
    ? `Tip at ${num(tip[0], 1)}, ${num(tip[1], 1)} cm, confidence ${num(seen.confidence, 2)}.`
    : seen
      ? `No plant found: ${seen.status.replaceAll("_", " ")}.`
      : "Not calibrated yet: calibrate by clicks, then the plant is looked for.";
  $("#seen").textContent = text;
  image.alt = text;
  put($("#over"), pixel ? trusted(ring(pixel.x, pixel.y, (about?.size?.[0] ?? 648) / 59)) : "");
}

function stopLive() {
  isLive = false;
  $("#live").setAttribute("aria-pressed", "false");
}
async function live() {
  while (isLive) {
    if (!document.hidden && !(await photograph())) return stopLive();
    await new Promise((done) => setTimeout(done, LIVE_MS));
  }
}
$("#take").onclick = photograph;
$("#live").onclick = () => {
  if (isLive) return stopLive();
  isLive = true;
  $("#live").setAttribute("aria-pressed", "true");
  live();
};

async function choose() {
  stopLive();
  about = null;
  clickIn(null);
  offer();
  put($("#lamps"), "");
  put($("#over"), "");
  $("#img").hidden = true;
  $("#no-photo").hidden = false;
  put($("#banner"), "");
  const name = rig();
  const isFile = name !== "greenhouse";
  $("#check").href = `begin?${new URLSearchParams({ form: "check", rig: name })}`;
  $("#check").hidden = !isFile;
  put($("#commands"), isFile ? [command(`tropism lamp ${name} left --seconds 10`), command(`tropism photo ${name} --out now.jpg`), command(`tropism safe-state ${name} --dark`)] : "");
  try {
    const found = await get("api/rig", { at: name });
    if (name !== rig()) return;
    about = found;
    if (found.size) frameFor(found.size[0], found.size[1]);
    put($("#state"), found.is_virtual ? virtual("virtual tent: five minutes pass with each photograph") : chip("live", "real devices"));
    know(found.state);
    offer();
  } catch (error) {
    problem(error);
  }
}
$("#rig").onchange = choose;

// What goes on by itself: only while something is lit.
setInterval(() => {
  $("#age").textContent = taken ? `taken ${mmss((Date.now() - taken) / 1000)} ago` : "";
  if (!state.lit) return;
  if (Date.now() > state.until) get("api/rig", { at: rig() }).then((found) => know(found.state), problem);
  draw();
}, 1000);

// What is heard says that the studio is there.
listen("items", "", () => {});
session.then(async ({ session: own }) => {
  if (!own) return;
  try {
    const { rigs, tent } = await get("api/rigs");
    put($("#rig"), [rigs.map((at) => html`<option value="${at}">${at}</option>`), html`<option value="${tent}">a virtual tent</option>`]);
    const wanted = asked.get("rig");
    if (wanted) $("#rig").value = wanted;
    await choose();
  } catch (error) {
    refuse(error);
  }
});
