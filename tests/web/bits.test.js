// The same seed gives the same files in the page's module as by the native program, however the work is divided.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { test } from "node:test";
import { module } from "./module.js";

const folder = fs.mkdtempSync(path.join(os.tmpdir(), "tropism-web-"));
process.on("exit", () => fs.rmSync(folder, { recursive: true, force: true }));
const native = (line) => {
  const { status, stderr } = spawnSync(process.env.TROPISM, line.split(" "), { cwd: folder });
  assert.equal(status, 0, `${line}: ${stderr}`);
};
const made = (name) => fs.readFileSync(path.join(folder, name), "utf8");
/** The answer to a question that can be answered. */
const asked = (ask, question, bytes) => {
  const { json } = ask(question, bytes);
  assert.equal(json.error, undefined, JSON.stringify(question).slice(0, 200));
  return json;
};

test("a model and a champion are those of the native program", async () => {
  const ask = await module();
  const drawing = { targets: [[-3, 8.5], [2, 6]] };
  const evolution = { runs: 3, generations: 12 };
  const { task, data, kind } = asked(ask, { task: { drawing } });
  fs.writeFileSync(path.join(folder, "drawn.toml"), task);
  const commands = asked(ask, { commands: { name: "drawn", drawing, evolution, seed: 7 } });
  for (const line of commands) native(line.replace(/^tropism /, ""));

  const { file } = asked(ask, { fit: { kind } });
  assert.equal(file, made("virtual-bean.json"));
  // One module does run 1 in uneven slices, another one the rest.
  const other = await module("play");
  const champions = [];
  for (const [hand, own, slices] of [
    [ask, [1], [1, 7, 100]],
    [other, [2, 0], [100]],
  ]) {
    asked(hand, { model: { file } });
    asked(hand, { begin: { task: data, evolution, seed: 7, own } });
    const last = slices.map((generations) => asked(hand, { advance: { generations } })).at(-1);
    assert.ok(last.is_done);
    champions.push(...asked(hand, { finish: {} }));
  }
  champions.sort((one, two) => one.run - two.run);
  const { run } = asked(ask, { choose: { trials: champions.map(({ trial }) => trial) } });
  assert.equal(champions[run].file, made("drawn/champion.json"));
  champions.forEach((champion) => assert.equal(champion.file, made(`drawn/champions/run-0${champion.run}.json`)));
});

test("photographs are tracked as by the native program", async () => {
  const ask = await module();
  native("run --rig greenhouse --controller periodic --steps 7 --out tent");
  const place = "--base 323,417 --roi 113,67,421,344 --scale 8.757 --up up --time even";
  native(`track tent/photographs ${place} --out native.csv`);
  const photographs = path.join(folder, "tent", "photographs");
  const listed = fs.readdirSync(photographs);
  const names = asked(ask, { order: { names: listed } }).map((place) => listed[place]);
  const bytes = names.map((name) => fs.readFileSync(path.join(photographs, name)));
  const first = bytes.slice(0, 6);
  const region = { x: 113, y: 67, width: 421, height: 344 };
  const track = { px_per_cm: 8.757, base: { x: 323, y: 417 }, region, period_min: 5, first: first.map(({ length }) => length) };
  asked(ask, { track }, Buffer.concat(first));
  names.forEach((name, step) => asked(ask, { next: { name } }, bytes[step]));
  const rows = (text) => {
    const [head, ...lines] = text.trim().split("\n").map((line) => line.split(","));
    return lines.map((line) => Object.fromEntries(head.map((name, column) => [name, line[column]])));
  };
  const found = rows(ask({ csv: {} }).bytes.toString());
  const wanted = rows(made("native.csv"));
  assert.equal(found.length, 8);
  found.forEach((row, step) => Object.entries(row).forEach(([name, cell]) => assert.equal(cell, wanted[step][name], `${name} of ${step}`)));
  const { error } = ask({ track: { period_min: 5, first: [9] } }, Buffer.from("no JPEG")).json;
  assert.match(error, /too few bytes/);
});

test("what cannot be done is a sentence", async () => {
  const ask = await module();
  const error = (question) => ask(question).json.error;
  assert.match(error({ nothing: {} }), /unknown variant/);
  assert.match(error({ task: { drawing: { targets: [] } } }), /found 0 targets/);
  assert.match(error({ try: { drawing: { targets: [[0, 6]] }, by: { lights: "lx" }, seed: 1 } }), /wanted l or r/);
  assert.match(error({ begin: { task: { kind: "targets", targets: [[0, 6]] }, evolution: { runs: 1 }, seed: 1, own: [0] } }), /fit a model first/);
  assert.match(error({ advance: { generations: 1 } }), /begin an evolution first/);
  assert.match(error({ model: { file: "{" } }), /found no model|EOF/);
  assert.match(error({ champion: { champion: "[]", seed: 1 } }), /.+/);
});
