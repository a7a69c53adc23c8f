// The studio in a real browser: what a person does with it.
import assert from "node:assert/strict";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { after } from "node:test";
import { EMULATES, close, folder, network, page, photographs, run, start, studio, test, until } from "./helpers.js";

const AXE = fs.readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const PHONE = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true };
const DESK = { viewport: { width: 1440, height: 900 } };

after(close);

const live = (t, cwd, out, speed = "300") =>
  start(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", out, "--speed", speed);
const chipOf = (opened) => opened.locator("#state .chip").first();
/** Presses for `ms`, by mouse. */
async function press(opened, button, ms) {
  await button.scrollIntoViewIfNeeded();
  const box = await button.boundingBox();
  await opened.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await opened.mouse.down();
  await opened.waitForTimeout(ms);
  await opened.mouse.up();
}

test("a run is watched, stopped by hold and resumed", async (t) => {
  const cwd = folder(t);
  live(t, cwd, "bean");
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}run?at=bean`, PHONE);
  const frame = () => opened.textContent("#frame");
  await until(async () => /^\d+\.jpg$/.test(await frame()), "a photograph");
  const first = await frame();
  await until(async () => (await frame()) !== first, "the next photograph");
  assert.match(await opened.textContent("#age"), /^taken \d+:\d\d ago$/);
  await until(async () => /left|right/i.test(await opened.textContent("#dock-lamp")), "the lamp");
  // The name stands before the picture is loaded.
  await until(() => opened.evaluate(() => document.querySelector("#img").naturalWidth === 648), "its picture, 648 pixels wide");

  const stop = opened.locator("#dock .stop");
  await press(opened, stop, 400);
  assert.match(await opened.textContent(".toast"), /Hold it/);
  assert.match(await chipOf(opened).textContent(), /Live/);
  await press(opened, stop, 1700);
  await until(async () => /Stopped/.test(await chipOf(opened).textContent()), "the run is stopped", 20);
  const left = photographs(cwd, "bean");
  await opened.waitForTimeout(2500);
  assert.equal(photographs(cwd, "bean"), left);
  await opened.click("#resume");
  await until(() => photographs(cwd, "bean") > left, "the run goes on");
  assert.equal(fs.readFileSync(path.join(cwd, "bean", "speed"), "utf8"), "300\n", "as fast as before");
  await until(async () => /Live/.test(await chipOf(opened).textContent()), "the page says so");

  // The film: back by a key, and to the latest.
  await opened.locator("#scrub").focus();
  await opened.keyboard.press("Home");
  assert.equal(await frame(), "000000.jpg");
  await opened.click("#latest");
  assert.notEqual(await frame(), "000000.jpg");
  // By keyboard alone: held Space stops, too.
  await stop.focus();
  await opened.keyboard.down("Space");
  await opened.waitForTimeout(1700);
  await opened.keyboard.up("Space");
  await until(async () => /Stopped/.test(await chipOf(opened).textContent()), "the keyboard stops it", 20);
});

test("a page asks once for its events and once for the last photograph", async (t) => {
  const cwd = folder(t);
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", "a bean", "--steps", "4");
  const { address, state } = await network(t, (await studio(t, cwd)).address);
  const opened = await page(t, `${address}run?at=a+bean`);
  await until(async () => (await opened.textContent("#frame")) === "000004.jpg", "the last photograph");
  await until(() => opened.evaluate(() => document.querySelector("#img").naturalWidth), "the photograph is there");
  const asked = state.asked.map((line) => line.replace("GET /", ""));
  const count = (part) => asked.filter((one) => one.startsWith(part)).length;
  assert.equal(count("api/stream"), 1, asked.join("\n"));
  assert.equal(asked.filter((one) => /^api\/run\/photo\?at=a\+bean&name=000004.jpg&v=\w{12}$/.test(one)).length, 1, asked.join("\n"));
  // What the server named in the page's header came before the scripts asked for anything.
  const first = asked.findIndex((one) => one.startsWith("api/run/photo"));
  assert.ok(first >= 0 && first < asked.findIndex((one) => one.startsWith("api/session")), asked.join("\n"));
});

test("a run offers only what can be done", async (t) => {
  const cwd = folder(t);
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", "over", "--steps", "4");
  live(t, cwd, "bean");
  const { address } = await studio(t, cwd);
  for (const device of [PHONE, DESK]) {
    for (const [at, word, shown] of /** @type {const} */ ([["over", /Done/, 0], ["bean", /Live/, 3]])) {
      const offered = (opened) => opened.locator(".stop:visible, .safe:visible, #ask-button:visible").count();
      // Before it is known what the run does.
      if (EMULATES) {
        const bare = await page(t, `${address}run?at=${at}`, { ...device, javaScriptEnabled: false });
        assert.equal(await offered(bare), 0);
      }
      const opened = await page(t, `${address}run?at=${at}`, device);
      await until(async () => word.test(await chipOf(opened).textContent()), "its state");
      assert.equal(await offered(opened), shown, at);
    }
  }
});

test("a killed run shows as such within five seconds", async (t) => {
  const cwd = folder(t);
  const bean = live(t, cwd, "bean");
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}run?at=bean`);
  await until(async () => /Live/.test(await chipOf(opened).textContent()), "it lives");
  await until(() => photographs(cwd, "bean") > 2, "photographs");
  bean.kill("SIGKILL");
  await until(async () => /Ended without a word/.test(await chipOf(opened).textContent()), "the page says that it died", 5);
  assert.match(await opened.textContent("#banner"), /process is gone/);
});

test("killing the studio touches no run, and the page catches up", async (t) => {
  const cwd = folder(t);
  live(t, cwd, "bean");
  const { child, address } = await studio(t, cwd);
  const port = new URL(address).port;
  const opened = await page(t, `${address}run?at=bean`);
  await until(async () => /^\d+\.jpg$/.test(await opened.textContent("#frame")), "a photograph");
  child.kill("SIGKILL");
  const then = photographs(cwd, "bean");
  await until(() => photographs(cwd, "bean") > then + 2, "the run goes on without the studio");
  await until(async () => /cut off/.test(await opened.textContent("#banner")), "the page says that it is cut off");
  await studio(t, cwd, port);
  await until(async () => /Connected/.test(await opened.textContent("#link")), "the page is back", 30);
  await until(async () => Number((await opened.textContent("#frame")).slice(0, 6)) > then, "it has what it missed", 30);
});

test("every page is accessible and fits, on phone and desk, light and dark", async (t) => {
  const cwd = folder(t);
  await run(t, cwd, "grow", "--plants", "2", "--out", "tracks");
  await run(t, cwd, "fit", "tracks", "--out", "model.json");
  await run(t, cwd, "evolve", "--model", "model.json", "--out", "evolution", "--runs", "3", "--generations", "20");
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "evolution/champion.json", "--out", "over", "--steps", "30");
  await run(t, cwd, "fit", "tracks", "--kind", "stem", "--out", "stem.json");
  await run(t, cwd, "tune", "--model", "stem.json", "--out", "rule.json", "--generations", "3", "--population", "4", "--episodes", "4");
  await run(t, cwd, "transfer", "--controllers", "greedy", "rule.json", "--plants", "6", "--out", "transfer");
  live(t, cwd, "bean", "60");
  const { address } = await studio(t, cwd);
  const drawing = encodeURIComponent('{"targets":[[3,6],[-5,9]]}');
  const behind = encodeURIComponent(
    '{"targets":[[0,13]],"way_points":[[-3,10]],"obstacles":[{"disc":[0,8],"radius_cm":1},{"box":[[3,6],[5,7]]},{"line":[[-8,6],[-5,6]]}]}',
  );
  const form = encodeURIComponent('{"form":{"line":[[0,0],[0.2,3],[2,6],[6,7]],"inflection":[1,6],"lean_deg":20}}');
  const pages = [
    "",
    "run?at=bean",
    "run?at=over",
    "run?at=nope",
    "evolution?at=evolution",
    "draw",
    `draw?drawing=${behind}`,
    `draw?drawing=${form}`,
    `draw?at=evolution&drawing=${drawing}`,
    "tune?at=over",
    "compare?at=evolution",
    "compare?at=transfer",
    "work?at=transfer",
    "work?at=rule.json",
    "wall",
    "begin",
    "devices",
    "login",
  ];
  for (const [size, device] of Object.entries({ phone: PHONE, desk: DESK })) {
    await t.test(size, async (t) => {
      const look = async (name) => {
        const opened = await page(t, address + name, { ...device, colorScheme: "light", bypassCSP: true });
        if (name !== "login")
          await until(async () => /Connected/.test(await opened.textContent("#link")), `${name} is connected`);
        await opened.waitForTimeout(1500);
        if (name === "evolution?at=evolution") await opened.locator("#network svg").waitFor();
        await opened.evaluate(AXE);
        for (const colorScheme of /** @type {const} */ (["light", "dark"])) {
          await opened.emulateMedia({ colorScheme });
          // In the dark only colours differ.
          const rules = colorScheme === "dark" ? { runOnly: ["color-contrast"] } : {};
          const { violations } = await opened.evaluate((rules) => globalThis.axe.run(rules), rules);
          const told = violations.map(
            ({ id, nodes }) =>
              `${id}: ${nodes
                .slice(0, 3)
                .map((node) => `${node.target} ${node.any[0]?.message ?? ""}`)
                .join("; ")}`,
          );
          assert.deepEqual(told, [], `${name}, ${colorScheme}`);
          if (process.env.SHOTS)
            await opened.screenshot({
              path: `${process.env.SHOTS}/${name.replace(/\W.*|^$/, (rest) => (rest ? `-${pages.indexOf(name)}` : "index"))}-${size}-${colorScheme}.png`,
              fullPage: true,
            });
        }
        const [wide, width] = await opened.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
        assert.ok(wide <= width, `${name} is ${wide} wide in ${width}`);
        await opened.context().close();
      };
      // Four pages at a time: they mostly wait for what they show.
      const left = [...pages];
      const next = async () => {
        for (let name = left.shift(); name !== undefined; name = left.shift()) await look(name);
      };
      await Promise.all([next(), next(), next(), next()]);
    });
  }
});

test("a run serves its own page, which cannot end it", async (t) => {
  const cwd = folder(t);
  const words = ["run", "--rig", "greenhouse", "--controller", "greedy", "--out", "bean", "--speed", "300"];
  const bean = start(t, cwd, ...words, "--studio", "127.0.0.1:0");
  const address = await until(() => bean.said.match(/http:\/\/\S+/)?.[0], "the page's address");
  const opened = await page(t, `${address}run`);
  await until(async () => /^\d+\.jpg$/.test(await opened.textContent("#frame")), "a photograph");
  await until(async () => (await opened.textContent("#name")) === "bean", "its name");
  const children = fs.readFileSync(`/proc/${bean.pid}/task/${bean.pid}/children`, "utf8").trim().split(" ");
  for (const child of children) process.kill(Number(child), "SIGKILL");
  const then = photographs(cwd, "bean");
  await until(() => photographs(cwd, "bean") > then + 2, "the run goes on without its page");
  assert.equal(bean.exitCode, null);
});

test("a job lives on when the studio is killed, and the next one takes it over", async (t) => {
  const cwd = folder(t);
  const first = await studio(t, cwd);
  const ask = async (address, body) => {
    const { session } = await (await fetch(`${address}api/session`)).json();
    const headers = { "Content-Type": "application/json", "X-Tropism-Csrf": session.csrf };
    const answer = await fetch(`${address}api/draw/evolve`, { method: "POST", headers, body: JSON.stringify(body) });
    assert.equal(answer.status, 200, await answer.text());
  };
  const targets = [
    [3, 6],
    [-5, 9],
    [-1, 13.5],
  ];
  await ask(first.address, { name: "long", drawing: { targets }, runs: 2, generations: 3000 });
  await ask(first.address, { name: "short", drawing: { targets }, runs: 1, generations: 3 });
  // The latest checkpoint of any run, in ms; 0 before the first.
  const saved = () => {
    const runs = fs.existsSync(path.join(cwd, "long")) ? fs.readdirSync(path.join(cwd, "long")) : [];
    const times = runs.filter((name) => /^run-\d+\.json$/.test(name)).map((name) => fs.statSync(path.join(cwd, "long", name)).mtimeMs);
    return Math.max(0, ...times);
  };
  await until(() => saved() > 0, "a checkpoint");
  first.child.kill("SIGKILL");
  const then = saved();
  await until(() => saved() > then, "the job goes on without the studio");
  assert.ok(!fs.existsSync(path.join(cwd, "short")), "one job at a time");
  const { address } = await studio(t, cwd);
  const states = async () => (await (await fetch(`${address}api/items`)).json()).queue.map((job) => `${job.at} ${job.state}`);
  assert.deepEqual(await states(), ["long running", "short waiting"]);
  await until(async () => String(await states()) === "long done,short done", "both are done", 240);
  assert.ok(fs.existsSync(path.join(cwd, "short", "champion.json")));
});

test("the demonstration shows everything within ten seconds", async (t) => {
  const child = start(t, folder(t), "studio", "--demo", "--listen", "127.0.0.1:0");
  const address = await until(() => child.said.match(/http:\/\/\S+/)?.[0], "the address", 10);
  const opened = await page(t, address);
  await opened.locator(".card img").first().waitFor();
  await until(
    async () => /three-targets/.test(await opened.textContent("#rows")) && /bean-1/.test(await opened.textContent("#rows")),
    "a run and an evolution",
  );
  const place = child.said.match(/serves (\S+)/)[1];
  child.kill("SIGTERM");
  await until(() => child.exitCode !== null && !fs.existsSync(place), "its folder is deleted", 20);
});
