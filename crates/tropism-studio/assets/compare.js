// Compare: the report of the library on one axis, with its tests and its figures as files.
// @ts-check
import { $, $$, asked, banner, command, get, html, icon, listen, num, put, refuse, session, virtual } from "./studio.js";

/** @type {Set<string>} */
const chosen = new Set((asked.get("at") ?? "").split("\n").filter(Boolean));
/** @type {import("./types.d.ts").Item[]} */
let items = [];

const COMPARED = ["run", "evolution", "study", "sweep", "transfer", "replicates"];

function list() {
  const wanted = $("#find").value.trim().toLowerCase();
  const known = items.filter((item) => COMPARED.includes(item.kind) && item.state === "over");
  const shown = known.filter((item) => chosen.has(item.at) || item.name.toLowerCase().includes(wanted)).slice(0, 60);
  const one = (/** @type {import("./types.d.ts").Item} */ item) =>
    html`<label class="check"
      ><input type="checkbox" value="${item.at}" data-checked="${chosen.has(item.at)}" /><span
        >${item.name} <span class="soft small">${item.kind}, ${item.text}</span> ${item.is_virtual ? virtual() : ""}</span
      ></label
    >`;
  put(
    $("#items"),
    shown.length
      ? shown.map(one)
      : html`<p class="soft small">Nothing that is over is here yet. What goes on can be compared when it has ended.</p>`,
  );
  for (const box of $("#items").querySelectorAll("input")) box.checked = chosen.has(box.value);
  $("#count").textContent = `${chosen.size} of ${known.length}`;
  $("#go").disabled = chosen.size === 0;
  $("#go").textContent = chosen.size === 1 ? "Show its figures" : `Compare ${chosen.size || ""}`;
}
$("#items").addEventListener("change", (event) => {
  if (event.target.checked) chosen.add(event.target.value);
  else chosen.delete(event.target.value);
  list();
});
$("#find").oninput = list;

/** A drawing in the colours of this page: its file brings its own, and a white ground. @param {string} address */
async function drawing(address) {
  const text = await (await fetch(address)).text();
  // Its styles never become some of this page, whose policy would refuse them.
  const bare = text.replace(/<style[^]*?<\/style>/g, "");
  const svg = new DOMParser().parseFromString(bare, "image/svg+xml").documentElement;
  svg.querySelector(":scope > rect[fill='#fff']")?.remove();
  return document.importNode(svg, true);
}

async function compare() {
  const at = [...chosen].join("\n");
  $("#go").disabled = true;
  put($("#banner"), banner("calm", "status", "Drawing the figures."));
  try {
    const found = await get("api/compare", { at });
    put($("#banner"), "");
    const file = (/** @type {string} */ name) => `api/compare/file?${new URLSearchParams({ at, name })}`;
    const figure = (/** @type {import("./types.d.ts").ComparedFigure} */ { name, title }) => {
      const has = (/** @type {string} */ ending) => found.files.includes(`${name}.${ending}`);
      const save = (/** @type {string} */ ending, /** @type {string} */ text, /** @type {string} */ kind) =>
        has(ending)
          ? html`<a class="btn ${kind}" href="${file(`${name}.${ending}`)}" download="${name}.${ending}">${text}</a>`
          : "";
      return html`<section class="sheet">
        <header><h2>${title}</h2></header>
        ${
          has("svg")
            ? html`<div class="shown-figure" data-svg="${file(`${name}.svg`)}" role="img" aria-label="${title}"></div>`
            : html`<div class="picture"><img src="${file(`${name}.jpg`)}" alt="${title}" /></div>`
        }
        <div class="row">
          ${save("svg", "Save figure (SVG)", "primary")}${save("png", "PNG", "")}${save("csv", "Numbers (CSV)", "")}${save("jpg", "JPEG", "")}
        </div>
      </section>`;
    };
    put($("#figures"), found.figures.map(figure));
    for (const place of $$("#figures [data-svg]")) place.replaceChildren(await drawing(place.dataset.svg));
    const pairs = found.comparisons.flatMap((comparison) =>
      comparison.pairs.map((pair) => ({ ...pair, title: comparison.title, unit: comparison.unit })),
    );
    $("#tests-sheet").hidden = !pairs.length;
    const p = (/** @type {number} */ value) => (value < 0.0001 ? "< 0.0001" : num(value, 4));
    const row = (/** @type {typeof pairs[0]} */ pair) =>
      html`<tr>
        <th scope="row">${pair.one} and ${pair.other}</th>
        <td class="n">${num(pair.median_difference)} ${pair.unit}</td>
        <td class="n">${Math.round(100 * pair.superiority)} %</td>
        <td class="n">${p(pair.p)}</td>
        <td class="n">${p(pair.p_holm)}</td>
        <td>${pair.p_holm < 0.05 ? html`${icon("done")} yes` : "no"}</td>
      </tr>`;
    put(
      $("#tests"),
      html`<thead>
          <tr>
            <th scope="col">Pair</th>
            <th scope="col" class="n">Difference of medians</th>
            <th scope="col" class="n">Chance to be greater</th>
            <th scope="col" class="n">p</th>
            <th scope="col" class="n">p after Holm</th>
            <th scope="col">They differ</th>
          </tr>
        </thead>
        <tbody>
          ${pairs.map(row)}
        </tbody>`,
    );
    $("#command-sheet").hidden = false;
    put($("#command"), command(found.command));
    history.replaceState(null, "", `?${new URLSearchParams({ at })}`);
  } catch (error) {
    refuse(error);
  }
  $("#go").disabled = chosen.size === 0;
}
$("#go").onclick = compare;

session.then(({ session: own }) => {
  if (!own) return;
  let isFirst = true;
  listen("items", "", (data) => {
    const old = new Map(data.all ? [] : items.map((item) => [item.at, item]));
    for (const item of data.items) old.set(item.at, item);
    for (const at of data.gone) if (!data.items.some((item) => item.at === at)) old.delete(at);
    items = [...old.values()].sort((one, other) => (other.began ?? 0) - (one.began ?? 0));
    list();
    if (isFirst && chosen.size) compare();
    isFirst = false;
  });
});
