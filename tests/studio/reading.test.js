// What is read on a page, whatever the eyes, the paper and the words: 400 %, print, long names, long errors, and what is not known yet.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after } from "node:test";
import { BROWSERS, EMULATES, close, folder, page, run, studio, test, until, visitor, tab } from "./helpers.js";

after(close);

const PHONE = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true };
const LONG = `a-${"very-".repeat(11)}long`;
const isConnected = (opened) => until(async () => /Connected/.test(await opened.textContent("#link")), "the page is connected");
const runOf = (t, cwd, out, ...more) => run(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", out, "--steps", "20", ...more);

test("every page fits at 400 %, on paper, and with the longest names", async (t) => {
  const cwd = folder(t);
  await runOf(t, cwd, LONG);
  await run(t, cwd, "note", LONG, "x".repeat(500));
  fs.writeFileSync(path.join(cwd, LONG, "tags.txt"), `${"a".repeat(30)}\n${"b".repeat(30)}\n`);
  const { address } = await studio(t, cwd);
  // A window of 1280 x 1024 at 400 %.
  const small = { viewport: { width: 320, height: 256 } };
  for (const name of ["", `run?at=${LONG}`, "draw", "begin", "devices", `tune?at=${LONG}`, "compare"]) {
    const opened = await page(t, address + name, small);
    await isConnected(opened);
    await opened.waitForTimeout(700);
    const [wide, width] = await opened.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(wide <= width, `${name} is ${wide} wide in ${width}`);
    const covered = await opened.evaluate(() =>
      [...document.querySelectorAll("body *")]
        .filter((one) => ["fixed", "sticky"].includes(getComputedStyle(one).position) && one.getClientRects().length)
        .map((one) => one.className || one.id),
    );
    assert.deepEqual(covered, [], `${name}: nothing stands over the text`);
    if (EMULATES) await opened.emulateMedia({ media: "print" });
    const pressed = await opened.evaluate(() =>
      [...document.querySelectorAll("button, .btn, nav")]
        .filter((one) => one.getClientRects().length)
        .map((one) => one.id || one.textContent),
    );
    if (EMULATES) assert.deepEqual(pressed, [], `${name}: no button on paper`);
    await opened.context().close();
  }
});

for (const browser of BROWSERS) {
  test(`no page is wider than the narrowest phone (${browser})`, async (t) => {
    const cwd = folder(t);
    await runOf(t, cwd, LONG);
    const { address } = await studio(t, cwd);
    const context = await visitor(t, { viewport: { width: 320, height: 640 } }, browser);
    for (const name of ["", `run?at=${LONG}`, "draw", "begin", "devices", `tune?at=${LONG}`, "compare", "login"]) {
      const opened = await tab(context, address + name);
      if (name !== "login") await isConnected(opened);
      const wide = () => opened.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      assert.ok((await wide()) <= 0, `${name} by ${await wide()}`);
      // Letters of other systems are wider, and a page that is cut off says more.
      await opened.evaluate(() => {
        document.querySelectorAll(".brand, .link-state").forEach((one) => (one.style.letterSpacing = "0.15em"));
        const state = document.querySelector("#link");
        if (state) state.dataset.s = "lost";
      });
      assert.ok((await wide()) <= 0, `${name} with wide letters by ${await wide()}`);
      await opened.close();
    }
  });
}

test("a long error is folded under a sentence", async (t) => {
  const cwd = folder(t);
  fs.writeFileSync(path.join(cwd, "rig.toml"), `[camera]\ndriver = "command"\ncommand = ["cat", "${"no-such-photograph/".repeat(12)}a.jpg"]\n[lamps]\nleft = ["true"]\nright = ["true"]\ndark = ["true"]\n[calibration]\npx_per_cm = 11.0\nwidth = 648\nheight = 486\n[calibration.base]\nx = 300.0\ny = 400.0\n`);
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}devices?rig=rig.toml`, PHONE);
  await until(() => opened.locator("#take").isEnabled(), "the rig is known");
  await opened.tap("#take");
  const folded = opened.locator("#banner .folded");
  await folded.waitFor({ timeout: 90_000 });
  assert.ok((await folded.locator("summary").textContent()).length <= 111);
  assert.ok(!(await folded.locator("p").isVisible()));
  await folded.locator("summary").tap();
  assert.ok(await folded.locator("p").isVisible());
});

test("what is not known yet is not told", async (t) => {
  const cwd = folder(t);
  await runOf(t, cwd, "bean");
  const { address } = await studio(t, cwd);
  const context = await visitor(t, PHONE);
  // The answers come when the test lets them.
  let free = () => {};
  const held = new Promise((done) => (free = () => done(undefined)));
  // A shared worker asks past the test.
  await context.addInitScript("delete globalThis.SharedWorker");
  await context.route(/api\/(stream|task|reach|try)/, async (route) => {
    await held;
    await route.continue().catch(() => {});
  });
  const opened = await tab(context, `${address}draw`);
  await opened.locator("#plane svg").waitFor();
  await opened.waitForTimeout(600);
  assert.match(await opened.textContent("#possible"), /^Working out/);
  const own = await tab(context, `${address}run?at=bean`);
  await own.waitForTimeout(600);
  assert.match(await own.textContent("#no-photo"), /Reading the run/);
  assert.ok(await own.locator("#series .skeleton").isVisible());
  const overview = await tab(context, address);
  await overview.locator("#rows .skeleton").first().waitFor();
  assert.ok(!(await overview.locator("#empty").isVisible()));
  free();
  await until(async () => /Best possible fitness \d/.test(await opened.textContent("#possible")), "what can be reached");
});

test("a draft keeps its name, and Save keeps writing the same file", async (t) => {
  const cwd = folder(t);
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}draw`);
  await opened.locator("#plane svg").waitFor();
  await opened.click("#p-draw summary");
  await opened.fill("#name", "mine");
  const task = () => fs.readFileSync(path.join(cwd, "mine.toml"), "utf8");
  const toasted = (words) => until(async () => words.test((await opened.locator(".toast").allTextContents()).join()), String(words));
  await opened.click("#save-sheet summary");
  await opened.click("#save");
  await toasted(/mine\.toml is written/);
  const first = task();
  await opened.fill("[aria-label='Target 1, y']", "7");
  await opened.press("[aria-label='Target 1, y']", "Tab");
  await opened.reload();
  await until(async () => (await opened.inputValue("#name")) === "mine", "the name is there again");
  await until(async () => (await opened.inputValue("[aria-label='Target 1, y']")) === "7", "the draft is there again");
  await opened.click("#save-sheet summary");
  await opened.click("#save");
  await until(() => task() !== first, "the same file has what changed");
  assert.match(task(), /\[3\.0, 7\.0\]/);
  // A file that this page did not write is left alone.
  fs.writeFileSync(path.join(cwd, "other.toml"), "max_steps = 5\n");
  await opened.click("#p-draw summary");
  await opened.fill("#name", "other");
  await opened.click("#save");
  await toasted(/another task has this name/);
  assert.equal(fs.readFileSync(path.join(cwd, "other.toml"), "utf8"), "max_steps = 5\n");
});

test("curves are looked at more closely, and a finger reads them", async (t) => {
  const cwd = folder(t);
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", "bean", "--steps", "60");
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}run?at=bean`, PHONE);
  await until(async () => (await opened.textContent("#frame")) === "000060.jpg", "the last photograph");
  const hours = async () => (await opened.getAttribute("#series svg", "aria-label")).match(/from hour ([\d.]+) to ([\d.]+)/).slice(1).map(Number);
  await until(() => opened.locator("#series svg").count(), "curves");
  assert.deepEqual(await hours(), [0, 5]);
  await opened.tap("[data-hours='1']");
  await until(async () => String(await hours()) === "4,5", "the last hour");
  await opened.locator("#time-line").scrollIntoViewIfNeeded();
  const { x, y, width } = await opened.locator("#series").boundingBox();
  await opened.touchscreen.tap(x + 44 + (width - 56) / 2, y + 60);
  await until(async () => /^4\.5 h/.test(await opened.textContent("#read")), "the value under the finger");
  assert.equal(await opened.textContent("#frame"), "000054.jpg");
  // The hour around what is looked at.
  await opened.locator("#scrub").focus();
  await opened.keyboard.press("Home");
  await until(async () => String(await hours()) === "0,1", "the first hour");
  await opened.tap("[data-hours='0']");
  await until(async () => String(await hours()) === "0,5", "all hours");
});

test("figures of a comparison have titles and the colours of the page", async (t) => {
  const cwd = folder(t);
  for (const seed of ["1", "2"]) await runOf(t, cwd, `bean-${seed}`, "--seed", seed);
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}compare?at=${encodeURIComponent("bean-1\nbean-2")}`, { colorScheme: "dark", viewport: { width: 1440, height: 900 } });
  const figures = opened.locator("#figures .sheet");
  await until(() => opened.locator("#figures svg.figure").count(), "the figures", 120);
  for (let place = 0; place < (await figures.count()); place++) assert.ok((await figures.nth(place).locator("h2").textContent()).trim());
  // Light letters on the dark sheet, and no white ground.
  const ink = await opened.locator("#figures svg.figure text").first().evaluate((text) => getComputedStyle(text).fill.match(/\d+/g).map(Number));
  assert.ok(!EMULATES || Math.min(...ink) > 120, String(ink));
  assert.equal(await opened.locator("#figures svg.figure > rect[fill='#fff']").count(), 0);
  // The paths of both over each other come first, the set-up last.
  assert.match(await figures.first().locator("h2").textContent(), /Paths of the tips: 1 bean-1, 2 bean-2/);
  assert.match(await figures.last().locator("h2").textContent(), /[Ss]et-?up/);
  // What compares stands first on the page.
  const first = await opened.evaluate(() => document.querySelector("#figures, #items").id);
  assert.equal(first, "figures");
});
