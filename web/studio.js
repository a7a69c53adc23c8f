// What stands in for the studio in a browser: the same questions of the same pages, answered by the program in the page.
// @ts-check
import { num, toast } from "../crates/tropism-studio/assets/dom.js";
import { Engine, carried, lead } from "./engine.js";
import { Evolution } from "./evolution.js";

export * from "../crates/tropism-studio/assets/dom.js";

/** Champions and rules by name, as their files. @type {Map<string, string>} */
export const controllers = new Map([
  ["paper", carried("champion")],
  ["rule", carried("rule")],
]);

/** Champions of drawings, by what was drawn: the paper's for the paper's. @type {Map<string, string>} */
export const championOf = new Map();

/** Evolutions by name, and what they last sent. @type {Map<string, { evolution: Evolution, view: any, hears: Set<(view: any) => void> }>} */
export const evolutions = new Map();

export const session = Promise.resolve({ session: { csrf: "", read_only: false } });

/** The page of a piece of work: all is on this one. */
export const pageOf = () => "#draw";

/** Saves a file from the page. @param {string} name @param {BlobPart} content */
export function download(name, content) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** Who steers a bean that is tried. @param {any} asked */
async function steerer({ who, at, lights }) {
  if (who === "you") return { lights };
  if (who === "greedy") return "greedy";
  const name = who === "rule" ? "rule" : at;
  const file = controllers.get(name) ?? (await evolutions.get(name)?.evolution.best());
  if (!file) throw new Error("No champion yet.");
  return { file };
}

/** What the wall of nodes needs. @type {Engine | null} */
let whole = null;

/** @type {Record<string, (values: any) => any>} */
const ANSWERS = {
  "api/wall": () => (whole ??= new Engine("whole")).ask({ nodes: {} }),
  "api/wall/try": ({ path, rule, seed }) => (whole ??= new Engine("whole")).ask({ wall: { path: path.split(","), rule, seed } }),
  "api/reach": () => JSON.parse(carried("reach")),
  "api/items": () => ({ items: [], queue: [] }),
  "api/models": () => ({ models: [] }),
  "api/task": ({ drawing }) => lead.ask({ task: { drawing: JSON.parse(drawing) } }),
  "api/try": async (asked) =>
    lead.ask({
      try: {
        drawing: JSON.parse(asked.drawing),
        by: await steerer(asked),
        seed: asked.seed,
        from: asked.from ?? 0,
      },
    }),
  "api/evolution": ({ at }) => evolutions.get(at)?.view ?? Promise.reject(new Error("not begun")),
  "api/draw/save": async ({ name, drawing }) => {
    const [{ task }, commands] = await Promise.all([
      lead.ask({ task: { drawing } }),
      lead.ask({ commands: { name, drawing } }),
    ]);
    download(`${name}.toml`, task);
    const champion = controllers.get(name);
    if (champion) download(`${name}-champion.json`, champion);
    return { file: `${name}.toml`, task, commands };
  },
  "api/draw/evolve": async ({ name, drawing, runs, generations, seed }) => {
    if (!(runs >= 1 && runs <= 64 && generations >= 1 && generations <= 10_000))
      throw new Error("Wanted 1 to 64 runs of 1 to 10 000 generations: more is for the terminal.");
    const { task, data, kind } = await lead.ask({ task: { drawing } });
    // All else is as in the paper.
    const evolution = { runs, generations };
    const commands = await lead.ask({ commands: { name, drawing, evolution, seed } });
    begin(name, { task: data, kind, evolution, seed }, JSON.stringify(drawing));
    return { at: name, task, commands };
  },
};

/** Those who hear of every evolution. @type {((name: string, view: any) => void)[]} */
const audience = [];
/** @param {(name: string, view: any) => void} hear */
export const onEvolution = (hear) => audience.push(hear);

/** Begins an evolution for a drawing, in place of one that is at work. @param {string} name @param {any} plan @param {string} drawing */
function begin(name, plan, drawing) {
  for (const { evolution } of evolutions.values()) evolution.stop();
  const known = { evolution: new Evolution(plan, tell), view: null, hears: new Set() };
  function tell(view) {
    if (view.state === "over") {
      controllers.set(name, view.results.runs[view.results.champion].file);
      championOf.set(drawing, name);
    }
    known.view = view;
    known.hears.forEach((hear) => hear(view));
    audience.forEach((hear) => hear(name, view));
  }
  evolutions.set(name, known);
  known.evolution.run().catch((error) => toast(`The evolution failed: ${error.message}`));
}

/** @param {string} path @param {any} [values] */
export const get = async (path, values = {}) => ANSWERS[path](values);

/** @param {string} path @param {any} body */
export const post = async (path, body) => ANSWERS[path](body);

/** Hears of an evolution, until what it gives is called. @param {string} path @param {string} event @param {(view: any) => void} take */
export function listen(path, event, take) {
  // The name of the evolution stands in the path, or in place of the event.
  const known = evolutions.get(new URLSearchParams(path.split("?")[1] ?? "").get("at") ?? event);
  known?.hears.add(take);
  if (known?.view) take(known.view);
  return () => known?.hears.delete(take);
}

/** Seconds in words. @param {number} seconds */
export const inSeconds = (seconds) => `${num(seconds, 1)} s`;
