// The longest task of the page's thread while it loads, from the file and from the folder: node tests/web/loads.js [loads], with the folder
// of the page in TROPISM_WEB. Says the load of the machine with it: what else runs there is part of how long a task takes.
import os from "node:os";
import path from "node:path";
import { pathToFileURL } from "node:url";
import { close, tab, visitor } from "../studio/helpers.js";
import { served } from "./folder.js";

const LOADS = Number(process.argv[2] ?? 20);
const ends = [];
const t = { after: (end) => ends.push(end), diagnostic: console.log };

/** In the page: its tasks of more than 50 ms, which are those that a browser tells of. */
function watch() {
  globalThis.long = [];
  new PerformanceObserver((list) => globalThis.long.push(...list.getEntries().map(({ duration }) => duration))).observe({ type: "longtask", buffered: true });
}

const { server, address } = await served();
for (const [name, place] of Object.entries({ file: pathToFileURL(path.join(process.env.TROPISM_WEB, "tropism.html")).href, folder: address })) {
  const longest = [];
  const beans = [];
  for (let load = 0; load < LOADS; load++) {
    const context = await visitor(t, { viewport: { width: 1280, height: 800 } });
    const opened = await tab(context, "about:blank");
    await opened.addInitScript(watch);
    // A window that has just been opened loads pages of the browser's own on the same cores.
    await new Promise((done) => setTimeout(done, 1500));
    await opened.goto(place);
    await opened.locator("#plane .bean").waitFor();
    beans.push(await opened.evaluate(() => performance.now()));
    await new Promise((done) => setTimeout(done, 1000));
    longest.push(Math.max(0, ...(await opened.evaluate(() => globalThis.long))));
    await context.close();
  }
  const told = longest.filter((ms) => ms > 0).map(Math.round).sort((one, other) => one - other);
  const bean = beans.sort((one, other) => one - other)[LOADS >> 1];
  console.log(`${name}: a task over 50 ms in ${told.length} of ${LOADS} loads (${told.join(", ") || "none"}); a bean after ${Math.round(bean)} ms; load ${os.loadavg()[0].toFixed(1)}`);
}
for (const end of ends) await end();
await close();
server.close();
