// Makes the picture of the README from a real session: a virtual bean that greedy steers, on the page of its run.
import path from "node:path";
import { close, folder, page, photographs, run, start, studio, until } from "./helpers.js";

const out = path.resolve(process.argv[2] ?? "../../docs/figures/studio.jpg");
const ends = [];
const t = { after: (end) => ends.push(end) };
try {
  const cwd = folder(t);
  await run(t, cwd, "grow", "--plants", "6", "--out", "virtual-bean");
  await run(t, cwd, "fit", "virtual-bean", "--out", "virtual-bean.json");
  const words = ["run", "--rig", "greenhouse", "--controller", "greedy", "--out", "bean-1", "--seed", "4"];
  // Fast to where two targets are passed, then slowly, so that there is a time to the next photograph.
  const fast = start(t, cwd, ...words);
  await until(() => photographs(cwd, "bean-1") > 230, "230 photographs", 300);
  fast.kill("SIGTERM");
  await until(() => fast.exitCode !== null, "its end");
  start(t, cwd, ...words, "--resume", "--speed", "20");
  const { address } = await studio(t, cwd);
  const opened = await page(t, `${address}run?at=bean-1`, { viewport: { width: 1180, height: 860 } });
  await until(async () => /Live/.test(await opened.textContent("#state")), "it lives");
  await until(async () => /\d:\d\d/.test(await opened.textContent("#next")), "the next photograph");
  await until(async () => /simulated/.test(await opened.textContent("#predicted")), "what is expected");
  await opened.waitForTimeout(1000);
  await opened.screenshot({ path: out, type: "jpeg", quality: 82 });
} finally {
  for (const end of ends.reverse()) await end();
  await close();
}
