// An evolution, live: is it learning, who wins, and why.
// @ts-check
import {
  $,
  asked,
  chip,
  command,
  cutOff,
  get,
  html,
  icon,
  insist,
  listen,
  num,
  ofBest,
  onYes,
  plural,
  post,
  put,
  refuse,
  say,
  session,
  span,
  toast,
  trusted,
  virtual,
  wordOf,
} from "./studio.js";
import { WAITS, band, cross, fit, lampPath, line, plot, wantedLine } from "./figure.js";
import { keep } from "./keep.js";
import { shape } from "./obstacle.js";

const at = asked.get("at") ?? "";

/** Until it is known, the unit of most tasks. @type {Partial<import("./types.d.ts").AboutEvolution>} */
let about = { unit: "cm" };
/** @type {import("./types.d.ts").EvolutionNews | undefined} */
let data;
/** The run that is shown; the champion of all, or the best so far, if it is `null`. @type {number | null} */
let picked = null;
/** @type {import("./types.d.ts").ShownChampion | undefined} */
let champion;

const bestRun = () => {
  if (data?.results) return data.results.champion;
  const latest = data?.latest ?? [];
  return latest.reduce((best, value, run) => (value !== null && (latest[best] ?? -Infinity) < value ? run : best), 0);
};
const shownRun = () => picked ?? bestRun();

const curve = fit($("#curve"), (width) => {
  if (!data) return WAITS;
  if (!data.marks.length) return '<p class="soft">After the first generation that is saved.</p>';
  const { marks, best, q1, q3, median } = data;
  const low = Math.min(0, ...best.map((run) => run[0] ?? 0));
  const high = Math.max(about.best ?? 1, ...data.top) * 1.05;
  const last = data.state === "over" ? marks.at(-1) : data.generations;
  const isWide = width > 600;
  return plot({
    w: width,
    h: Math.round(Math.min(360, width * (isWide ? 0.34 : 0.72))),
    x: [0, Math.max(2, last)],
    y: [Math.max(low, -about.best || low), high],
    xl: "generation",
    yl: `fitness (${about.unit})`,
    label: `Best fitness of ${plural(best.length, "run")}: after ${marks.at(-1)} generations the median is ${num(median.at(-1))} ${about.unit}, the best run has ${num(data.top.at(-1))}${ofBest(about.best)} ${about.unit}.`,
    body: (X, Y) => {
      const possible = about.best
        ? `<path class="dotted" d="M${X(0)} ${Y(about.best)}H${X(last)}"/><text x="${X(0) + 6}" y="${Y(about.best) + 14}">best possible, ${ofBest(about.best).slice(4)}</text>`
        : "";
      const others = best.map((run, index) =>
        index === shownRun() ? "" : `<path class="stroke thin quiet faint" d="${line(marks, run, X, Y)}"/>`,
      );
      return `<clipPath id="inside"><rect x="44" y="0" width="${width}" height="2000"/></clipPath><g clip-path="url(#inside)">${band(marks.slice(0, q1.length), q1, q3, X, Y)}${others.join("")}<path class="stroke bold best" d="${line(marks, median, X, Y)}"/><path class="stroke bold" d="${line(marks, best[shownRun()] ?? [], X, Y)}"/></g>${possible}`;
    },
  });
});

/** @param {string} id @param {"species" | "links"} key @param {string} name */
const small = (id, key, name) =>
  fit($(id), (width) => {
    const values = data?.[key] ?? [];
    if (!values.length) return "";
    const last = data.state === "over" ? data.marks.at(-1) : data.generations;
    return plot({
      w: width,
      h: 150,
      x: [0, Math.max(2, last)],
      y: [0, Math.max(1, ...values) * 1.1],
      xl: "generation",
      m: { l: 44, r: 12, t: 8, b: 36 },
      label: `${name}: ${num(values.at(-1), 1)} in the mean`,
      body: (X, Y) => `<path class="stroke bold best" d="${line(data.marks, values, X, Y)}"/>`,
    });
  });
const species = small("#species", "species", "Species");
const links = small("#links", "links", "Links a network");

/** Says the values under the pointer or the finger. @param {PointerEvent} event */
function read(event) {
  if (!data?.marks.length) return;
  const box = $("#curve").getBoundingClientRect();
  const last = data.state === "over" ? data.marks.at(-1) : data.generations;
  const generation = ((event.clientX - box.left - 44) / (box.width - 56)) * last;
  let place = data.marks.findIndex((mark) => mark >= generation);
  if (place < 0) place = data.marks.length - 1;
  const own = data.best[shownRun()]?.[place];
  $("#read").textContent =
    `generation ${data.marks[place]}: median ${num(data.median[place])}${own === undefined ? "" : `, run ${shownRun()} ${num(own)}`}`;
}
for (const name of ["pointerdown", "pointermove"]) $("#curve").addEventListener(name, read);

function facts() {
  const top = data.top.at(-1);
  put($("#best"), top === undefined ? "–" : html`${num(top)} <small>${ofBest(about.best)} ${about.unit}</small>`);
  const middle = data.median.at(-1);
  $("#median-name").textContent = `Median of ${plural(data.best.length, "run")}`;
  put($("#median"), middle === undefined ? "–" : html`${num(middle)} <small>${about.unit}</small>`);
  const generation = Math.floor(data.done / Math.max(1, data.best.length));
  put($("#generation"), html`${generation} <small>of ${data.generations}</small>`);
  $("#done").value = data.total ? data.done / data.total : 0;
  const rate = data.rate ?? (data.results ? data.evaluations / Math.max(0.001, data.results.seconds) : null);
  $("#rate").textContent = rate ? Math.round(rate).toLocaleString("en").replaceAll(",", " ") : "–";
  $("#left").textContent =
    data.state === "over" ? "done" : data.state === "live" ? (data.left_s ? span(data.left_s) : "soon known") : "paused";
}

function table() {
  const count = data.median.length;
  const places = [
    ...new Set(
      Array.from({ length: Math.min(10, count) }, (_, index) =>
        Math.round((index * (count - 1)) / Math.max(1, Math.min(10, count) - 1)),
      ),
    ),
  ];
  const row = (/** @type {number} */ place) =>
    html`<tr>
      <th scope="row">${data.marks[place]}</th>
      <td class="n">${num(data.q1[place])}</td>
      <td class="n">${num(data.median[place])}</td>
      <td class="n">${num(data.q3[place])}</td>
      <td class="n">${num(data.top[place])}</td>
    </tr>`;
  put(
    $("#table"),
    html`<thead>
        <tr>
          <th scope="col">Generation</th>
          <th scope="col" class="n">Lower quartile</th>
          <th scope="col" class="n">Median</th>
          <th scope="col" class="n">Upper quartile</th>
          <th scope="col" class="n">Best</th>
        </tr>
      </thead>
      <tbody>
        ${places.map(row)}
      </tbody>`,
  );
}

/** The runs from the one to use on plants. */
function ranked() {
  /** @type {Partial<import("./types.d.ts").ShownRun>[]} */
  const rows = data.results?.runs ?? data.latest.map((best, run) => ({ run, best }));
  const by = (/** @type {typeof rows[0]} */ one) => one.expected ?? one.mean ?? one.best ?? -Infinity;
  return [...rows].sort((one, other) => Number(other.run === bestRun()) - Number(one.run === bestRun()) || by(other) - by(one));
}

let listed = "";
function runs() {
  const rows = ranked();
  const cell = (/** @type {number | null | undefined} */ value) => html`<td class="n">${value === null || value === undefined ? "–" : num(value)}</td>`;
  const row = (/** @type {typeof rows[0]} */ one) =>
    html`<tr>
      <th scope="row">
        ${one.run}${one.run === bestRun() ? html` <span class="chip live">${data.results ? "champion" : "best"}</span>` : ""}
      </th>
      ${cell(one.best)}${cell(one.mean)}${cell(one.expected)}
    </tr>`;
  put(
    $("#runs"),
    html`<thead>
        <tr>
          <th scope="col">Run</th>
          <th scope="col" class="n">Best</th>
          <th scope="col" class="n">Mean of 200</th>
          <th scope="col" class="n">Expected</th>
        </tr>
      </thead>
      <tbody>
        ${rows.slice(0, 20).map(row)}
      </tbody>`,
  );
  $("#ranking").textContent = data.results
    ? `Listed by what each is expected to do on plants it has not met, not by its best single score: a network that fits one model plant too well does worse on others. In ${about.unit}.`
    : `While it evolves, listed by the best single score so far, which selects for luck. The expected fitness on unseen plants is known at the end. In ${about.unit}.`;
  const key = `${data.state} ${rows.length} ${bestRun()}`;
  if (key === listed) return;
  listed = key;
  const option = (/** @type {typeof rows[0]} */ one) =>
    html`<option value="${one.run}">
      run ${one.run}${one.run === bestRun() ? (data.results ? ", champion" : ", best so far") : ""}
    </option>`;
  put($("#pick"), rows.map(option));
  $("#pick").value = String(shownRun());
  show();
}

/** A figure of the server, with a name for those who do not see it. @param {string} svg @param {string} name */
const named = (svg, name) => trusted(svg.replace("<svg", `<svg role="img" aria-label="${name}"`));

let asks = 0;
async function show() {
  const ask = ++asks;
  const isChampion = shownRun() === bestRun() && data.results;
  try {
    const found = await get("api/evolution/champion", { at, run: isChampion ? null : shownRun() });
    if (ask === asks) champion = found;
  } catch (error) {
    if (ask === asks) put($("#network"), html`<p class="soft">${wordOf(error)}</p>`);
    return;
  }
  if (ask !== asks) return;
  $("#network-name").textContent = `Network of run ${shownRun()}`;
  const size = `${plural(champion.hidden, "hidden neuron")}, ${plural(champion.links, "link")}`;
  $("#network-size").textContent = size;
  put($("#network"), champion.network ? named(champion.network.svg, `Network of run ${shownRun()}: ${size}`) : html`<p class="soft">${champion.too_large}</p>`);
  put($("#decision"), champion.decision ? named(champion.decision.svg, "The lamp for each place of the tip") : "");
  $("#decision-text").textContent = champion.decision?.caption ?? "";
  const scores = champion.paths.map((path) => path.fitness);
  $("#paths-text").textContent = scores.length
    ? `${plural(scores.length, "plant")}: ${scores.map((score) => num(score, 1)).join(", ")} ${about.unit}. ${champion.label}`
    : "The folder of the evolution has no model.json to simulate with.";
  paths();
}

const paths = fit($("#paths"), (width) => {
  const all = champion?.paths ?? [];
  if (!all.length) return "";
  const targets = about.targets ?? [];
  const aim = about.drawing?.form?.line ?? [];
  const goals = [...targets, ...aim];
  const points = all.flatMap((path) => path.points);
  const reach = Math.max(8, ...points.map(([x]) => Math.abs(x)), ...goals.map(([x]) => Math.abs(x))) + 0.5;
  const high = Math.max(...points.map(([, y]) => y), ...goals.map(([, y]) => y)) + 1;
  return plot({
    w: width,
    h: Math.round(Math.min(420, width * 0.78)),
    x: [-reach, reach],
    y: [aim.length ? -0.3 : 3.5, high],
    xl: "tip x (cm)",
    yl: "tip y (cm)",
    label: `Paths of ${plural(all.length, "simulated plant")} ${aim.length ? "along the line that the stem is to have" : `past ${plural(targets.length, "target")}`}`,
    body: (X, Y) =>
      wantedLine(aim, X, Y) +
      (about.obstacles ?? []).map((obstacle) => shape(obstacle, X, Y)).join("") +
      targets.map(([, y]) => `<path class="dotted" d="M${X(-reach)} ${Y(y).toFixed(1)}H${X(reach)}"/>`).join("") +
      all
        .map(
          (path, index) =>
            `<g class="${index ? "pale" : ""}">${lampPath(
              path.points.map(([x, y], step) => ({ x, y, lamp: path.lamps[step] })),
              X,
              Y,
              index ? "thin" : "bold",
            )}</g>`,
        )
        .join("") +
      targets.map(([x, y], index) => cross(X(x), Y(y), index + 1)).join(""),
  });
});

$("#pick").onchange = () => {
  picked = Number($("#pick").value);
  curve();
  show();
};

function state() {
  const word = { live: "Evolving", over: "Done", stopped: "Paused" }[data.state];
  put($("#state"), [chip(data.state, word), about.is_virtual ? virtual("on a model of virtual beans") : ""]);
  const button = $("#pause");
  button.hidden = data.state === "over";
  $("#extend").disabled = data.state === "live";
  $("#run-it").hidden = data.state !== "over";
  put(button, data.state === "live" ? html`${icon("pause")}Pause` : html`${icon("play")}Go on`);
}

function all() {
  state();
  facts();
  curve();
  species();
  links();
  table();
  runs();
}

$("#pause").onclick = async () => {
  $("#pause").disabled = true;
  try {
    if (data.state === "live") {
      toast("Pausing: the runs are saved.");
      await insist("api/evolution/pause", { at }, "The pause");
    } else {
      await post("api/evolution/resume", { at });
      toast("It goes on when its turn comes.");
    }
  } catch (error) {
    say(error);
  }
  $("#pause").disabled = false;
};

$("#extend").onclick = () => {
  $("#until").min = String(data.generations + 1);
  $("#until").value = String(2 * data.generations);
  $("#more").showModal();
  $("#until").focus();
  $("#until").select();
};
onYes($("#more"), async () => {
  await post("api/evolution/extend", { at, generations: Number($("#until").value) }).then(
    () => toast("It goes on when its turn comes."),
    say,
  );
});

$("#run-it").href = `begin?${new URLSearchParams({ form: "run", controller: `${at}/champion.json` })}`;

// Both are asked for at once: neither waits for the other.
listen(
  "evolution",
  at,
  (found) => {
    data = found;
    all();
  },
  (isLost, seconds) =>
    put($("#banner"), isLost ? cutOff(seconds, "The evolution goes on: it does not need this page.") : ""),
);
session.then(async ({ session: own }) => {
  if (!own) return;
  try {
    about = await get("api/evolution", { at });
  } catch (error) {
    return refuse(error);
  }
  $("#name").textContent = about.name;
  document.title = `${about.name} · tropism studio`;
  $("#about").textContent =
    `${plural(about.runs, "run")} of ${plural(about.generations, "generation")}, ${about.population} networks each, for ${about.task}. Seed ${about.seed}.`;
  keep("evolution", at, { name: about.name });
  put($("#commands"), [
    command(about.commands.status),
    command(about.commands.stop),
    command(about.commands.resume),
    command(about.commands.extend),
    command(about.commands.run),
  ]);
  $("#try").href = `draw?${new URLSearchParams({ at, drawing: JSON.stringify(about.drawing) })}`;
  $("#try").hidden = false;
  if (data) all();
  paths();
});
