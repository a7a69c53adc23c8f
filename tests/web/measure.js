// How long the page's module takes in Node: node tests/web/measure.js, with the folder of the page in TROPISM_WEB. The native program does the same questions:
// cargo run --profile web -p tropism-wasm --example speed. With photographs as further arguments it tracks them, too.
import fs from "node:fs";
import path from "node:path";
import { module } from "./module.js";

const ask = await module();
/** Wall-clock and processor time since a moment; what the machine spends on other work is in the first alone. */
const since = (wall, before) => {
  const { user, system } = process.cpuUsage(before);
  return `${Math.round(performance.now() - wall)} ms (processor ${Math.round((user + system) / 1000)} ms)`;
};
const time = (what, question, bytes) => {
  const [wall, before] = [performance.now(), process.cpuUsage()];
  const { json } = ask(question, bytes);
  if (json.error) throw new Error(json.error);
  if (what) console.log(`${what}: ${since(wall, before)}`);
  return json;
};
time("six beans of 1000 steps and their model", { fit: {} });
const task = { kind: "targets", targets: [[3, 6], [-5, 9], [-1, 13.5]], end_height_cm: 13.8 };
time("beginning", { begin: { task, evolution: { runs: 2, generations: 300 }, seed: 1, own: [0, 1] } });
time("two runs of 300 generations", { advance: { generations: 300 } });
const champions = time("their champions", { finish: {} });
console.log(`best fitness ${champions[0].best} and ${champions[1].best} cm`);

const files = process.argv.slice(2).flatMap((place) => (fs.statSync(place).isDirectory() ? fs.readdirSync(place).map((name) => path.join(place, name)) : [place]));
const pictures = files.filter((name) => /\.(jpe?g|png|tiff?)$/i.test(name)).sort();
if (pictures.length) {
  const bytes = pictures.map((name) => fs.readFileSync(name));
  const first = bytes.slice(0, 6);
  const [wall, before] = [performance.now(), process.cpuUsage()];
  time("", { track: { period_min: 5, first: first.map(({ length }) => length) } }, Buffer.concat(first));
  bytes.forEach((photograph, place) => time("", { next: { name: path.basename(pictures[place]) } }, photograph));
  console.log(`${pictures.length} photographs: ${since(wall, before)}`);
}
