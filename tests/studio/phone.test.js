// A whole experiment from a phone alone, by touch, on a rig of an emulated WLED controller and camera.
import assert from "node:assert/strict";
import fs from "node:fs";
import http from "node:http";
import path from "node:path";
import { after } from "node:test";
import { close, finger, folder, journal, listening, page, photographs, run, studio, test, until, wled, wledRig } from "./helpers.js";

after(close);

const PHONE = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true, acceptDownloads: true };
const text = (opened, selector) => opened.textContent(selector);

/** Photographs of the virtual tent, and six of them as they look in the dark and by each lamp alone. */
async function pictures(t, cwd) {
  await run(t, cwd, "run", "--rig", "greenhouse", "--controller", "periodic", "--steps", "80", "--out", "tent");
  const names = fs.readdirSync(path.join(cwd, "tent/photographs"));
  const lit = names.map((name) => fs.readFileSync(path.join(cwd, "tent/photographs", name)));
  const painter = await page(t, "about:blank");
  const dimmed = (left, right) =>
    painter.evaluate(
      async ([photographs, left, right]) => {
        const made = [];
        for (const photograph of photographs) {
          const image = new Image();
          image.src = `data:image/jpeg;base64,${photograph}`;
          await image.decode();
          const canvas = new OffscreenCanvas(image.width, image.height);
          const on = canvas.getContext("2d");
          on.drawImage(image, 0, 0);
          const shade = on.createLinearGradient(0, 0, image.width, 0);
          for (const [at, light] of [[0, left], [1, right]]) shade.addColorStop(at, `rgb(0 0 0 / ${1 - light})`);
          on.fillStyle = shade;
          on.fillRect(0, 0, image.width, image.height);
          const bytes = new Uint8Array(await (await canvas.convertToBlob({ type: "image/jpeg", quality: 0.9 })).arrayBuffer());
          made.push(btoa(String.fromCharCode(...bytes)));
        }
        return made;
      },
      [lit.slice(0, 6).map((bytes) => bytes.toString("base64")), left, right],
    );
  const views = { flash: lit, left: await dimmed(0.7, 0.1), right: await dimmed(0.1, 0.7), dark: await dimmed(0.02, 0.02) };
  return Object.fromEntries(Object.entries(views).map(([kind, list]) => [kind, list.map((one) => (typeof one === "string" ? Buffer.from(one, "base64") : one))]));
}

/** A camera that sees which segment burns, and whether the file of the flash is there. */
async function camera(t, cwd, flash, lit) {
  const views = await pictures(t, cwd);
  const taken = { flash: 0, left: 0, right: 0, dark: 0 };
  const server = http.createServer((request, response) => {
    const kind = fs.existsSync(flash) ? "flash" : (["left", "right"][lit()[0]] ?? "dark");
    response.setHeader("Content-Type", "image/jpeg");
    response.end(views[kind][taken[kind]++ % views[kind].length]);
  });
  t.after(() => server.close());
  return `${await listening(server)}/photo.jpg`;
}

test("a whole experiment by touch, from the check of the rig to the film", async (t) => {
  const cwd = folder(t);
  const { url, lit } = await wled(t);
  const flash = path.join(cwd, "flash");
  const photo = await camera(t, cwd, flash, lit);
  const switched = `driver = "command"\non = ["touch", ${JSON.stringify(flash)}]\noff = ["rm", "-f", ${JSON.stringify(flash)}]`;
  wledRig(cwd, url, `driver = "http"\nurl = "${photo}"`, `[flash]\n${switched}\n`);
  const { address } = await studio(t, cwd);
  const opened = await page(t, address, PHONE);
  /** Leads to a page by the menu, as a thumb does. */
  const menu = async (name) => {
    await opened.locator("[aria-controls=nav]").tap();
    await opened.locator("#nav a", { hasText: name }).tap();
  };
  let checks = 0;
  /** Checks the rig: what is found. */
  const checked = async () => {
    await opened.tap("#check");
    await opened.waitForURL(/begin\?form=check/);
    await until(async () => /tropism check rig.toml/.test(await text(opened, "#command")), "the command of the check");
    await opened.tap("#go");
    const jobs = opened.locator("#queue li", { hasText: /(Done|Failed)[^]*tropism check/ });
    checks += 1;
    await until(async () => (await jobs.count()) === checks, "the check is over", 120);
    await jobs.first().locator("[data-do=log]").tap();
    await until(async () => / fail/.test(await text(opened, "#said")), "its findings");
    const said = await text(opened, "#said");
    await opened.locator("#log button").first().tap();
    return said;
  };

  // A rig that is new: all but the calibration is right.
  await menu("Devices");
  await until(() => opened.locator("#rig option", { hasText: "rig.toml" }).count(), "the rig");
  await opened.selectOption("#rig", "rig.toml");
  await until(async () => /Left/i.test(await text(opened, "#lamps")), "its lamps");
  const first = await checked();
  assert.match(first, /FAIL +settings +found no \[calibration\]/);
  assert.match(first, / 1 fail/, first);
  assert.match(first, /pass +lamps +left lamp/, first);

  // Calibrate: ends 20 cm apart at the height of the root, and the root.
  await menu("Devices");
  await opened.selectOption("#rig", "rig.toml");
  await until(async () => /Left/i.test(await text(opened, "#lamps")), "its lamps");
  await opened.tap("#take");
  await until(async () => /Not calibrated yet/.test(await text(opened, "#seen")), "the photograph");
  await opened.tap("#calibrate summary");
  await opened.locator("#photo").scrollIntoViewIfNeeded();
  const truth = fs.readFileSync(path.join(cwd, "tent/calibration.toml"), "utf8");
  const [scale, x, y] = ["px_per_cm", "x", "y"].map((key) => Number(truth.match(new RegExp(`^${key} = ([\\d.]+)`, "m"))[1]));
  const box = await opened.locator("#clicks").boundingBox();
  for (const [left, top] of [[x - 10 * scale, y], [x + 10 * scale, y], [x, y]]) {
    await opened.touchscreen.tap(box.x + (left / 648) * box.width, box.y + (top / 486) * box.height);
  }
  await opened.fill("#length", "20");
  await opened.tap("#reckon");
  await until(async () => /pixels a cm/.test(await text(opened, "#reckoned")), "the scale");
  await opened.tap("#write");
  await opened.tap("#sure [value=yes]");
  await until(() => /\[calibration\]/.test(fs.readFileSync(path.join(cwd, "rig.toml"), "utf8")), "the rig file has it");
  await opened.tap("#take");
  await until(async () => /Tip at −?\d+\.\d, \d+\.\d cm/.test(await text(opened, "#seen")), "the tip");
  const second = await checked();
  assert.match(second, / 0 fail/, second);
  assert.match(second, /(pass|warn) +plant +its tip is at/, second);

  // Draw a target, evolve for it.
  await menu("Draw");
  const plane = opened.locator("#plane svg");
  await plane.waitFor();
  for (let left = 3; left > 0; left--) await opened.locator("#targets [data-remove]").first().tap();
  await opened.locator("#plane").scrollIntoViewIfNeeded();
  const drawn = await plane.boundingBox();
  for (const [x, y] of [[1, 7], [-1, 10]]) await opened.touchscreen.tap(drawn.x + ((340 + 34 * x) / 680) * drawn.width, drawn.y + ((600 - 34 * y) / 660) * drawn.height);
  assert.equal(await opened.locator("#targets .target-row").count(), 2);
  await opened.tap("#p-draw summary");
  for (const [field, value] of [["name", "mine"], ["runs", "2"], ["generations", "20"]]) await opened.fill(`#${field}`, value);
  await opened.tap("#evolve");
  await opened.locator("#p-try:not([hidden])").waitFor({ timeout: 120_000 });

  // Run its champion on the rig.
  await menu("Overview");
  await opened.locator("#rows a", { hasText: "mine" }).first().tap();
  await opened.waitForURL(/evolution\?at=mine/);
  await opened.locator("#run-it:not([hidden])").tap();
  await opened.waitForURL(/begin\?form=run/);
  await opened.locator("#fields [name=rig]").waitFor();
  await opened.fill("#fields [name=rig]", "rig.toml");
  await opened.fill("#fields [name=out]", "bean");
  await until(async () => /tropism run .*mine\/champion\.json.*rig\.toml/.test(await text(opened, "#command")), "the command of the run");
  await opened.tap("#go");
  await opened.waitForURL(/run\?at=bean$/);

  // Follow it, write a note, stop it.
  // A network is for steps of its model, five minutes: the test sees the first.
  await until(async () => (await text(opened, "#frame")) === "000000.jpg", "the first photograph");
  await until(() => lit().length === 1, "the champion lights a lamp");
  assert.match(await text(opened, "#tip"), /\d\.\d/);
  await opened.fill("#note-text", "watered");
  await opened.locator("#note button").tap();
  await until(async () => /watered/.test(await text(opened, "#events")), "the note");
  await opened.locator("#dock .stop").scrollIntoViewIfNeeded();
  const stop = await opened.locator("#dock .stop").boundingBox();
  const touch = await finger(opened);
  await touch("touchStart", [{ x: stop.x + stop.width / 2, y: stop.y + stop.height / 2 }]);
  await opened.waitForTimeout(2500);
  await touch("touchEnd");
  await until(async () => /Stopped|Paused/.test(await text(opened, "#state")), "it has stopped");
  assert.deepEqual(lit(), []);
  assert.deepEqual([journal(cwd, "bean").decided.length, photographs(cwd, "bean")], [1, 1]);

  // Take the film home.
  await opened.locator("#keep a", { hasText: "Film" }).tap();
  await opened.waitForURL(/begin\?form=timelapse/);
  await until(async () => /tropism timelapse bean/.test(await text(opened, "#command")), "the command of the film");
  await opened.tap("#go");
  const save = opened.locator("#queue a", { hasText: "Save" });
  await save.waitFor();
  const [film] = await Promise.all([opened.waitForEvent("download"), save.tap()]);
  assert.equal(fs.readFileSync(await film.path()).subarray(0, 4).toString(), "GIF8");
});
