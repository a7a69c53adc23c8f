// Measures the page: node measure.js [first] [many] [viewers] [soak]. Prints what docs/validation/studio-speed.md says, with the
// load of the machine.
//
// `first` and `viewers` need a folder of 20 evolutions of 2000 generations, one of them of 20 runs, and a run of 1000
// photographs that goes on. They make it by the program itself in FOLDER (kept if it is named, made anew otherwise).
import fs from "node:fs";
import http from "node:http";
import os from "node:os";
import path from "node:path";
import { close, folder, manyRuns, page, photographs, run, start, studio, until } from "./helpers.js";

const ends = [];
const t = { after: (end) => ends.push(end) };
const wait = (seconds) => new Promise((done) => setTimeout(done, 1000 * seconds));
const load = () => `load ${os.loadavg()[0].toFixed(1)} on ${os.cpus().length} cores`;
const ms = (value) => `${Math.round(value)} ms`;

/** Seconds of processor time of a process so far. */
function processor(pid) {
  const words = fs.readFileSync(`/proc/${pid}/stat`, "utf8").split(") ")[1].split(" ");
  return (Number(words[11]) + Number(words[12])) / 100;
}
/** Resident memory of a process, in MB. */
const memory = (pid) => Number(fs.readFileSync(`/proc/${pid}/status`, "utf8").match(/VmRSS:\s+(\d+)/)[1]) / 1024;

const RUN = ["run", "--rig", "greenhouse", "--controller", "greedy", "--seed", "4", "--task", "task.toml"];
const TASK = "targets = [[3.0, 6.0], [-5.0, 9.0], [-1.0, 13.5]]\nend_height_cm = inf\nmax_steps = 20000\n";
const ended = (child) => until(() => child.exitCode !== null || child.signalCode !== null, "the end of a run", 60);

/** A folder with all of it, and the run that goes on in it, `speed` times as fast as a plant. */
async function full(speed) {
  const cwd = process.env.FOLDER ? path.resolve(process.env.FOLDER) : folder(t);
  fs.mkdirSync(cwd, { recursive: true });
  fs.writeFileSync(path.join(cwd, "task.toml"), TASK);
  const has = (name) => fs.existsSync(path.join(cwd, name));
  if (!has("tracks")) await run(t, cwd, "grow", "--plants", "6", "--out", "tracks");
  if (!has("model.json")) await run(t, cwd, "fit", "tracks", "--out", "model.json");
  for (let number = 1; number <= 20; number++) {
    const name = `evolution-${String(number).padStart(2, "0")}`;
    const runs = number === 1 ? "20" : "1";
    const words = ["--model", "model.json", "--out", name, "--runs", runs, "--generations", "2000", "--seed", String(number)];
    if (!has(`${name}/summary.json`)) await run(t, cwd, "evolve", ...words, ...(has(name) ? ["--resume"] : []));
  }
  if (photographs(cwd, "bean") < 1000) {
    const fast = start(t, cwd, ...RUN, "--out", "bean");
    await until(() => photographs(cwd, "bean") >= 1000, "1000 photographs", 600);
    fast.kill("SIGTERM");
    await ended(fast);
  }
  const live = start(t, cwd, "run", "--out", "bean", "--resume", "--speed", String(speed));
  const then = photographs(cwd, "bean");
  await until(() => photographs(cwd, "bean") > then, "the run goes on");
  return { cwd, live };
}

/** In the page: when content was there first, gaps between frames, and long tasks, all in ms. */
function watch(is) {
  const seen = { there: 0, gaps: [], long: [] };
  globalThis.seen = seen;
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) seen.long.push([entry.startTime, entry.duration]);
  }).observe({ type: "longtask", buffered: true });
  let last = performance.now();
  const frame = () => {
    const now = performance.now();
    if (seen.there) seen.gaps.push([now, now - last]);
    else if (is()) seen.there = now;
    last = now;
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

const PAGES = {
  "": "document.querySelectorAll('#rows tr').length >= 21",
  "run?at=bean": `(() => {
    const image = document.querySelector("#img");
    return image?.naturalWidth > 0 && document.querySelector("#path svg") && document.querySelector("#series svg");
  })()`,
  "evolution?at=evolution-01": "document.querySelectorAll('#curve .stroke').length >= 20",
};
const SIZES = {
  desk: { viewport: { width: 1280, height: 900 } },
  phone: { viewport: { width: 360, height: 780 }, hasTouch: true, isMobile: true },
};

async function first() {
  const { cwd, live } = await full(150);
  // A browser that is warm; the studio and the page are new for each sight.
  const opened = await page(t, "about:blank");
  console.log(`first sight, and frames for 20 s while a photograph comes every 2 s (${photographs(cwd, "bean")} of them):`);
  for (const [size, device] of Object.entries(SIZES)) {
    for (const [name, ready] of Object.entries(PAGES)) {
      const sights = [];
      let told = "";
      for (let time = 0; time < 5; time++) {
        const { child, address } = await studio(t, cwd);
        const context = await opened.context().browser().newContext(device);
        const own = await context.newPage();
        await own.addInitScript(`(${watch})(() => ${ready})`);
        await own.goto(address + name);
        sights.push(await until(() => own.evaluate(() => globalThis.seen.there), "content", 30));
        if (time === 4) {
          await wait(20);
          const { there, gaps, long, paint } = await own.evaluate(() => ({
            ...globalThis.seen,
            paint: performance.getEntriesByName("first-contentful-paint")[0]?.startTime,
          }));
          // What loads belongs to the first second; after it, nothing but updates.
          const after = gaps.filter(([at]) => at > there + 1000).map(([, gap]) => gap);
          const tasks = long.filter(([at]) => at > there + 1000).map(([, lasted]) => lasted);
          const heap = await own.evaluate(() => performance.memory.usedJSHeapSize / 1e6);
          told = `first paint ${ms(paint)}, longest frame ${ms(Math.max(...after))}, tasks over 50 ms: ${tasks.map(ms).join(", ") || "none"}, heap ${heap.toFixed(0)} MB`;
        }
        await context.close();
        child.kill("SIGKILL");
      }
      sights.sort((one, other) => one - other);
      console.log(`  ${size}, /${name}: content after ${ms(sights[2])} (${ms(sights[0])} to ${ms(sights[4])}), ${told}; ${load()}`);
    }
  }
  live.kill("SIGTERM");
  await ended(live);
}

async function many() {
  const cwd = folder(t);
  await manyRuns(t, cwd, 250);
  const opened = await page(t, "about:blank");
  const sights = [];
  for (let time = 0; time < 5; time++) {
    const { child, address } = await studio(t, cwd);
    const context = await opened.context().browser().newContext(SIZES.phone);
    const own = await context.newPage();
    await own.addInitScript(`(${watch})(() => document.querySelectorAll("#rows .open").length >= 50)`);
    await own.goto(address);
    sights.push(await until(() => own.evaluate(() => globalThis.seen.there), "content", 120));
    await context.close();
    child.kill("SIGKILL");
  }
  sights.sort((one, other) => one - other);
  console.log(`overview of 250 runs by a studio that has just begun, on a phone: content after ${ms(sights[2])} (${ms(sights[0])} to ${ms(sights[4])}); ${load()}`);
}

/** A viewer as the page is one: it listens, and asks for each photograph, its stem, and every minute what is expected. */
function viewer(address, at) {
  const agent = new http.Agent({ keepAlive: true, maxSockets: 4 });
  let bytes = 0;
  let events = 0;
  let shown = -1;
  const fetched = (name, values) =>
    new Promise((done) => {
      const asked = http.get(`${address}api/run/${name}?${new URLSearchParams({ at, ...values })}`, { agent }, (answer) => {
        answer.on("data", (data) => (bytes += data.length));
        answer.on("end", done);
      });
      asked.on("error", done);
    });
  let text = "";
  const listening = http.get(`${address}api/run/events?${new URLSearchParams({ at })}`, (answer) => {
    answer.setEncoding("utf8");
    answer.on("data", (data) => {
      bytes += data.length;
      text += data;
      for (let end = text.indexOf("\n\n"); end >= 0; end = text.indexOf("\n\n")) {
        const line = text.slice(0, end).split("\n").find((one) => one.startsWith("data: {"));
        text = text.slice(end + 2);
        if (!line) continue;
        events++;
        const last = JSON.parse(line.slice(6)).rows.at(-1);
        if (!last?.[11] || last[0] === shown) continue;
        shown = last[0];
        fetched("photo", { name: last[11] }).then(() => fetched("stem", { step: last[0] }));
      }
    });
  });
  listening.on("error", () => {});
  fetched("", {});
  const minute = setInterval(() => fetched("prediction", {}), 60_000);
  return {
    told: () => [events, bytes],
    end: () => {
      clearInterval(minute);
      listening.destroy();
      agent.destroy();
    },
  };
}

async function viewers() {
  console.log("50 viewers of a live run of 1000 photographs, as the page is one, for 60 s:");
  for (const [speed, says] of [
    [1, "at a plant's own pace, a photograph every 5 min"],
    [150, "150 times as fast, a photograph every 2 s"],
  ]) {
    const { cwd, live } = await full(speed);
    const { child, address } = await studio(t, cwd);
    const share = async (seconds) => {
      const [server, bean] = [processor(child.pid), processor(live.pid)];
      await wait(seconds);
      const of = (pid, before) => `${((100 * (processor(pid) - before)) / seconds).toFixed(1)} %`;
      return [of(child.pid, server), of(live.pid, bean)];
    };
    const [, alone] = await share(20);
    const all = Array.from({ length: 50 }, () => viewer(address, "bean"));
    // They have all of the run then.
    await wait(15);
    const [server, bean] = await share(60);
    const [events, bytes] = all.map((one) => one.told()).reduce(([a, b], [c, d]) => [a + c, b + d]);
    console.log(
      `  ${says}: the studio takes ${server} of a core, the run ${bean} (alone ${alone}); ${events} events, ${Math.round(bytes / 1e6)} MB; ${load()}`,
    );
    for (const one of all) one.end();
    child.kill("SIGKILL");
    live.kill("SIGTERM");
    await ended(live);
  }
}

async function soak() {
  // A day of a plant in six minutes; a browser looks on, and twenty viewers come and go all the time.
  const speed = Number(process.env.SPEED ?? 240);
  const hours = Number(process.env.HOURS ?? 24);
  const cwd = folder(t);
  fs.writeFileSync(path.join(cwd, "task.toml"), TASK);
  const live = start(t, cwd, ...RUN, "--out", "bean", "--speed", String(speed));
  const { child, address } = await studio(t, cwd);
  await until(() => photographs(cwd, "bean") > 1, "photographs");
  const run = await page(t, `${address}run?at=bean`, SIZES.desk);
  const overview = await run.context().newPage();
  await overview.goto(address);
  const heaps = async (opened) => {
    const inspected = await opened.context().newCDPSession(opened);
    await inspected.send("HeapProfiler.collectGarbage");
    const { usedSize } = await inspected.send("Runtime.getHeapUsage");
    await inspected.detach();
    return usedSize / 1e6;
  };
  let going = true;
  let came = 0;
  const churn = (async () => {
    while (going) {
      const few = Array.from({ length: 20 }, () => viewer(address, "bean"));
      came += few.length;
      await wait(2);
      for (const one of few) one.end();
    }
  })();
  console.log(`${hours} h of a plant, ${speed} times as fast; 20 viewers come and go every 2 s, and two pages stay open:`);
  for (let hour = 0; hour <= hours; hour += hours / 12) {
    await until(() => photographs(cwd, "bean") >= 12 * hour, `hour ${hour}`, 3600);
    const [first, second] = [await heaps(run), await heaps(overview)];
    console.log(
      `  hour ${hour.toFixed(0)}: studio ${memory(child.pid).toFixed(1)} MB, page of the run ${first.toFixed(1)} MB, overview ${second.toFixed(1)} MB; ${came} viewers so far; ${load()}`,
    );
  }
  going = false;
  await churn;
  live.kill("SIGTERM");
  await ended(live);
}

const asked = process.argv.slice(2);
try {
  for (const [name, measure] of Object.entries({ first, many, viewers, soak })) {
    if (!asked.length || asked.includes(name)) await measure();
  }
} finally {
  for (const end of ends.reverse()) await end();
  await close();
}
