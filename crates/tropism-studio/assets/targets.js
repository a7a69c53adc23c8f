// The targets of a run, or its form of the stem: what was reached, and what is expected.
// @ts-check
import { $, get, html, num, put, wordOf } from "./studio.js";
import { path } from "./path.js";
import { at, isOn, run } from "./record.js";

/** Why nothing is expected. */
let unpredicted = "";

export function targets() {
  const all = run.about.targets ?? [];
  const isForm = Boolean(run.status.off);
  $("#targets-scroll").hidden = all.length === 0 && !isForm;
  sayExpected();
  if (isForm) return form();
  if (!all.length) return;
  const row = (/** @type {typeof all[0]} */ target, /** @type {number} */ index) => {
    const crossed = run.status.crossings?.[index];
    const name = html`<th scope="row" class="num">${index + 1} &nbsp;${num(target.x, 1)}, ${num(target.y, 1)}</th>`;
    if (crossed)
      return html`<tr>
        ${name}
        <td>at step ${crossed.step}, after ${num(crossed.hours, 1)} h</td>
        <td class="n">${num(crossed.beside, 1)}</td>
      </tr>`;
    const expected = isOn() && run.prediction?.targets?.find((one) => one.y === target.y);
    if (expected?.hours)
      return html`<tr>
        ${name}
        <td>
          in ${num(expected.hours[0], 1)} to ${num(expected.hours[1], 1)} h, within 1 cm with a probability of
          ${num(expected.probability, 2)}
        </td>
        <td class="n">${num(expected.beside[0], 1)} to ${num(expected.beside[1], 1)}</td>
      </tr>`;
    return html`<tr>
      ${name}
      <td>not yet</td>
      <td class="n">–</td>
    </tr>`;
  };
  put(
    $("#targets"),
    html`<thead>
        <tr>
          <th scope="col">Target</th>
          <th scope="col">Crosses its height</th>
          <th scope="col" class="n">Beside it (cm)</th>
        </tr>
      </thead>
      <tbody>
        ${all.map(row)}
      </tbody>`,
  );
}

/** A form of the stem: how far off it is now, and when it counts. */
function form() {
  const { now: own, end } = run.status.off;
  const height = run.steps.findLast((one) => one.y !== null);
  const expected = isOn() && run.prediction?.form;
  const value = (/** @type {number | null | undefined} */ one) => (one === null || one === undefined ? "–" : num(one, 1));
  const between = (/** @type {[number, number]} */ range) => `${num(range[0], 1)} to ${num(range[1], 1)}`;
  const when = end ? `at step ${end.step}, after ${num(end.hours, 1)} h` : expected?.hours ? `in ${between(expected.hours)} h` : "not yet";
  put(
    $("#targets"),
    html`<thead>
        <tr>
          <th scope="col">Form of the stem</th>
          <th scope="col">Counts</th>
          <th scope="col" class="n">Off (cm)</th>
        </tr>
      </thead>
      <tbody>
        <tr>
          <th scope="row">now</th>
          <td>${height ? `tip at ${num(height.y, 1)} cm` : "not yet"}</td>
          <td class="n">${value(own)}</td>
        </tr>
        <tr>
          <th scope="row">at ${num(run.about.end_height ?? 0, 1)} cm</th>
          <td>${when}</td>
          <td class="n">${end ? value(end.off) : expected?.off ? between(expected.off) : "–"}</td>
        </tr>
      </tbody>`,
  );
}

/** Says what is expected, or why nothing is. */
function sayExpected() {
  $("#fan-key").hidden = !isOn() || !run.prediction;
  const text = () => {
    if (!isOn()) return "";
    if (!run.prediction) return unpredicted && `No prediction: ${unpredicted}.`;
    const { plants, model, form: reached, goes_through: isLoose } = run.prediction;
    const done = reached ? ` ${reached.done} of ${plants} come within ${num(run.about.within ?? 0, 1)} cm.` : "";
    const loose = isLoose ? " Nothing holds a stem back in the model: it goes through obstacles." : "";
    return `From ${plants} plants that go on in ${model} from what was seen so far, under the run’s controller: the range of eight in ten.${done}${loose} A guess, not a promise.`;
  };
  $("#predicted").textContent = text();
}

/** Asks what is expected, and draws it. */
export async function predict() {
  if (!isOn() || run.steps.length < 2) return;
  try {
    run.prediction = await get("api/run/prediction", { at });
    unpredicted = "";
  } catch (error) {
    run.prediction = undefined;
    unpredicted = wordOf(error).replace(/\.$/, "");
  }
  path();
  targets();
}
