// The overview of much work: folders, pages and tags.
import assert from "node:assert/strict";
import { after } from "node:test";
import { close, folder, manyRuns, page, run, studio, test, until } from "./helpers.js";

after(close);

test("an empty folder leads to the rig of somebody who begins", async (t) => {
  const opened = await page(t, (await studio(t, folder(t))).address);
  await opened.click("#empty [href='begin?form=make-rig']");
  await opened.locator("#fields [name=camera]").waitFor();
});

test("250 runs in folders are looked through by keyboard, and found by folder, name and tag", async (t) => {
  const cwd = folder(t);
  await manyRuns(t, cwd, 250);
  const { address } = await studio(t, cwd);
  const opened = await page(t, address);
  const names = () => opened.locator("#rows .open").allTextContents();
  const count = () => opened.textContent("#count");
  await until(async () => (await count()) === "250 of 250", "all runs are known");
  assert.equal((await names()).length, 50);
  await opened.selectOption("#sort", "name");
  assert.equal((await names())[0], "lab-1/bean-1");
  // Pages, by keys alone.
  await opened.locator("#after").focus();
  await opened.keyboard.press("Enter");
  assert.equal(await opened.textContent("#which"), "51 to 100 of 250");
  await opened.keyboard.press("Enter");
  assert.equal((await names())[0], "lab-3/bean-1");
  await opened.keyboard.press("Shift+Tab");
  await opened.keyboard.press("Enter");
  assert.equal((await names())[0], "lab-2/bean-1");
  // What was chosen is there again when one comes back.
  await opened.locator("#rows .open").first().click();
  await opened.waitForURL(/run\?at=lab-2%2Fbean-1$/);
  await until(async () => (await opened.textContent("#name")) === "lab-2/bean-1", "the run");

  await opened.fill("#tag", "two words");
  await opened.click("#tagging button:has-text('Add')");
  assert.equal(await opened.locator("#tags .chip").count(), 0, "a tag is one word");
  for (const tag of ["white", "batch-2"]) {
    await opened.fill("#tag", tag);
    await opened.keyboard.press("Enter");
    await opened.locator("#tags .chip", { hasText: tag }).waitFor();
  }
  assert.match(await run(t, cwd, "status", "lab-2/bean-1"), /tags +batch-2, white/);
  await opened.goBack();
  await until(async () => (await names())[0] === "lab-2/bean-1", "the same page of the list");
  assert.equal(await opened.textContent("#which"), "51 to 100 of 250");
  await until(async () => /white/.test(await opened.textContent("#rows tr")), "its tags");
  await opened.selectOption("#folder", "lab-4");
  assert.equal(await count(), "50 of 250");
  assert.ok(!(await opened.locator("#pager").isVisible()));
  await opened.selectOption("#tag", "white");
  await opened.locator("#none").waitFor();
  await opened.selectOption("#folder", "");
  assert.deepEqual(await names(), ["lab-2/bean-1"]);
  // A tag leads to all that has it, and is taken off.
  await opened.locator("#rows .open").click();
  await opened.locator("#tags a", { hasText: "batch-2" }).click();
  await until(async () => (await count()) === "1 of 250", "all that has the tag");
  await opened.locator("#rows .open").click();
  await opened.click("[data-untag=white]");
  await opened.locator("[data-untag=white]").waitFor({ state: "detached" });
  assert.equal(await opened.locator("#tags .chip").count(), 1);
  assert.match(await run(t, cwd, "status", "lab-2/bean-1"), /tags +batch-2$/m);
});
