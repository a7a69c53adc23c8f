// Drawing in a real browser: targets, obstacles and forms of the stem, by mouse, finger and keyboard, and what is made for them.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after } from "node:test";
import { close, finger, folder, page, photographs, start, studio, test, until } from "./helpers.js";

const PHONE = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true };

after(close);

test("three targets are drawn, evolved for and tried", async (t) => {
  const cwd = folder(t);
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}draw`);
  const plane = opened.locator("#plane svg");
  await plane.waitFor();
  // The paper's three are there: they are taken out, and three others drawn.
  for (let left = 3; left > 0; left--) await opened.locator("#targets [data-remove]").first().click();
  assert.equal(await opened.locator("#targets .target-row").count(), 0);
  const box = await plane.boundingBox();
  const at = (x, y) => ({ x: ((340 + 34 * x) / 680) * box.width, y: ((600 - 34 * y) / 660) * box.height });
  for (const [x, y] of [
    [2, 6],
    [-3, 8.5],
    [1, 11],
  ])
    await plane.click({ position: at(x, y) });
  const rows = opened.locator("#targets .target-row");
  assert.equal(await rows.count(), 3);
  assert.deepEqual(await rows.locator("input").evaluateAll((fields) => fields.map((field) => field.value)), [
    "2",
    "6",
    "-3",
    "8.5",
    "1",
    "11",
  ]);
  await until(async () => (await rows.last().textContent()).includes("within reach"), "what is within reach");
  await rows.first().locator("input").first().fill("-9");
  await rows.first().locator("input").first().blur();
  assert.match(await rows.first().textContent(), /out of reach on the left/);
  await opened.click("#undo");
  assert.match(await rows.first().textContent(), /within reach/);

  await opened.click("#p-draw summary");
  await opened.fill("#name", "mine");
  await opened.fill("#runs", "3");
  await opened.fill("#generations", "150");
  await opened.click("#evolve");
  // A fast machine is done before the curve is looked at, and the page goes on by itself.
  const curve = opened.locator("#curve svg, #p-try:not([hidden])").first();
  await curve.waitFor({ state: "attached", timeout: 90_000 });
  const generation = async () => Number((await opened.textContent("#generation")).match(/generation (\d+)/)?.[1] ?? 0);
  const first = await generation();
  await until(async () => (await generation()) > first || (await opened.locator("#p-try").isVisible()), "the curve grows");
  await opened.locator("#p-try").waitFor({ timeout: 120_000 });
  assert.ok(fs.existsSync(path.join(cwd, "mine", "champion.json")));
  assert.match(fs.readFileSync(path.join(cwd, "mine.toml"), "utf8"), /targets = \[\[2.0, 6.0\], \[-3.0, 8.5\], \[1.0, 11.0\]\]/);

  // The champion plays by itself, then greedy, then oneself with two buttons.
  const hours = async () => Number((await opened.textContent("#hour b")).match(/^(\d+) h/)[1]);
  await opened.click("[data-speed='96']");
  await until(async () => (await hours()) >= 4, "the champion steers the bean");
  // Who steers changes while it plays.
  await opened.click("[data-who=greedy]");
  await until(async () => (await hours()) >= 4, "greedy steers the bean");
  // How far beside each target, not how many heights it passed.
  await until(async () => /^\d\.\d, /.test(await opened.textContent("#score tr:nth-child(2) td")), "a distance to the first target");
  await opened.click("[data-who=you]");
  await opened.click("#right");
  await until(async () => (await hours()) >= 8, "a person steers the bean");
  assert.equal(await opened.locator("#right").getAttribute("aria-pressed"), "true");
  const tip = async () => Number((await opened.textContent("#hour")).match(/tip ([−\d.]+)/)?.[1].replace("−", "-"));
  await until(async () => (await tip()) > 0.5, "the bean bends to the lamp that the person lights");
  await opened.keyboard.press("ArrowLeft");
  assert.equal(await opened.locator("#left").getAttribute("aria-pressed"), "true");
});

test("a target behind obstacles is drawn, a rule tuned for it and tried", async (t) => {
  const cwd = folder(t);
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}draw`, PHONE);
  const plane = opened.locator("#plane svg");
  await plane.waitFor();
  const rows = (id) => opened.locator(`${id} .target-row`);
  for (let left = 3; left > 0; left--) await rows("#targets").first().locator("[data-remove]").click();
  // Where the plane is now: the page scrolls.
  const at = async (x, y) => {
    await opened.locator("#plane").scrollIntoViewIfNeeded();
    const box = await plane.boundingBox();
    return [box.x + ((340 + 34 * x) / 680) * box.width, box.y + ((600 - 34 * y) / 660) * box.height];
  };
  const place = async (tool, x, y) => {
    await opened.click(`[data-tool=${tool}]`);
    await opened.touchscreen.tap(...(await at(x, y)));
  };
  await place("target", 0, 13);
  await place("way", -3, 10);
  // By finger with a tap, and by mouse with a drag that gives it its size.
  await place("disc", 0, 8);
  await opened.click("[data-tool=line]");
  await opened.mouse.move(...(await at(4, 7)));
  await opened.mouse.down();
  await opened.mouse.move(...(await at(6, 7.5)), { steps: 4 });
  await opened.mouse.move(...(await at(8, 8)), { steps: 4 });
  await opened.mouse.up();
  const values = () => opened.locator("#others input").evaluateAll((fields) => fields.map((field) => Number(field.value)));
  assert.deepEqual(await values(), [-3, 10, 0, 8, 1, 4, 7, 8, 8]);
  // By keyboard: the rim of the disc, and a box onto the seedling and away from it.
  await opened.locator("#plane [aria-label^='Disc 1, its rim']").focus();
  await opened.keyboard.press("ArrowRight");
  assert.match(await opened.textContent("#live"), /radius 1.5 cm/);
  await opened.click("[data-tool=box]");
  await opened.click("#add");
  const words = () => rows("#others").last().locator(".say").textContent();
  await opened.locator("#others input").last().fill("3");
  await opened.locator("[aria-label='Box 1, x']").fill("-1");
  await opened.locator("[aria-label='Box 1, x']").press("Tab");
  await until(async () => /touches the seedling/.test(await rows("#others").nth(3).locator(".say").textContent().catch(() => "")) || /touches/.test(await words()), "it says what touches");
  await opened.locator("#plane [aria-label^='Box 1 at']").focus();
  await opened.keyboard.press("Delete");
  assert.equal((await values()).length, 9);
  await opened.locator("[aria-label='Disc 1, radius']").fill("1");
  await opened.locator("[aria-label='Disc 1, radius']").press("Tab");
  // A target in an obstacle cannot be reached without touching it.
  await opened.locator("[aria-label='Target 1, y']").fill("8");
  await opened.locator("[aria-label='Target 1, y']").press("Tab");
  await until(async () => /in the disc/.test(await opened.textContent("#targets .say")), "it says what is out of reach");
  await opened.click("#undo");
  await until(async () => /within reach/.test(await opened.textContent("#targets .say")), "it is within reach again");

  await opened.click("#p-draw summary");
  await opened.fill("#name", "round");
  await opened.fill("#rule-generations", "3");
  await opened.click("#tune");
  await opened.locator("#curve svg").waitFor({ timeout: 120_000 });
  // The overview has it while it is searched for.
  const overview = await page(t, address);
  await until(async () => /round-rule\.json/.test(await overview.textContent("#rows")), "the rule is listed");
  await opened.locator("#p-try").waitFor({ timeout: 300_000 });
  const task = fs.readFileSync(path.join(cwd, "round.toml"), "utf8");
  assert.match(task, /kind = "obstacles"/);
  assert.match(task, /way_points = \[\[-3.0, 10.0\]\]/);
  const hours = async () => Number((await opened.textContent("#hour b")).match(/^(\d+) h/)[1]);
  await opened.click("[data-speed='96']");
  await until(async () => (await hours()) >= 4, "the rule steers the bean");
  assert.ok(await opened.locator("#touches").isVisible());
  await opened.locator(".obstacle").first().waitFor();
  await overview.reload();
  await until(async () => /round-rule\.json[\s\S]*of 2/.test(await overview.textContent("#rows")), "the rule has its fitness");
  // By way of its own page to a bean again.
  await overview.goto(`${address}work?at=round-rule.json`);
  await overview.click("#try");
  await overview.locator("#plane .obstacle").first().waitFor();
  assert.equal(await overview.locator("#plane .obstacle").count(), 2);
});

test("a form of the stem is drawn with a finger, a rule tuned for it and tried", async (t) => {
  const cwd = folder(t);
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}draw`, PHONE);
  await opened.locator("#plane svg").waitFor();
  await opened.click("[data-mode=form]");
  await opened.locator("#plane").scrollIntoViewIfNeeded();
  const box = await opened.locator("#plane svg").boundingBox();
  const at = ([x, y]) => ({ x: box.x + ((340 + 34 * x) / 680) * box.width, y: box.y + ((600 - 34 * y) / 660) * box.height });
  // A finger that draws a stem that leans to the right, from near the root to 12 cm.
  const touch = await finger(opened);
  const bow = (y) => [2.4 * Math.sin((Math.PI * y) / 24) ** 2, y];
  await touch("touchStart", [at(bow(1))]);
  for (let y = 1.25; y <= 12; y += 0.25) await touch("touchMove", [at(bow(y))]);
  await touch("touchEnd");
  const heights = () => opened.locator("#targets [aria-label$=', y']").evaluateAll((fields) => fields.map((field) => Number(field.value)));
  const drawn = await heights();
  assert.ok(drawn.length >= 7 && drawn[0] <= 1.5 && drawn.at(-1) >= 11, String(drawn));
  assert.ok(await opened.locator("#plane .wanted").isVisible());
  // By keys: a point to the side, farther than any stem gets; and back.
  await opened.locator("#plane [aria-label^='Point 1 at']").focus();
  for (let steps = 0; steps < 8; steps++) await opened.keyboard.press("ArrowRight");
  await until(async () => /out of reach: the stem stands nearly upright/.test(await opened.textContent("#targets .say")), "it says what is out of reach");
  for (let steps = 0; steps < 8; steps++) await opened.click("#undo");
  await until(async () => /within reach/.test(await opened.textContent("#targets .say")), "it is within reach again");
  // An apex, and a lean that no bean has.
  await opened.click("[data-tool=apex]");
  await opened.click("#add");
  assert.equal(await opened.locator("#others .target-row").count(), 1);
  await opened.locator("#others [data-remove]").click();
  await opened.fill("[data-number=lean_deg]", "89");
  await opened.press("[data-number=lean_deg]", "Tab");
  await until(async () => /No bean here leans by more/.test(await opened.textContent("#possible")), "it says what no bean does");
  await opened.fill("[data-number=lean_deg]", "");
  await opened.press("[data-number=lean_deg]", "Tab");
  // Targets are as they were.
  await opened.click("[data-mode=targets]");
  assert.equal(await opened.locator("#plane .cross").count(), 3);
  await opened.click("[data-mode=form]");
  assert.deepEqual(await heights(), drawn);

  await opened.click("#p-draw summary");
  await opened.fill("#name", "bow");
  await opened.fill("#rule-generations", "2");
  await opened.click("#tune");
  await opened.locator("#p-try").waitFor({ timeout: 300_000 });
  assert.match(fs.readFileSync(path.join(cwd, "bow.toml"), "utf8"), /kind = "shape"/);
  const off = async () => parseFloat(await opened.textContent("#score tr.now td"));
  await opened.click("[data-speed='96']");
  await until(() => opened.locator("#play", { hasText: "Again" }).count(), "the bean is grown", 120);
  const [rule, most] = [await off(), Number((await opened.textContent("#score tr.now .soft")).match(/[\d.]+/)[0])];
  assert.ok(rule < most / 2, `the rule brings the stem nearer to the form: ${rule} of ${most}`);
  await opened.click("[data-who=greedy]");
  await until(async () => Number.isFinite(await off()), "the greedy rule beside it");
  // The run of such a task says how far off the form the stem is, and what is expected.
  const words = ["run", "--rig", "greenhouse", "--controller", "bow-rule.json", "--out", "bean", "--speed", "60"];
  start(t, cwd, ...words);
  await until(() => photographs(cwd, "bean") > 3, "photographs");
  const own = await page(t, `${address}run?at=bean`);
  await until(async () => /Path and form/.test(await own.textContent("#path-title")), "the page knows the form");
  await until(async () => /come within 0.5 cm/.test(await own.textContent("#predicted")), "what is expected", 90);
  assert.match(await own.textContent("#targets"), /in \d.* to \d.* h/);
  assert.ok(await own.locator("#path .wanted").isVisible());
});

test("targets are drawn with the keyboard alone", async (t) => {
  const { address } = await studio(t, folder(t));
  const opened = await page(t, `${address}draw`);
  await opened.locator("#plane svg").waitFor();
  const focused = () =>
    opened.evaluate(() => document.activeElement.getAttribute("aria-label") ?? document.activeElement.textContent);
  const tabTo = async (pattern) => {
    for (let keys = 0; keys < 80; keys++) {
      await opened.keyboard.press("Tab");
      if (pattern.test((await focused()) ?? "")) return;
    }
    throw new Error(`no Tab leads to ${pattern}`);
  };
  await tabTo(/^Target 1 at 3.0, 6.0/);
  await opened.keyboard.press("ArrowRight");
  await opened.keyboard.press("ArrowUp");
  assert.match(await focused(), /^Target 1 at 3.5, 6.5/);
  await opened.keyboard.press("Delete");
  assert.equal(await opened.locator("#targets .target-row").count(), 2);
  await tabTo(/^Add a target$/);
  await opened.keyboard.press("Enter");
  assert.equal(await opened.locator("#targets .target-row").count(), 3);
});
