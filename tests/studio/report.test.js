// A report of a plant in space: the page turns it by itself, with mouse, finger and keys, and asks no network.
import assert from "node:assert/strict";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { pathToFileURL } from "node:url";
import { after } from "node:test";
import { EMULATES, close, finger, folder, page, run, test } from "./helpers.js";

const AXE = fs.readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

after(close);

/** A track that winds up, with its depth. */
function track() {
  const row = (step) => {
    const angle = step / 8;
    const places = [3 * Math.sin(angle), 4 + step / 10, 3 * Math.cos(angle)].map((value) => value.toFixed(5));
    return [step, 300 * step, places[0], places[1], step % 20 > 9 ? "left" : "right", "simulated", places[2]].join(",");
  };
  const head = "step,time_s,tip_x_cm,tip_y_cm,light,quality,tip_z_cm";
  return [head, ...Array.from({ length: 60 }, (_, step) => row(step))].join("\n") + "\n";
}

/** The address of a report of that track. */
async function report(t) {
  const cwd = folder(t);
  fs.writeFileSync(path.join(cwd, "track.csv"), track());
  await run(t, cwd, "report", "track.csv", "--out", "report.html");
  return pathToFileURL(path.join(cwd, "report.html")).href;
}

const said = (opened) => opened.locator(".turnable output").textContent();
/** Where the last tip is in the view, from its left and upper edge, in pixels. */
const tip = (opened) =>
  opened.evaluate(() => {
    const [svg, tip] = [".turnable > svg", ".turnable .fill.best"].map((name) => document.querySelector(name).getBoundingClientRect());
    return [tip.x + tip.width / 2 - svg.x, tip.y + tip.height / 2 - svg.y];
  });
const drawn = (opened) => opened.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

test("a plant in space is turned by mouse, keys and buttons", async (t) => {
  const opened = await page(t, await report(t));
  const asked = [];
  opened.on("request", (request) => asked.push(request.url()));
  const view = opened.locator(".turnable > svg");
  await view.waitFor();
  assert.match(await said(opened), /^30° to the right of the front camera, 20° above/);

  await opened.click("[data-view=front]");
  await drawn(opened);
  const front = await tip(opened);
  await opened.click("[data-view=side]");
  await drawn(opened);
  assert.match(await said(opened), /^90° to the right.* 0° above/);
  const side = await tip(opened);
  // From the front x is to the right, from the side the back is.
  const { width } = await view.boundingBox();
  const [x, z] = [3 * Math.sin(59 / 8), 3 * Math.cos(59 / 8)];
  const scale = (front[0] - width / 2) / x;
  assert.ok(scale > 5 && Math.abs(side[0] - width / 2 + scale * z) < 1.5, `${front} ${side}`);
  assert.ok(Math.abs(front[1] - side[1]) < 0.5);

  await opened.click("[data-view=reset]");
  await view.scrollIntoViewIfNeeded();
  const box = await view.boundingBox();
  const at = [box.x + box.width / 2, box.y + box.height / 2];
  await opened.mouse.move(at[0], at[1]);
  await opened.mouse.down();
  await opened.mouse.move(at[0] - 100, at[1] + 40, { steps: 4 });
  await opened.mouse.up();
  await opened.mouse.move(at[0], at[1]);
  await drawn(opened);
  assert.match(await said(opened), /^80° to the right.* 40° above/);

  const bar = () => opened.locator(".turnable text.label").textContent();
  const before = await bar();
  for (let i = 0; i < 9; i++) await view.press("+");
  for (const key of ["ArrowRight", "ArrowUp", "ArrowLeft", "ArrowLeft"]) await view.press(key);
  await drawn(opened);
  assert.match(await said(opened), /^75° to the right.* 45° above/);
  assert.ok(parseFloat(await bar()) < parseFloat(before), `${before} ${await bar()}`);
  await view.press("0");
  await drawn(opened);
  assert.equal(await bar(), before);

  // The wheel zooms the view that has the focus, and else scrolls the page.
  for (let i = 0; i < 5; i++) await opened.mouse.wheel(0, -400);
  await opened.waitForFunction((before) => document.querySelector(".turnable text.label").textContent !== before, before);
  assert.deepEqual(asked, []);
});

test("a finger turns the plant sideways", async (t) => {
  const opened = await page(t, await report(t), { viewport: { width: 390, height: 800 }, hasTouch: true, isMobile: true });
  const view = opened.locator(".turnable > svg");
  await view.scrollIntoViewIfNeeded();
  const box = await view.boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + 60];
  const touch = await finger(opened);
  const send = (type, x) => touch(type, x === null ? [] : [{ x, y }]);
  await send("touchStart", x);
  for (const step of [20, 40, 60, 80]) await send("touchMove", x + step);
  await send("touchEnd", null);
  await drawn(opened);
  assert.doesNotMatch(await said(opened), /^30°/);
  const wide = await opened.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(wide <= 0, `${wide} pixels wider than the screen`);
});

test("everybody can read and use it, on light and dark ground", async (t) => {
  const address = await report(t);
  for (const colorScheme of ["light", "dark"]) {
    const opened = await page(t, address, { colorScheme });
    await opened.locator(".turnable > svg").waitFor();
    await opened.evaluate(AXE);
    const { violations } = await opened.evaluate(() => globalThis.axe.run(".turnable"));
    assert.deepEqual(violations.map((violation) => `${violation.id}: ${violation.nodes[0].html}`), []);
  }
});

test("without scripts and on paper the drawing is left", { skip: EMULATES ? false : "scripts are not switched off" }, async (t) => {
  const address = await report(t);
  const plain = await page(t, address, { javaScriptEnabled: false });
  assert.ok(await plain.locator("#figure-space .drawing svg").first().isVisible());
  assert.ok(!(await plain.locator(".turnable").isVisible()));
  const opened = await page(t, address);
  await opened.emulateMedia({ media: "print" });
  assert.ok(await opened.locator("#figure-space .drawing svg").first().isVisible());
  assert.ok(!(await opened.locator(".turnable").isVisible()));
});
