// What went wrong once, in each browser that is installed: many tabs, Escape, another plant's photograph, a studio that began
// anew, a network that falls silent, runs and photographs that are gone.
import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import fs from "node:fs";
import path from "node:path";
import { after } from "node:test";
import { BROWSERS, close, folder, network, photographs, run, start, studio, tab, test, until, visitor } from "./helpers.js";

after(close);

const PHONE = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true };
const live = (t, cwd, out) => start(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", out, "--speed", "300");
const short = (t, cwd, out, seed) =>
  run(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", out, "--steps", "4", "--seed", String(seed));
const chip = (opened) => opened.locator("#state .chip").first().textContent();
const isShown = (opened) => until(async () => /^\d+\.jpg$/.test(await opened.textContent("#frame")), "a photograph");
const becomes = (opened, pattern, seconds = 20) => until(async () => pattern.test(await chip(opened)), `${pattern}`, seconds);
async function askToStop(opened, answer = "yes") {
  await opened.click("#ask-button");
  await opened.click(`#ask button[value=${answer}]`);
}
const digest = (bytes) => createHash("sha256").update(bytes).digest("hex");
/** The digest of the photograph that a page shows, as its browser keeps it. */
const kept = (opened) =>
  opened.evaluate(async () => {
    const answer = await fetch(document.querySelector("#img").getAttribute("src"), { cache: "force-cache" });
    return [...new Uint8Array(await answer.arrayBuffer())];
  }).then((bytes) => digest(Buffer.from(bytes)));

for (const browser of BROWSERS) {
  test(`twelve tabs share a connection, and a stop reaches the plant (${browser})`, async (t) => {
    const cwd = folder(t);
    live(t, cwd, "bean");
    live(t, cwd, "other");
    const { address, state } = await network(t, (await studio(t, cwd)).address);
    const context = await visitor(t, {}, browser);
    const places = ["run?at=bean", "", "run?at=other", "draw"];
    const tabs = [];
    for (let number = 0; number < 12; number++) tabs.push(await tab(context, address + places[number % places.length]));
    for (const opened of [tabs[0], tabs[6], tabs[8]]) await isShown(opened);
    for (const opened of tabs) await until(async () => /Connected/.test(await opened.textContent("#link")), "each tab is connected");
    const [first] = tabs;
    await first.bringToFront();
    await askToStop(first);
    await becomes(first, /Stopped/);
    // Another tab of the same run knows, and the other run goes on.
    await becomes(tabs[4], /Stopped/);
    assert.match(await chip(tabs[2]), /Live/);
    assert.equal(state.asked.filter((line) => line.includes("events")).length, 0);
    // Tabs that close leave the others their connection.
    for (const opened of tabs.slice(3)) await opened.close();
    const frame = await tabs[2].textContent("#frame");
    await until(async () => (await tabs[2].textContent("#frame")) !== frame, "photographs still come");
  });

  test(`without a shared worker hidden tabs hold no stream, and a stop reaches the plant (${browser})`, async (t) => {
    const cwd = folder(t);
    live(t, cwd, "bean");
    const { address, state } = await network(t, (await studio(t, cwd)).address);
    const context = await visitor(t, {}, browser);
    // Opened in the background, as by the middle button of the mouse.
    await context.addInitScript(() => {
      delete window.SharedWorker;
      window.isBehind = location.hash === "#behind";
      Object.defineProperty(Document.prototype, "hidden", { get: () => window.isBehind });
      Object.defineProperty(Document.prototype, "visibilityState", { get: () => (window.isBehind ? "hidden" : "visible") });
    });
    const behind = [];
    for (let number = 0; number < 7; number++) behind.push(await tab(context, `${address}run?at=bean#behind`));
    const seen = await tab(context, `${address}run?at=bean`);
    await isShown(seen);
    const streams = () => state.asked.filter((line) => line.includes("/api/stream")).length;
    assert.equal(streams(), 1);
    await seen.bringToFront();
    await askToStop(seen);
    await becomes(seen, /Stopped/, 5);
    // One that comes to the front listens.
    await behind[0].evaluate(() => {
      window.isBehind = false;
      document.dispatchEvent(new Event("visibilitychange"));
    });
    await becomes(behind[0], /Stopped/);
    assert.equal(streams(), 2);
  });

  test(`Escape does nothing, whatever was answered before (${browser})`, async (t) => {
    const cwd = folder(t);
    await run(t, cwd, "grow", "--plants", "2", "--out", "tracks");
    await run(t, cwd, "fit", "tracks", "--out", "model.json");
    await run(t, cwd, "evolve", "--model", "model.json", "--out", "evolution", "--runs", "1", "--generations", "3");
    live(t, cwd, "bean");
    const { address } = await studio(t, cwd);
    const context = await visitor(t, {}, browser);
    const opened = await tab(context, `${address}run?at=bean`);
    await isShown(opened);
    await askToStop(opened);
    await becomes(opened, /Stopped/);
    await opened.click("#resume");
    await becomes(opened, /Live/);
    await opened.click("#ask-button");
    await opened.keyboard.press("Escape");
    assert.equal(await opened.locator("#ask").isVisible(), false);
    await askToStop(opened, "no");
    const then = photographs(cwd, "bean");
    await until(() => photographs(cwd, "bean") > then + 1, "the run goes on");
    assert.match(await chip(opened), /Live/);

    await opened.goto(`${address}evolution?at=evolution`);
    await becomes(opened, /Done/);
    // While it is extended there is no summary.
    const read = (name) => fs.readFileSync(path.join(cwd, "evolution", name), "utf8");
    const generations = () =>
      fs.existsSync(path.join(cwd, "evolution/summary.json")) ? Number(read("evolution.toml").match(/generations = (\d+)/)[1]) : 0;
    await opened.click("#extend");
    // What is typed replaces what is there, and Enter in the field is the button that extends. Not `fill`: in a number field of
    // Firefox it types behind what is there.
    await opened.keyboard.type("5");
    await opened.keyboard.press("Enter");
    await until(() => generations() === 5, "it is extended");
    await becomes(opened, /Done/);
    await opened.click("#extend");
    await opened.keyboard.press("Escape");
    await opened.waitForTimeout(1000);
    assert.equal(generations(), 5);
    assert.equal(fs.readFileSync(path.join(cwd, ".tropism-studio/queue.json"), "utf8").match(/"number"/g).length, 1);
  });

  test(`a new run of a name shows its own plant (${browser})`, async (t) => {
    const cwd = folder(t);
    const photo = () => digest(fs.readFileSync(path.join(cwd, "bean/photographs/000004.jpg")));
    await short(t, cwd, "bean", 1);
    const { address } = await studio(t, cwd);
    const context = await visitor(t, {}, browser);
    const opened = await tab(context, `${address}run?at=bean`);
    await isShown(opened);
    const before = photo();
    assert.equal(await kept(opened), before);
    fs.rmSync(path.join(cwd, "bean"), { recursive: true });
    await becomes(opened, /Not here any more/);
    await short(t, cwd, "bean", 2);
    assert.notEqual(photo(), before);
    const other = await tab(context, `${address}run?at=bean`);
    await isShown(other);
    await until(async () => (await kept(other).catch(() => "")) === photo(), "another page shows the new run");
    // The old tab begins anew by itself.
    await until(async () => (await kept(opened).catch(() => "")) === photo(), "the open page shows the new run");
  });

  test(`a photograph is not readable after the log-out, and the log-in leads back (${browser})`, async (t) => {
    const cwd = folder(t);
    await short(t, cwd, "bean", 1);
    const { child, address } = await studio(t, cwd, 0, "--ask-token");
    const [token] = child.said.match(/(?<=^token:\s+)\S+/m);
    const context = await visitor(t, {}, browser);
    const opened = await tab(context, `${address}run?at=bean`);
    await opened.fill("#token", token);
    await opened.press("#token", "Enter");
    await opened.waitForURL(/run\?at=bean$/);
    await isShown(opened);
    await until(() => opened.evaluate(() => document.querySelector("#img").naturalWidth), "the photograph is loaded");
    const source = await opened.evaluate(() => document.querySelector("#img").src);
    const again = await context.newPage();
    const status = async () => (await again.goto(source)).status();
    assert.ok([200, 304].includes(await status()));
    const asked = await opened.evaluate(async (source) => (await fetch(source, { cache: "no-cache" })).status, source);
    assert.ok([200, 304].includes(asked));
    await opened.click("#logout");
    await opened.waitForURL(/\/login(\?|$)/);
    assert.equal(await status(), 401);
    // Also the other way back.
    await opened.goBack();
    await opened.waitForURL(/login/);
  });

  test(`an open page changes things after the studio began anew (${browser})`, async (t) => {
    const cwd = folder(t);
    live(t, cwd, "bean");
    const { child, address } = await studio(t, cwd);
    const context = await visitor(t, PHONE, browser);
    const opened = await tab(context, `${address}run?at=bean`);
    await isShown(opened);
    child.kill("SIGKILL");
    await until(async () => /Trying again/.test(await opened.textContent("#link")), "the page knows");
    await studio(t, cwd, new URL(address).port);
    await until(async () => /Connected/.test(await opened.textContent("#link")), "it is back");
    await askToStop(opened);
    await becomes(opened, /Stopped/);
  });

  test(`a stop over a silent network is reported and tried again (${browser})`, async (t) => {
    const cwd = folder(t);
    live(t, cwd, "bean");
    const { address, state, cut } = await network(t, (await studio(t, cwd)).address);
    const context = await visitor(t, PHONE, browser);
    const opened = await tab(context, `${address}run?at=bean`);
    await isShown(opened);
    state.isSilent = true;
    await askToStop(opened);
    const notice = opened.locator(".notice");
    await until(async () => /The stop waits for the studio/.test((await notice.allTextContents()).join()), "the page says that it waits", 5);
    await until(async () => /has not reached the studio/.test((await notice.allTextContents()).join()), "and that it did not arrive", 20);
    assert.match(await chip(opened), /Live/);
    state.isSilent = false;
    cut();
    await becomes(opened, /Stopped/, 30);
    await until(async () => (await notice.count()) === 0, "nothing is left to tell");
  });

  test(`what is gone is said to be gone (${browser})`, async (t) => {
    const cwd = folder(t);
    await short(t, cwd, "bean", 1);
    const { address } = await studio(t, cwd);
    const context = await visitor(t, PHONE, browser);
    const file = path.join(cwd, "bean/photographs/000004.jpg");
    fs.renameSync(file, `${file}.away`);
    const opened = await tab(context, `${address}run?at=bean`);
    await until(async () => /photograph missing/.test(await opened.textContent("#health")), "the missing photograph is reported");
    assert.match(await opened.textContent("#no-photo"), /could not be loaded/);
    assert.ok(await opened.locator("#no-photo").isVisible());
    fs.renameSync(`${file}.away`, file);
    await until(async () => /all checks pass/.test(await opened.textContent("#health")), "it is asked for again");
    assert.equal(await opened.locator("#no-photo").isVisible(), false);
    fs.renameSync(path.join(cwd, "bean"), path.join(cwd, "renamed"));
    await becomes(opened, /Not here any more/);
    assert.match(await opened.textContent("#banner"), /deleted, renamed or moved/);
    await opened.reload();
    await until(async () => /There is no run here/.test(await opened.textContent("#banner")), "after a reload, too");
    assert.match(await opened.textContent("#link"), /Connected/);
    await opened.waitForTimeout(500);
    assert.doesNotMatch(await opened.textContent("#banner"), /cut off/);
  });
}
