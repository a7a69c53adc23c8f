// Devices by hand, and notes: on the virtual tent by touch, and on an emulated WLED controller beside a run.
import assert from "node:assert/strict";
import fs from "node:fs";
import http from "node:http";
import path from "node:path";
import { after } from "node:test";
import { close, folder, listening, page, run, start, studio, test, until, wled, wledRig } from "./helpers.js";

after(close);

const PHONE = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true };
const text = (opened, selector) => opened.textContent(selector);
const lamp = (opened, name) => opened.locator("#lamps li", { hasText: new RegExp(`^\\s*${name}`) });

/** A rig of its lamps, and of a camera that shows one photograph of the virtual tent. */
async function rig(t, cwd, url) {
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "periodic", "--steps", "2", "--out", "tent");
  const calibration = fs.readFileSync(path.join(cwd, "tent/calibration.toml"), "utf8").replace("[base]", "[calibration.base]");
  const camera = `driver = "command"\ncommand = ["cat", ${JSON.stringify(path.join(cwd, "tent/photographs/000001.jpg"))}]`;
  wledRig(cwd, url, camera, `[calibration]\n${calibration}`);
}

test("lamps and camera of a virtual tent by touch", async (t) => {
  const cwd = folder(t);
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}devices`, PHONE);
  await lamp(opened, "Left").locator("button").tap();
  await until(async () => /lit, 0:\d+ left/.test(await text(opened, "#lamps")), "the lamp is lit");
  await opened.selectOption("#seconds", "2");
  await lamp(opened, "Right").locator("button").tap();
  await until(async () => /off/.test(await lamp(opened, "Left").textContent()), "one lamp at a time");
  await until(async () => !/lit/.test(await text(opened, "#lamps")), "it goes off by itself");
  await opened.tap("#take");
  await until(async () => /Tip at −?\d+\.\d, \d+\.\d cm/.test(await text(opened, "#seen")), "the tip");
  await until(() => opened.evaluate(() => document.querySelector("#img").naturalWidth === 648), "the photograph");
  const source = () => opened.getAttribute("#img", "src");
  const first = await source();
  await opened.tap("#live");
  await until(async () => (await source()) !== first, "a live view");
  assert.equal(await opened.locator("#over .ring").count(), 1);
  await opened.tap("#dark");
  assert.equal(await opened.getAttribute("#live", "aria-pressed"), "false");
});

test("lamps of a controller go on and off, and belong to a run while it goes on", async (t) => {
  const cwd = folder(t);
  const { url, lit } = await wled(t);
  await rig(t, cwd, url);
  // By the command line, too.
  assert.match(await run(t, cwd, "lamp", "rig.toml", "right", "--seconds", "0.2"), /right: lit for 0\.\d s, and off again/);
  assert.deepEqual(lit(), []);
  assert.match(await run(t, cwd, "photo", "rig.toml", "--light", "dark", "--out", "now.jpg"), /wrote now\.jpg: tip at/);

  const { child, address } = await studio(t, cwd);
  const opened = await page(t, `${address}devices?rig=rig.toml`);
  await lamp(opened, "Left").locator("button").click();
  await until(() => lit().length === 1, "the left lamp");
  assert.deepEqual(lit(), [0]);
  await opened.click("#take");
  await until(async () => /Tip at/.test(await text(opened, "#seen")), "a photograph beside a lamp that is lit");
  await lamp(opened, "Right").locator("button").click();
  await until(() => lit()[0] === 1, "the right lamp instead");
  // A studio that is killed leaves the light to its watchdog.
  child.kill("SIGKILL");
  await until(() => lit().length === 0, "the watchdog switches it off");

  const again = await studio(t, cwd);
  const going = start(t, cwd, "run", "--rig", "rig.toml", "--controller", "periodic", "--out", "bean");
  await until(() => lit().length === 1, "the run lights its lamp");
  const other = await page(t, `${again.address}devices?rig=rig.toml`);
  await other.click("#take");
  await until(async () => /The run bean has this rig/.test(await text(other, "#banner")), "it is refused");
  assert.equal(lit().length, 1);

  // A note reaches the journal of a run that waits for its next step.
  const about = await page(t, `${again.address}run?at=bean`);
  await about.fill("#note-text", "pot moved by 1 cm");
  await about.press("#note-text", "Enter");
  await until(async () => /pot moved by 1 cm/.test(await text(about, "#events")), "the note is among the events");
  going.kill("SIGTERM");
  await until(() => going.exitCode !== null, "the run has ended");
  assert.deepEqual(lit(), []);
  await run(t, cwd, "note", "bean", "watered", "--step", "0");
  await until(async () => /watered/.test(await text(about, "#events")), "a note on a run that is not at work");
});

test("a camera is calibrated by clicks, and the rig file takes it when one says so", async (t) => {
  const cwd = folder(t);
  const { url } = await wled(t);
  await rig(t, cwd, url);
  const before = fs.readFileSync(path.join(cwd, "rig.toml"), "utf8");
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}devices?rig=rig.toml`, PHONE);
  await opened.tap("#take");
  await until(async () => /Tip at/.test(await text(opened, "#seen")), "the photograph");
  await opened.tap("#calibrate summary");
  await opened.locator("#photo").scrollIntoViewIfNeeded();
  const box = await opened.locator("#clicks").boundingBox();
  const at = (x, y) => [box.x + (x / 648) * box.width, box.y + (y / 486) * box.height];
  for (const point of [[200, 300], [420, 300], [310, 440]]) await opened.touchscreen.tap(...at(...point));
  // By keys, to the pixel.
  await opened.locator("#clicks [aria-label^='Other end']").focus();
  await opened.keyboard.press("Shift+ArrowRight");
  const places = await opened.locator("#clicks g").evaluateAll((all) => all.map((one) => one.getAttribute("aria-label").match(/at ([\d.]+), ([\d.]+)/).slice(1).map(Number)));
  assert.ok(Math.abs(places[0][0] - 200) < 2 && Math.abs(places[1][0] - 430) < 2 && Math.abs(places[2][1] - 440) < 2, String(places));
  await opened.fill("#length", "20");
  await opened.tap("#reckon");
  await until(async () => /pixels a cm/.test(await text(opened, "#reckoned")), "the scale");
  const [[x1, y1], [x2, y2], base] = places;
  const scale = Math.hypot(x2 - x1, y2 - y1) / 20;
  assert.match(await text(opened, "#reckoned"), new RegExp(`${scale.toFixed(2)} pixels a cm.*one pixel off changes all lengths by\\s+0.4 %`, "s"));
  assert.match(await text(opened, "#reckoned"), /\[calibration\]\s+px_per_cm = /);
  assert.match(await text(opened, "#reckoned"), /tropism calibrate-camera photo.jpg --mark/);
  assert.equal(fs.readFileSync(path.join(cwd, "rig.toml"), "utf8"), before, "nothing is written before one says so");
  await opened.tap("#write");
  await opened.tap("#sure [value=no]");
  await opened.tap("#write");
  await opened.tap("#sure [value=yes]");
  await until(() => fs.readFileSync(path.join(cwd, "rig.toml"), "utf8") !== before, "the rig file has it");
  const after = fs.readFileSync(path.join(cwd, "rig.toml"), "utf8");
  assert.ok(after.includes(`x = ${base[0]}`) && after.startsWith(before.split("[calibration]")[0]), after);
  // The next photograph is measured by it.
  await opened.tap("#take");
  await until(async () => /Tip at/.test(await text(opened, "#seen")), "another photograph");
});

test("a rig file is made from addresses by touch, and its lamps obey", async (t) => {
  const cwd = folder(t);
  const { url, lit } = await wled(t);
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "periodic", "--steps", "2", "--out", "tent");
  const photographs = [0, 1].map((step) => fs.readFileSync(path.join(cwd, `tent/photographs/00000${step}.jpg`)));
  let taken = 0;
  const camera = http.createServer((_, response) => response.setHeader("Content-Type", "image/jpeg").end(photographs[taken++ % 2]));
  const place = await listening(camera);
  t.after(() => camera.close());

  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}devices`, PHONE);
  await opened.tap("[href='begin?form=make-rig']");
  await opened.locator("#fields [name=camera_at]").waitFor();
  await opened.fill("#fields [name=camera_at]", `${place}/photo.jpg`);
  await until(async () => /lamps_at.*found none, wanted a URL/.test(await text(opened, "#problem")), "what is missing");
  await opened.fill("#fields [name=lamps_at]", url);
  await until(async () => /tropism make-rig --camera ip/.test(await text(opened, "#command")), "the command");
  await opened.tap("#go");
  await opened.waitForURL(/devices\?rig=rig\.toml/);
  assert.match(fs.readFileSync(path.join(cwd, "rig.toml"), "utf8"), /^\[camera\]\ndriver = "http"/m);
  await lamp(opened, "Right").locator("button").tap();
  await until(() => lit()[0] === 1, "the right lamp");
  await opened.tap("#take");
  await until(async () => /Not calibrated yet/.test(await text(opened, "#seen")), "the photograph");
  await opened.tap("#dark");
  await until(() => lit().length === 0, "all light is off");

  // What is there is not replaced.
  const again = await page(t, `${address}begin?form=make-rig`);
  await again.locator("#fields [name=camera_at]").waitFor();
  await again.fill("#fields [name=camera_at]", place);
  await again.fill("#fields [name=lamps_at]", url);
  await until(async () => /rig\.toml is there already/.test(await text(again, "#problem")), "another name is wanted");
});
