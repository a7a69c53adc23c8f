// The paper, live: its settings as sliders, and its figures 4 to 7 that follow.
// @ts-check
import { lead } from "./engine.js";
import { Evolution } from "./evolution.js";
import { $, $$, html, inSeconds, num, put, say, trusted } from "./studio.js";

/**
 * A setting: where it stands among the program's, its range, and how many of its units the page shows for one.
 * @type {{ path: string, name: string, low: number, high: number, step: number, digits: number, per?: number, start?: number }[]}
 */
const SETTINGS = [
  { path: "beans.seed", name: "Seed of the six beans", low: 1, high: 20, step: 1, digits: 0 },
  { path: "beans.switch_steps", name: "Hours between two switches", low: 1, high: 12, step: 1, digits: 0, per: 12 },
  { path: "model.window.wx", name: "Half the width of the window, eq. (1), in cm", low: 0.1, high: 2, step: 0.1, digits: 1 },
  { path: "model.window.wy", name: "Half the height of the window, eq. (1), in cm", low: 0.1, high: 4, step: 0.1, digits: 1 },
  { path: "model.growth.sd", name: "Noise of growth, eq. (4), in cm", low: 0, high: 0.05, step: 0.005, digits: 3 },
  { path: "evolution.neat.population", name: "Population, Table 1", low: 10, high: 150, step: 10, digits: 0 },
  { path: "evolution.neat.survival_rate", name: "Survival rate, Table 1", low: 0.1, high: 1, step: 0.1, digits: 1 },
  { path: "evolution.neat.overall_mutation_rate", name: "Overall mutation rate, Table 1", low: 0, high: 1, step: 0.1, digits: 1 },
  { path: "evolution.generations", name: "Generations", low: 50, high: 2000, step: 50, digits: 0, start: 200 },
  { path: "evolution.runs", name: "Runs", low: 1, high: 20, step: 1, digits: 0, start: 4 },
];
/** @param {any} settings @param {string} path */
const read = (settings, path) => path.split(".").reduce((within, key) => within[key], settings);
/** @param {any} settings @param {string} path @param {number} value */
function write(settings, path, value) {
  const keys = path.split(".");
  const last = keys.pop() ?? "";
  keys.reduce((within, key) => within[key], settings)[last] = value;
}

/** The paper's settings, and those of the sliders. @type {any} */
let paper;
/** @type {any} */
let settings;
/** @type {Evolution | null} */
let evolution = null;

export async function openPaper() {
  if (paper) return;
  paper = await lead.ask({ settings: {} });
  settings = structuredClone(paper);
  for (const { path, start, per = 1 } of SETTINGS) if (start) write(settings, path, start * per);
  const slider = ({ path, name, low, high, step, digits, per = 1 }, place) => {
    const value = num(read(settings, path) / per, digits);
    const own = num(read(paper, path) / per, digits);
    return html`<label class="field"
      ><span>${name}: <output id="value-${place}">${value}</output> <span class="soft">(paper: ${path === "beans.seed" ? "other plants" : own})</span></span
      ><input type="range" data-place="${place}" min="${low}" max="${high}" step="${step}" value="${read(settings, path) / per}"
    /></label>`;
  };
  put(
    $("#view-paper"),
    html`<div class="head">
        <div class="head-row"><h1>The paper, live</h1><span class="chip virtual">virtual beans</span></div>
        <p class="lede">
          Six beans grow under lamps that change by the clock (Fig. 4). Their shifts (Fig. 5) make a model; networks evolve on it (Fig. 6), and the
          best one steers simulated plants (Fig. 7). Move a slider: what depends on it is computed again.
        </p>
      </div>
      <section class="sheet" aria-label="Settings">
        <div class="fields">${SETTINGS.map(slider)}
          <label class="field"><span>Reading of eq. (9)</span
            ><select id="reading"><option value="letter">to the letter</option><option value="approach">by approach</option></select></label>
          <label class="field"><span>Where a window is empty</span
            ><select id="empty"><option value="still">the tip only grows</option><option value="nearest">as at the nearest data</option></select></label>
        </div>
        <div class="row wide"><button class="btn" type="button" id="as-paper">As on the page’s first opening</button></div>
        <p class="soft small" id="paper-says" role="status"></p>
      </section>
      <div class="paper-figures" id="figures-tracks"></div>
      <div class="paper-figures" id="figures-evolution"></div>`,
  );
  $("#view-paper").oninput = ({ target }) => {
    if (target.type !== "range") return;
    const { path, digits, per = 1 } = SETTINGS[target.dataset.place];
    write(settings, path, Number(target.value) * per);
    $(`#value-${target.dataset.place}`).textContent = num(Number(target.value), digits);
  };
  $("#view-paper").onchange = ({ target }) => {
    if (target.id === "reading") settings.task.reading = target.value;
    if (target.id === "empty") settings.model.empty = target.value;
    const path = SETTINGS[target.dataset.place]?.path ?? "";
    follow(path.startsWith("beans."));
  };
  $("#as-paper").onclick = () => {
    paper = undefined;
    openPaper();
  };
  await follow(true);
}

/** @param {Element} place @param {any[]} figures */
function show(place, figures) {
  const one = ({ number, svg, title, caption }) =>
    html`<figure class="paper-figure sheet"><h2>Fig. ${number}</h2><p>${title}</p>${trusted(svg)}<figcaption class="soft small">${caption}</figcaption></figure>`;
  put(place, figures.map(one));
  place.removeAttribute("aria-busy");
}

/** Computes what follows from the settings. @param {boolean} hasNewBeans */
async function follow(hasNewBeans) {
  evolution?.stop();
  const { beans, model, task, evolution: plan } = structuredClone(settings);
  const began = performance.now();
  const says = (/** @type {string} */ text) => ($("#paper-says").textContent = text);
  for (const place of $$(hasNewBeans ? ".paper-figures" : "#figures-evolution")) place.setAttribute("aria-busy", "true");
  try {
    if (hasNewBeans) {
      says("Six beans grow.");
      show($("#figures-tracks"), await lead.ask({ tracks: { beans } }));
    }
    const own = new Evolution({ task, kind: "tip", model, beans, evolution: plan, seed: 1 }, (view) => {
      if (own.isStopped || view.state === "over") return;
      says(`${view.done} of ${view.total} generations.`);
      draw(own, null).catch(say);
    });
    evolution = own;
    const champion = await own.run();
    if (!champion) return;
    await draw(own, champion);
    const best = own.champions.map(({ best }) => best).sort((one, other) => one - other);
    says(
      `Best fitness ${num(best.at(-1) ?? 0, 2)} cm, median ${num(best[Math.floor(best.length / 2)], 2)} cm over ${best.length} runs, in ${inSeconds((performance.now() - began) / 1000)}.`,
    );
  } catch (error) {
    says("");
    say(error);
  }
}

/** Figures 6 and 7. @param {Evolution} own @param {string | null} champion its file, at the end */
async function draw(own, champion) {
  const common = Math.min(...own.histories.map(({ length }) => length));
  const column = (/** @type {"best" | "mean"} */ key) => own.histories.map((history) => history.slice(0, common).map((generation) => generation[key]));
  const figures = await lead.ask({ fitness: { best: column("best"), mean: column("mean") } });
  if (champion) figures.push(...(await lead.ask({ steered: { champion, task: own.plan.task, seed: 1 } })));
  if (own === evolution && !own.isStopped) show($("#figures-evolution"), figures);
}
