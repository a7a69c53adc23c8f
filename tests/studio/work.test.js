// Work from a phone alone, by touch: begin a run, film it, cancel a job, rename and delete; and drawing with one hand.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after } from "node:test";
import { EMULATES, close, finger, folder, page, run, studio, test, until } from "./helpers.js";

after(close);

const PHONE = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true, acceptDownloads: true };
const text = (opened, selector) => opened.textContent(selector);
const isConnected = (opened) => until(async () => /Connected/.test(await text(opened, "#link")), "the page is connected");

test("a run is begun, filmed, renamed and deleted by touch", async (t) => {
  const cwd = folder(t);
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}begin`, PHONE);
  await isConnected(opened);
  await opened.locator("#fields [name=out]").waitFor();
  // What is missing is said when one has begun or tries to send, without a word to the studio, and the command is shown.
  const asked = [];
  opened.on("request", (request) => asked.push(request.url()));
  await opened.waitForTimeout(500);
  assert.equal(await text(opened, "#problem"), "");
  await opened.tap("#go");
  await until(async () => /Name of the run: fill it in/.test(await text(opened, "#problem")), "what is missing");
  assert.deepEqual(asked.filter((url) => url.includes("api/begin")), []);
  await opened.fill("#fields [name=out]", "bean");
  await opened.fill("#fields [name=steps]", "12");
  await until(async () => /tropism run --controller greedy --rig greenhouse --out bean --steps 12/.test(await text(opened, "#command")), "the command");
  await opened.tap("#go");
  await opened.waitForURL(/run\?at=bean$/);
  await until(async () => /Done/.test(await text(opened, "#state")), "the run is over");

  await opened.locator("#keep a", { hasText: "Film" }).tap();
  await opened.waitForURL(/begin\?form=timelapse/);
  await until(async () => /tropism timelapse bean --out bean.gif/.test(await text(opened, "#command")), "the command of the film");
  await opened.tap("#go");
  const save = opened.locator("#queue a", { hasText: "Save" });
  await save.waitFor();
  const [download] = await Promise.all([opened.waitForEvent("download"), save.tap()]);
  assert.equal(fs.readFileSync(await download.path()).subarray(0, 4).toString(), "GIF8");

  // A job that takes long is cancelled, and says so.
  await opened.selectOption("#what", "study");
  await opened.fill("#fields [name=out]", "long");
  await opened.tap("#go");
  await until(() => fs.existsSync(path.join(cwd, "long/study.toml")), "the study is at work");
  await opened.locator("#queue [data-do=cancel]").tap();
  await until(async () => /Stopped/.test(await text(opened, "#queue")), "it is cancelled", 30);
  await opened.locator("#queue [data-do=log]").first().tap();
  await opened.locator("#said").waitFor();

  await opened.goto(`${address}run?at=bean`);
  await opened.tap("#keep summary");
  await opened.fill("#new-name", "sprout");
  await opened.locator("#rename button", { hasText: "Rename" }).tap();
  await opened.waitForURL(/run\?at=sprout$/);
  await until(async () => (await text(opened, "#name")) === "sprout", "its new name");
  const [photographs] = await Promise.all([
    opened.waitForEvent("download"),
    opened.locator("#keep a", { hasText: "ZIP" }).tap(),
  ]);
  assert.equal(fs.readFileSync(await photographs.path()).subarray(0, 4).toString("latin1"), "PK\u0003\u0004");
  await opened.tap("#keep summary");
  await opened.tap("#delete");
  await opened.fill("#own-name", "sprout");
  await opened.tap("#sure [value=yes]");
  await opened.waitForURL(address);
  assert.ok(!fs.existsSync(path.join(cwd, "sprout")));
});

test("a model is fitted from the page", async (t) => {
  const cwd = folder(t);
  await run(t, cwd, "grow", "--plants", "2", "--steps", "60", "--out", "beans");
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}begin?form=fit`);
  await opened.locator("#fields [name=tracks]").waitFor();
  await opened.fill("#fields [name=tracks]", "beans");
  await opened.fill("#fields [name=out]", "model");
  await until(async () => /tropism fit beans --kind tip --out model.json/.test(await text(opened, "#command")), "the command");
  await opened.click("#go");
  await until(() => fs.existsSync(path.join(cwd, "model.json")), "the model", 30);
});

test("a tap places, a swipe scrolls, and a draft survives", { skip: EMULATES ? false : "a mouse does not swipe" }, async (t) => {
  const cwd = folder(t);
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}draw`, PHONE);
  await opened.locator("#plane svg").waitFor();
  await opened.locator("#plane").scrollIntoViewIfNeeded();
  const rows = () => opened.locator("#targets .target-row").count();
  const touch = await finger(opened);
  const box = await opened.locator("#plane").boundingBox();
  const [x, y] = [box.x + 0.75 * box.width, box.y + 0.5 * box.height];
  const scrolled = () => opened.evaluate(() => scrollY);
  const from = await scrolled();
  await touch("touchStart", [{ x, y }]);
  for (let step = 1; step <= 10; step++) {
    await touch("touchMove", [{ x, y: y - 15 * step }]);
    await opened.waitForTimeout(16);
  }
  await touch("touchEnd");
  await until(async () => (await scrolled()) > from + 50, "the page is scrolled");
  assert.equal(await rows(), 3);
  await opened.evaluate((to) => scrollTo(0, to), from);
  await opened.touchscreen.tap(x, y);
  assert.equal(await rows(), 4);
  await opened.tap("#undo");
  assert.equal(await rows(), 3);
  await opened.tap("#redo");
  assert.equal(await rows(), 4);
  await opened.reload();
  await until(async () => (await rows()) === 4, "what was drawn is there again");
});

test("one time for curves, path and photograph", async (t) => {
  const cwd = folder(t);
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", "bean", "--steps", "20");
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}run?at=bean`);
  await until(async () => (await text(opened, "#frame")) === "000020.jpg", "the last photograph");
  await opened.locator("#series svg").first().waitFor();
  await opened.locator("#time-line").scrollIntoViewIfNeeded();
  const { x, y, width } = await opened.locator("#series").boundingBox();
  // Half of twenty steps of five minutes.
  const half = x + 44 + (width - 56) / 2;
  await opened.mouse.move(half, y + 60);
  await until(async () => /^0\.8 h: x [−\d.]+, y \d/.test(await text(opened, "#read")), "the values under the pointer");
  await opened.locator("#on-path").waitFor();
  await opened.mouse.click(half, y + 60);
  await until(async () => (await text(opened, "#frame")) === "000010.jpg", "its photograph");
  await opened.mouse.move(0, 0);
  assert.match(await text(opened, "#read"), /^0\.8 h/);
  // The path answers, too.
  await opened.locator("#path").scrollIntoViewIfNeeded();
  const start = await opened.locator("#path .start").boundingBox();
  await opened.mouse.click(start.x + start.width / 2, start.y + start.height / 2);
  await until(async () => /^00000[0-3]\.jpg$/.test(await text(opened, "#frame")), "the photograph of the first tips");
  // The height of the next target is part of the curve of y.
  // What a run is for is asked for apart from its steps, and may come after them.
  await until(async () => (await opened.locator("#series svg").nth(1).locator(".dotted").count()) === 1, "the height of the target");
});
