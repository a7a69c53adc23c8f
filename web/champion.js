// What an evolution brought: species, decisions of the champion, unseen beans.
// @ts-check
import { drawing } from "../crates/tropism-studio/assets/drawing.js";
import { fit, line, plot } from "../crates/tropism-studio/assets/figure.js";
import { view } from "../crates/tropism-studio/assets/plane.js";
import { lead } from "./engine.js";
import { $, controllers, html, inSeconds, num, onEvolution, plural, put, say, trusted } from "./studio.js";

/** Seeds of unseen beans: none that was tried on the page before. */
const SEEDS = Array.from({ length: 12 }, (_, bean) => 5001 + bean);

/** What is shown, and of which evolution. @type {{ name: string, found: any }} */
let shown = { name: "", found: null };

const species = fit($("#species"), (width) => {
  const found = shown.found;
  if (!found?.marks.length) return "";
  return plot({
    w: width,
    h: 130,
    x: [0, found.generations],
    y: [0, Math.max(2, ...found.species) * 1.1],
    xl: "generation",
    yl: "species",
    label: `Mean number of species, now ${num(found.species.at(-1), 1)}`,
    body: (x, y) => `<path class="stroke bold quiet" d="${line(found.marks, found.species, x, y)}"/>`,
  });
});

onEvolution(async (name, found) => {
  const isNew = shown.name !== name;
  shown = { name, found };
  $("#champion-sheet").hidden = false;
  species();
  if (isNew) {
    put($("#decision"), "");
    put($("#unseen-result"), "");
  }
  $("#unseen").disabled = found.state !== "over";
  if (found.state !== "over") {
    $("#champion-says").textContent = `${plural(found.evaluations, "network")} evaluated on simulated plants so far.`;
    return;
  }
  const { runs, champion } = found.results;
  const chosen = runs[champion];
  $("#champion-says").textContent =
    `${plural(found.evaluations, "network")} in ${inSeconds(found.seconds)}. The champion of run ${champion + 1}, with ${plural(chosen.links, "link")}: ` +
    `mean fitness ${num(chosen.trial.mean, 1)} cm on models of single plants${chosen.withheld ? `, which is no expectation: ${chosen.withheld}` : ""}.`;
  try {
    const found = await lead.ask({ champion: { champion: chosen.file, seed: 1 } });
    const figures = [found.decision, found.network].filter(Boolean);
    if (shown.name === name) put($("#decision"), figures.map(({ svg, title }) => html`<h3>${title}</h3>${trusted(svg)}`));
  } catch (error) {
    say(error);
  }
});

$("#unseen").onclick = async () => {
  const file = controllers.get(view.at) ?? controllers.get(shown.name);
  if (!file) return;
  $("#unseen").disabled = true;
  try {
    const found = await lead.ask({ unseen: { drawing: drawing(), by: { file }, seeds: SEEDS } });
    const row = (name, { trial, scores }) =>
      html`<tr>
        <th scope="row">${name}</th>
        <td class="n">${num(trial.mean, 1)} ± ${num(trial.sd, 1)}</td>
        <td class="n">${num(Math.min(...scores), 1)}</td>
      </tr>`;
    put(
      $("#unseen-result"),
      html`<table class="score">
        <thead>
          <tr><th scope="col">${SEEDS.length} unseen virtual beans</th><th scope="col" class="n">Fitness (cm)</th><th scope="col" class="n">Worst</th></tr>
        </thead>
        <tbody>${row("Champion", found.own)}${row("Greedy", found.greedy)}</tbody>
      </table>`,
    );
  } catch (error) {
    say(error);
  }
  $("#unseen").disabled = false;
};
