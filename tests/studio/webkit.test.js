// What a person needs most, in WebKit: that of iPhones and of GNOME.
import assert from "node:assert/strict";
import { after } from "node:test";
import { close, folder, photographs, run, start, studio, test, until } from "./helpers.js";
import { lacking, webkit } from "./webkit.js";

after(close);

const ESCAPE = "\uE00C";

test("all pages open, and Stop reaches the plant from the seventh window", { skip: lacking }, async (t) => {
  const cwd = folder(t);
  for (const out of ["over", "other"]) await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--steps", "5", "--out", out);
  start(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", "bean", "--speed", "300");
  const { address } = await studio(t, cwd);
  const opened = await webkit(t, 8741);
  const text = (selector) => opened.run(`return document.querySelector(${JSON.stringify(selector)})?.textContent ?? ""`);

  for (const [page, selector, wanted] of [
    ["", "#rows", /over/],
    ["run?at=over", "#events", /./],
    ["draw", "#targets", /./],
    ["begin", "#fields", /Controller/],
    ["devices", "#lamps", /Left/],
    ["compare?at=over%0Aother", "#figures", /./],
  ]) {
    await opened.goto(address + page);
    await until(async () => wanted.test(await text(selector)), page);
    assert.equal((await text(".banner.bad")).trim(), "", page);
  }

  // A target is placed where one clicks.
  await opened.goto(`${address}draw`);
  const targets = () => opened.run("return document.querySelectorAll('#targets .target-row').length");
  await until(async () => (await targets()) === 3, "the paper's targets");
  await opened.click("#targets [data-remove]");
  await until(async () => (await targets()) === 2, "one target less");

  for (let windows = 1; windows < 7; windows++) {
    await opened.goto(`${address}run?at=bean`);
    await until(async () => /^\d+\.jpg$/.test(await text("#frame")), `a photograph in window ${windows}`);
    await opened.window();
  }
  await opened.goto(`${address}run?at=bean`);
  await until(async () => /^\d+\.jpg$/.test(await text("#frame")), "a photograph in the seventh window");
  const isAsked = () => opened.run("return document.querySelector('#ask').open");
  // The driver clicks a place: while a photograph loads, the button may move away from it.
  const ask = () => until(async () => (await isAsked()) || (await opened.click("#ask-button")), "it asks");
  await ask();
  await opened.press(ESCAPE);
  await until(async () => !(await isAsked()), "Escape closes what asks");
  const before = photographs(cwd, "bean");
  await until(() => photographs(cwd, "bean") > before + 1, "and the plant goes on");
  await ask();
  await opened.click("#ask button[value=yes]");
  await until(async () => /Stopped/.test(await text("#state .chip")), "it is stopped", 20);
  const left = photographs(cwd, "bean");
  await new Promise((done) => setTimeout(done, 1500));
  assert.equal(photographs(cwd, "bean"), left);
});
