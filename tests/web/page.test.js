// The page in a real browser: from a disk without a network, and from a static folder.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import { createRequire } from "node:module";
import path from "node:path";
import { after } from "node:test";
import { pathToFileURL } from "node:url";
import { EMULATES, close, page, test, until } from "../studio/helpers.js";
import { served } from "./folder.js";

const OUT = process.env.TROPISM_WEB;
const FILE = pathToFileURL(path.join(OUT, "tropism.html")).href;
const AXE = fs.readFileSync(createRequire(new URL("../studio/helpers.js", import.meta.url)).resolve("axe-core/axe.min.js"), "utf8");
const PHONE = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true };
const DESK = { viewport: { width: 1280, height: 800 } };

after(close);

/** Opens the file with the network off; requests of anything else fail the test. */
async function opened(t, hash = "", options = DESK) {
  const found = await page(t, "about:blank", options);
  const asked = [];
  found.on("request", (request) => /^(file|data|blob):/.test(request.url()) || asked.push(request.url()));
  await found.context().setOffline(true);
  t.after(() => assert.deepEqual(asked, []));
  const began = Date.now();
  await found.goto(`${FILE}${hash}`);
  found.began = began;
  return found;
}
const hours = async (found) => Number((await found.textContent("#hour b")).match(/^(\d+) h/)?.[1] ?? 0);

for (const [name, options] of Object.entries({ PHONE, DESK })) {
  test(`a bean is steered by hand: ${name}`, async (t) => {
    const found = await opened(t, "", options);
    await found.locator("#plane .bean").waitFor();
    const press = (selector) => (options.hasTouch ? found.tap(selector) : found.click(selector));
    await press("#right");
    await until(async () => (await hours(found)) >= 1, "the bean grows");
    t.diagnostic(`a moving bean after ${Date.now() - found.began} ms`);
    assert.equal(await found.getAttribute("#right", "aria-pressed"), "true");
    const tip = async () => Number((await found.textContent("#hour")).match(/tip ([−\d.]+)/)?.[1].replace("−", "-") ?? 0);
    await until(async () => (await tip()) > 0.5, "it bends to the lamp that is lit");
    await found.keyboard.press("ArrowLeft");
    assert.equal(await found.getAttribute("#left", "aria-pressed"), "true");
    await press("[data-speed='96']");
    // At the end of one's own bean the scores of the others stand beside one's own.
    await until(async () => /the end/.test(await found.textContent("#hour")), "the end of the own bean");
    await until(async () => !/–/.test(await found.textContent("#score")), "the scores of the others");
    for (const who of ["greedy", "rule", "champion"]) {
      await press(`[data-who=${who}]`);
      await press("#again");
      await press("#play");
      await until(async () => (await hours(found)) >= 20, `${who} steers the same bean`);
    }
    const isWide = await found.evaluate(() => document.documentElement.scrollWidth > innerWidth);
    assert.ok(!isWide, "nothing is wider than the screen");
  });
}

test("two drawn targets have a champion within seconds", async (t) => {
  const found = await opened(t, "#/draw");
  await found.locator("#targets .target-row").first().waitFor();
  for (let left = 3; left > 0; left--) await found.locator("#targets [data-remove]").first().click();
  const plane = found.locator("#plane svg");
  const box = await plane.boundingBox();
  for (const [x, y] of [[2, 6.5], [-2, 10.5]])
    await plane.click({ position: { x: ((340 + 34 * x) / 680) * box.width, y: ((600 - 34 * y) / 660) * box.height } });
  assert.equal(await found.locator("#targets .target-row").count(), 2);
  await until(async () => /within reach/.test(await found.locator("#targets").textContent()), "what is within reach");
  const began = Date.now();
  await found.click("#evolve");
  // An evolution that is over before the page first asks for it has a curve that is never shown.
  await Promise.race([found.locator("#curve svg").waitFor({ state: "attached" }), found.locator("#p-try").waitFor()]);
  await found.locator("#p-try").waitFor({ timeout: 60_000 });
  t.diagnostic(`a champion after ${Date.now() - began} ms`);
  await found.click("[data-speed='96']");
  await until(async () => /the end/.test(await found.textContent("#hour")), "the champion steers to the end");
  await found.locator("#decision svg").first().waitFor();
  await found.click("#unseen");
  await found.locator("#unseen-result table").waitFor();
  // Task and commands are there to be taken to a terminal.
  await found.click("#save-sheet summary");
  assert.match(await found.textContent("#task"), /targets = \[\[2.0, 6.5\], \[-2.0, 10.5\]\]/);
  assert.match(await found.textContent("#commands"), /tropism evolve --model virtual-bean.json/);
  // Of downloads this driver of Firefox says nothing.
  if (!EMULATES) return;
  const saved = found.waitForEvent("download");
  await found.click("#save");
  assert.match((await saved).suggestedFilename(), /\.toml$/);
});

test("a link holds seed and task", async (t) => {
  const task = JSON.stringify({ targets: [[1, 7]], way_points: [], obstacles: [] });
  const found = await opened(t, `#/play?${new URLSearchParams({ seed: "77", task })}`);
  await found.locator("#plane .bean").waitFor();
  assert.equal(await found.locator("#plane .cross").count(), 1);
  // Nobody has evolved for this task.
  assert.ok(await found.locator("[data-who=champion]").isHidden());
  await found.click("#share");
  assert.match(await found.textContent("#share-says"), /#\/play\?seed=77&task=/);
});

test("the paper's figures follow its settings", async (t) => {
  const found = await opened(t, "#/paper");
  await until(async () => /Best fitness/.test(await found.textContent("#paper-says")), "figures 4 to 7");
  assert.equal(await found.locator(".paper-figure svg").count(), 9);
  const before = await found.locator("#figures-evolution svg").last().innerHTML();
  await found.locator("[data-place='2']").focus();
  await found.keyboard.press("ArrowRight");
  await until(async () => !/Best/.test(await found.textContent("#paper-says")), "it computes again");
  await until(async () => /Best fitness/.test(await found.textContent("#paper-says")), "figures 6 and 7");
  assert.notEqual(await found.locator("#figures-evolution svg").last().innerHTML(), before);
});

test("the constants of plants are measured from their tracks", async (t) => {
  const found = await opened(t, "#/measure");
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "tropism-measure-"));
  t.after(() => fs.rmSync(folder, { recursive: true, force: true }));
  const words = ["grow", "--plants", "2", "--steps", "48", "--period", "10m", "--tilt", "60", "--dark", "--out", "beans"];
  assert.equal(spawnSync(process.env.TROPISM, words, { cwd: folder }).status, 0);
  await found.fill("#measure-tilt", "60");
  await found.setInputFiles("#measure-files", ["0001", "0002"].map((plant) => path.join(folder, "beans", `plant-${plant}.csv`)));
  await until(async () => /2 plants measured/.test(await found.textContent("#measure-says")), "the plants");
  assert.equal(await found.locator("#measure-found svg").count(), 8);
  // The table is that of the program.
  const { stdout } = spawnSync(process.env.TROPISM, "measure beans --tilt 60 --check-plants 0 --json".split(" "), { cwd: folder });
  const native = JSON.parse(stdout.toString()).plants[0].estimates.find(({ symbol }) => symbol === "G");
  const digits = (value) => String(Number(value.toPrecision(3)));
  const shown = await found.locator("#measure-found section").nth(1).textContent();
  assert.ok(shown.includes(`${digits(native.value)} [${native.interval.map(digits).join(", ")}]`), shown);
});

test("the tip in a virtual tent is found, and leads the lamp", async (t) => {
  const found = await opened(t, "#/tent", PHONE);
  const says = () => found.textContent("#tent-says");
  await until(async () => /0 h 00 tip at/.test(await says()), "the first photograph");
  await found.tap("#tent-play");
  await until(async () => /0 h [1-5]\d tip at .* (left|right) lamp/s.test(await says()), "the tip is followed");
  await found.tap("[data-steers=you]");
  await found.tap("#tent-right");
  await until(async () => /right lamp/.test(await says()), "the lamp that a person lights");
  if (!EMULATES) return;
  // Its photographs are taken up by the page like anybody's.
  const saved = found.waitForEvent("download");
  await found.tap("#tent-save");
  const file = await (await saved).path();
  const bytes = fs.readFileSync(file);
  await found.tap("a[href='#/photographs']");
  const photographs = [1, 2, 3].map((number) => ({ name: `${number}.jpg`, mimeType: "image/jpeg", buffer: bytes }));
  await found.setInputFiles("#photo-files", photographs);
  await until(async () => /3 photographs, 648 × 486/.test(await found.textContent("#photo-says")), "the photographs");
  await found.fill("#root-x", "323");
  await found.fill("#root-y", "417");
  await found.locator("#root-y").blur();
  await found.tap("#photo-track");
  await until(async () => /measured in 1 of 3/.test(await found.textContent("#photo-says")), "one photograph, and twice the same again");
  await found.locator("#photo-curve svg").waitFor();
});

test("nodes lead a bean along the path that is drawn", async (t) => {
  const found = await opened(t, "#/nodes", PHONE);
  const says = () => found.textContent("#wall-says");
  await until(async () => /h, left1 lit\./.test(await says()), "the first node of the path");
  await found.tap("[data-node='1']");
  await until(async () => /h, right1 lit\./.test(await says()), "the node that was touched");
  assert.equal(await found.locator("#wall [aria-pressed=true]").count(), 3);
  await until(async () => /the end. The tip passed 3 of 3 levels/.test(await says()), "the end of the path");
  await found.tap("[data-rule=dormant]");
  await until(async () => /h, all dark\./.test(await says()), "nodes that are never lit");
});

for (const theme of ["light", "dark"]) {
  test(`no findings of axe, ${theme}`, async (t) => {
    const found = await opened(t, "", { ...PHONE, colorScheme: theme, reducedMotion: "reduce" });
    await found.locator("#plane .bean").waitFor();
    await found.evaluate(AXE);
    const there = { play: "#plane .bean", draw: "#targets .target-row", paper: ".paper-figure svg", photographs: "#photo-files", measure: "#measure-files", tent: "#tent-photo image", nodes: "#wall .stem" };
    for (const [mode, selector] of Object.entries(there)) {
      await found.evaluate((hash) => (location.hash = hash), `#/${mode}`);
      await found.locator(selector).first().waitFor();
      const { violations } = await found.evaluate(() => globalThis.axe.run());
      assert.deepEqual(violations.map(({ id, nodes }) => [mode, id, nodes.map(({ html }) => html.slice(0, 120))]), []);
    }
  });
}

test("a static folder works without a network once it was opened", async (t) => {
  const { server, address } = await served();
  t.after(() => server.close());
  const found = await page(t, address, DESK);
  await found.evaluate(() => navigator.serviceWorker.ready);
  await until(() => found.evaluate(async () => (await caches.keys()).length > 0 && (await caches.match("whole.lzma")) !== undefined), "all of the page is kept");
  server.closeAllConnections();
  server.close();
  await found.reload();
  await found.click("#right");
  await until(async () => (await hours(found)) >= 1, "the bean grows");
  await found.click("a[href='#/tent']");
  await until(async () => /0 h 00 tip at/.test(await found.textContent("#tent-says")), "the first photograph");
});
