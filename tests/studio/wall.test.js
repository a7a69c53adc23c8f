// The wall of nodes: a path is drawn by touch, tried on a virtual bean and saved; and a real wall is watched by its journal.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after } from "node:test";
import { close, folder, page, run, studio, test, until } from "./helpers.js";

after(close);

const PHONE = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true };

test("a path is drawn, tried and saved by touch", async (t) => {
  const cwd = folder(t);
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}wall`, PHONE);
  const says = () => opened.textContent("#wall-says");
  const names = () => opened.locator("#wall [aria-pressed=true]").evaluateAll((nodes) => nodes.map((node) => node.getAttribute("aria-label").split(":")[0]));
  await until(async () => /h, \w+ lit\./.test(await says()), "a lit node");
  for (const node of [1, 2, 5]) {
    await opened.tap(`[data-node='${node}']`);
    await until(async () => (await opened.getAttribute(`[data-node='${node}']`, "aria-pressed")) === "true", "the node is on the path");
  }
  assert.deepEqual((await names()).sort(), ["left2", "right1", "right3"]);
  await until(async () => /the end. The tip passed 3 of 3 levels/.test(await says()), "the end of the path");
  await opened.tap("[data-rule=dormant]");
  await until(async () => /h, all dark\./.test(await says()), "nodes that are never lit");

  await opened.tap("#save-sheet summary");
  await opened.fill("#name", "zigzag");
  await opened.tap("#save");
  await until(async () => /zigzag.toml is saved/.test(await opened.textContent("#commands")), "it is saved");
  assert.match(fs.readFileSync(path.join(cwd, "zigzag.toml"), "utf8"), /path = \["right1", "left2", "right3"\]/);
  assert.match(await run(t, cwd, "wall", "zigzag.toml", "--rules", "machine", "--plants", "2"), /6 of 6/);
  // Another path may not take its name.
  await opened.tap("[data-node='0']");
  await opened.tap("#save");
  await until(async () => /another file has this name/.test((await opened.textContent("body")) ?? ""), "the refusal");
});

test("a real wall is watched by its journal", async (t) => {
  const cwd = folder(t);
  const { address } = await studio(t, cwd);
  fs.mkdirSync(path.join(cwd, "june"));
  const wall = fs.readFileSync(path.resolve("../../tasks/wall.toml"), "utf8");
  fs.writeFileSync(path.join(cwd, "june/wall.toml"), wall.replace('path = "random"', 'path = ["left1", "right2", "left3"]'));
  const journal = path.join(cwd, "june/nodes.csv");
  fs.writeFileSync(journal, "step,node,reading,level,sees,done,lamp_is_dead\n7,left1,0.1000,255,0,0,0\n7,right2,,0,0,0,0\n");
  const opened = await page(t, `${address}wall?at=june`);
  const says = () => opened.textContent("#wall-says");
  await until(async () => /step 7, left1 lit\./.test(await says()), "the latest step");
  assert.match(await opened.innerHTML("#wall"), /left3: on the path, silent/);
  assert.ok(await opened.locator("#wall-steer").isHidden());
  // The next step comes by itself.
  fs.appendFileSync(journal, "8,left1,1.2000,0,1,1,0\n8,right2,0.1000,255,0,0,0\n9,le");
  await until(async () => /step 8, right2 lit\./.test(await says()), "the next step");
  assert.match(await opened.innerHTML("#wall"), /left1: on the path, sees the plant/);
});
