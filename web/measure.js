// The constants of plants: tracks that are dropped here, or the photographs tracked in this page.
// @ts-check
import { Engine } from "./engine.js";
import { tracked } from "./photographs.js";
import { $, html, num, plural, put, say, trusted } from "./studio.js";

/** @type {Engine | null} */
let engine = null;
const measuring = () => (engine ??= new Engine("whole"));
/** What was measured of each plant. @type {any[]} */
let plants = [];
/** Numbers the measurements, so that an earlier one ends. */
let number = 0;

export function openMeasure() {
  if ($("#measure-files")) {
    $("#measure-tracked").disabled = !tracked();
    return;
  }
  put(
    $("#view-measure"),
    html`<div class="head">
        <div class="head-row"><h1>The constants of a plant</h1></div>
        <p class="lede">
          Growth, the zone that bends, gravitropism and straightening, from the stems of a plant whose pot was tipped: each with a 90 % interval, or the
          reason why these data cannot say it. As <code>tropism measure</code>, without its check on virtual plants.
        </p>
      </div>
      <div class="cols main-side">
        <div class="stack" id="measure-found"></div>
        <section class="sheet">
          <h2>Plants</h2>
          <div class="dropzone" id="measure-drop">
            <label class="field"><span>Tracks with stems, a CSV file a plant</span><input type="file" id="measure-files" multiple accept=".csv,text/csv" /></label>
            <span class="soft">or drop them here</span>
          </div>
          <label class="field"><span>Tilt of the pots at the first row (degrees)</span><input type="number" id="measure-tilt" min="1" max="180" inputmode="decimal" placeholder="upright" /></label>
          <div class="row wide"><button class="btn" type="button" id="measure-tracked">The photographs tracked here</button></div>
          <p class="soft small" id="measure-says" role="status"></p>
        </section>
      </div>`,
  );
  $("#measure-tracked").disabled = !tracked();
  $("#measure-files").onchange = (event) => measureAll([...event.target.files]);
  const drop = $("#measure-drop");
  for (const name of ["dragover", "dragleave", "drop"]) {
    drop.addEventListener(name, (event) => {
      event.preventDefault();
      drop.classList.toggle("over", name === "dragover");
      if (name === "drop") measureAll([...event.dataTransfer.files]);
    });
  }
  $("#measure-tracked").onclick = () => measureAll([]);
}

/** Measures the plants of the files; without any, the one that was tracked here. @param {File[]} files */
async function measureAll(files) {
  const own = ++number;
  const tilt_deg = $("#measure-tilt").value === "" ? null : Number($("#measure-tilt").value);
  const says = (/** @type {string} */ text) => ($("#measure-says").textContent = text);
  plants = [];
  try {
    if (!files.length) {
      says("Measuring …");
      plants.push((await tracked()?.askFor({ measure: { name: "photographs", tilt_deg } }))?.json);
    }
    for (const [place, file] of files.entries()) {
      says(`Measuring ${place + 1} of ${files.length} …`);
      const bytes = new Uint8Array(await file.arrayBuffer());
      const { json } = await measuring().askFor({ measure: { name: file.name.replace(/\.csv$/i, ""), tilt_deg } }, bytes);
      if (own !== number) return;
      plants.push(json);
    }
    await show();
    says(`${plural(plants.length, "plant")} measured.`);
  } catch (error) {
    says("");
    say(error);
  }
}

/** @param {any} estimate */
function row({ symbol, words, unit, value, interval, status, has_value, reason }) {
  const digits = (/** @type {number} */ one) => (one === null ? "?" : String(Number(one.toPrecision(3))));
  const text = has_value ? `${digits(value)} [${interval.map(digits).join(", ")}] ${unit}` : "";
  return html`<tr><th scope="row">${symbol}</th><td class="num">${text}</td><td>${status.replace("-", " ")}${reason ? `: ${reason}` : ""}</td><td class="soft">${words}</td></tr>`;
}

/** @param {string} title @param {any[]} estimates */
const table = (title, estimates) =>
  html`<div class="scroll" tabindex="0" role="region" aria-label="${title}"><table><caption>${title}</caption><thead><tr><th scope="col">Symbol</th><th scope="col">Value, 90 % interval</th><th scope="col">Status</th><th scope="col">What</th></tr></thead><tbody>${estimates.map(row)}</tbody></table></div>`;

/** @param {any} figure */
const drawn = ({ title, svg, caption }) =>
  html`<figure class="paper-figure"><p>${title}</p>${trusted(svg)}<figcaption class="soft small">${caption}</figcaption></figure>`;

async function show() {
  /** @type {Record<string, number[]>} */
  const values = {};
  for (const { estimates } of plants)
    for (const { symbol, value, status } of estimates) if (/^(measured|provisional)$/.test(status)) (values[symbol] ??= []).push(value);
  const means = plants.length > 1 ? await measuring().ask({ means: { values } }) : [];
  const shown = ({ name, is_virtual, hours, frames, responds, estimates, figures }) =>
    html`<section class="sheet">
      <h2>${name}${is_virtual ? html` <span class="chip virtual">virtual</span>` : ""}</h2>
      <p>${plural(frames.used, "frame")} over ${num(hours, 1)} h. ${responds ? "It responds." : "No response: its own movement explains the record as well."}</p>
      ${table("Constants of this plant", estimates)}
      <div class="paper-figures">${figures.map(drawn)}</div>
    </section>`;
  put(
    $("#measure-found"),
    html`${means.length ? html`<section class="sheet"><h2>All plants</h2>${table(`Mean of ${plural(plants.length, "plant")}`, means)}</section>` : ""}${plants.map(shown)}`,
  );
}
