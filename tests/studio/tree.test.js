// What a screen reader finds, in its order: the accessibility tree of each page as text, beside those that somebody has read. UPDATE=1
// writes them anew.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after } from "node:test";
import { EMULATES, close, folder, run, studio, tab, test, until, visitor } from "./helpers.js";

after(close);

const READ = path.resolve("trees");

/** Numbers and versions differ from run to run and between machines; what they stand in does not. */
const masked = (tree) =>
  `${tree
    .replace(/−/g, "")
    .replace(/tropism-studio-\w+/g, "FOLDER")
    .replace(/\d+([.,:]\d+)*/g, "0")}\n`;

test("each page is read in its order", { skip: EMULATES ? false : "the trees are those of Chromium" }, async (t) => {
  const cwd = folder(t);
  await run(t, cwd, "grow", "--plants", "2", "--out", "tracks");
  await run(t, cwd, "fit", "tracks", "--out", "model.json");
  await run(t, cwd, "evolve", "--model", "model.json", "--out", "evolution", "--runs", "2", "--generations", "10");
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", "bean", "--steps", "12");
  await run(t, cwd, "transfer", "--controllers", "greedy", "--plants", "4", "--out", "transfer");
  const { address } = await studio(t, cwd);
  const context = await visitor(t);
  // Where it is, and what says that all of it is there.
  const pages = {
    overview: ["", /row "evolution/],
    run: ["run?at=bean", /slider "Photograph"[^]*listitem[^]*The run began/],
    evolution: ["evolution?at=evolution", /"Network of run[^]*"Paths of/],
    draw: ["draw", /within reach/],
    begin: ["begin", /textbox "Name of the run"/],
    devices: ["devices", /"Light flash"/],
    tune: ["tune?at=bean", /(button "found[^]*){12}/],
    compare: ["compare?at=evolution", /(img:[^]*){2}/],
    work: ["work?at=transfer", /row "greedy/],
    wall: ["wall", /the end/],
    login: ["login", /textbox "Token"/],
  };
  const unlike = [];
  for (const [name, [where, whole]] of Object.entries(pages)) {
    const opened = await tab(context, address + where);
    if (name !== "login") await until(async () => /Connected/.test(await opened.textContent("#link")), `${name} is connected`);
    // What comes later moves no more.
    let last = "";
    const tree = await until(async () => {
      await opened.waitForTimeout(700);
      const now = masked(await opened.locator("body").ariaSnapshot());
      const isWhole = now === last && whole.test(now);
      last = now;
      return isWhole && now;
    }, `${name} is there`);
    const file = path.join(READ, `${name}.yml`);
    if (process.env.UPDATE) {
      fs.mkdirSync(READ, { recursive: true });
      fs.writeFileSync(file, tree);
    }
    if (fs.readFileSync(file, "utf8") !== tree) {
      unlike.push(name);
      t.diagnostic(`${name}:\n${tree}`);
    }
    // Headings lead through a page: one of the first level, and none that skips a level.
    const levels = [...tree.matchAll(/heading ".*" \[level=0\]/g)].length;
    assert.ok(levels >= 1, name);
    const real = await opened.locator("h1, h2, h3, h4").evaluateAll((all) => all.filter((one) => one.checkVisibility()).map((one) => Number(one.tagName[1])));
    assert.equal(real.filter((level) => level === 1).length, 1, `${name}: ${real}`);
    assert.ok(real.every((level, index) => index === 0 || level <= real[index - 1] + 1), `${name}: ${real}`);
    await opened.close();
  }
  assert.deepEqual(unlike, [], "pages that are read otherwise than tests/studio/trees says");
});
