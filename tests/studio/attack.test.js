// A studio under attack beside a run of a real rig by the clock: the attacks are refused, and the run misses no step.
import assert from "node:assert/strict";
import fs from "node:fs";
import net from "node:net";
import path from "node:path";
import { after } from "node:test";
import { close, folder, journal, page, realRun, studio, test, until } from "./helpers.js";

const SECONDS = 1.2;
/** Steps that the attack lasts at least. */
const ATTACKED = 10;
const SILENT = 5_000;
const GIGABYTE = 1 << 30;

after(close);

test("a run beside a studio under attack misses no step", async (t) => {
  const cwd = folder(t);
  const bean = await realRun(t, cwd, SECONDS);
  const steps = () => (fs.existsSync(path.join(cwd, "bean/journal.jsonl")) ? journal(cwd, "bean").done.length : 0);
  await until(() => steps() > 1, "the run goes on");
  // A name that is a script, for whoever shows it.
  fs.cpSync(path.join(cwd, "tent"), path.join(cwd, "<img src=x onerror=document.title='hurt'>"), { recursive: true });
  const { child, address } = await studio(t, cwd, 0, "--ask-token");
  const { hostname, port, host } = new URL(address);
  const token = child.said.match(/^token:\s+(\S+)/m)[1];
  /** Sends bytes, and gives the status of the answer. */
  const ask = (head, body = "", own = host) =>
    new Promise((done) => {
      const socket = net.connect(Number(port), hostname);
      let text = "";
      socket.setEncoding("latin1");
      socket.on("data", (data) => (text += data));
      for (const event of ["close", "error"]) socket.on(event, () => done([Number(text.split(" ")[1] ?? 0), text]));
      const lines = [head, `Host: ${own}`, "Connection: close", `Content-Length: ${body.length}`];
      // Not ended: who ends his half is gone, to the studio.
      socket.write(`${lines.join("\r\n")}\r\n\r\n${body}`);
    });
  const [status, answer] = await ask("POST /api/login HTTP/1.1", JSON.stringify({ token }));
  assert.equal(status, 200, answer);
  const cookie = `Cookie: ${answer.match(/set-cookie: ([^;]+)/i)[1]}`;
  const [, session] = await ask(`GET /api/session HTTP/1.1\r\n${cookie}`);
  const csrf = `X-Tropism-Csrf: ${session.match(/"csrf":"([^"]+)"/)[1]}`;
  const stop = '{"at":"bean"}';
  const before = steps();

  const foreign = async () => {
    for (let time = 0; time < 50; time++)
      for (const own of ["evil.example", `127.0.0.1.evil.example:${port}`, ""])
        for (const head of ["GET /api/items HTTP/1.1", "POST /api/run/stop HTTP/1.1"]) {
          const [found] = await ask(`${head}\r\n${cookie}\r\n${csrf}`, head.startsWith("P") ? stop : "", own);
          assert.ok(found === 400 || found === 421, `${head} of ${own}: ${found}`);
        }
  };
  const crossSite = async () => {
    for (let time = 0; time < 50; time++)
      for (const more of ["", "\r\nX-Tropism-Csrf: guess", `\r\n${csrf}\r\nOrigin: https://evil.example`, `\r\n${csrf}\r\nSec-Fetch-Site: cross-site`])
        for (const change of ["run/stop", "run/safe-state", "run/resume", "draw/save"]) {
          const [found] = await ask(`POST /api/${change} HTTP/1.1\r\n${cookie}${more}`, stop);
          assert.equal(found, 403, `${change} with ${more}`);
        }
  };
  const paths = async () => {
    for (let time = 0; time < 50; time++)
      for (const at of ["../", "..%2f", "%2e%2e%2f", "bean/../../", "/", ".tropism-studio/"])
        for (const place of [`run/photo?at=${at}&name=access.json`, `run/photo?at=bean&name=${at}etc/passwd`, `work?at=${at}etc`]) {
          const [found, text] = await ask(`GET /api/${place} HTTP/1.1\r\n${cookie}`);
          assert.ok(found >= 400 && found < 500 && !text.includes("studio-access"), `${place}: ${text}`);
        }
  };
  const guesses = async () => {
    const found = [];
    for (let time = 0; time < 100; time++) found.push((await ask("POST /api/login HTTP/1.1", `{"token":"guess-${time}"}`))[0]);
    assert.ok(found.slice(0, 4).every((one) => one === 403) && found.slice(5).every((one) => one === 429), String(found));
  };
  const large = async () => {
    let sent = 0;
    await new Promise((done) => {
      const socket = net.connect(Number(port), hostname);
      const piece = Buffer.alloc(1 << 16, " ");
      const lines = ["POST /api/draw/save HTTP/1.1", `Host: ${host}`, cookie, csrf, `Content-Length: ${GIGABYTE}`];
      socket.write(`${lines.join("\r\n")}\r\n\r\n`);
      const more = () => {
        while (sent < GIGABYTE && !socket.destroyed) {
          sent += piece.length;
          if (!socket.write(piece)) return;
        }
      };
      socket.on("drain", more);
      socket.on("data", () => {});
      for (const event of ["close", "error"]) socket.on(event, done);
      more();
    });
    assert.ok(sent < GIGABYTE / 16, `${sent} bytes were taken`);
  };
  let opened = 0;
  const silent = async () => {
    /** @type {Set<net.Socket>} */
    const all = new Set();
    const one = () =>
      new Promise((done) => {
        const socket = net.connect(Number(port), hostname, () => {
          opened++;
          socket.write("GET / HTTP/1.1\r\nHost: 127");
          done();
        });
        all.add(socket);
        for (const event of ["close", "error"])
          socket.on(event, () => {
            all.delete(socket);
            done();
          });
      });
    // This process may not have all of them open at once; the studio lets the oldest go.
    for (let count = 0; count < SILENT; count += 50) {
      await Promise.all(Array.from({ length: 50 }, one));
      while (all.size > 800) {
        const [oldest] = all;
        oldest.destroy();
        all.delete(oldest);
      }
    }
    for (const socket of all) socket.destroy();
  };
  const guest = async () => {
    const shown = await page(t, `${address}login`);
    await shown.fill("#token", token);
    await shown.keyboard.press("Enter");
    await until(async () => /onerror/.test(await shown.locator("#rows").textContent().catch(() => "")), "the name is shown as text", 60);
    assert.doesNotMatch(await shown.title(), /hurt/);
  };
  // The guest first: wrong tokens close the door to this whole address.
  await guest();
  await Promise.all([guesses(), large()]);
  do await Promise.all([foreign(), crossSite(), paths(), large(), silent()]);
  while (steps() - before < ATTACKED);
  assert.ok(opened >= SILENT * 0.9, `${opened} connections`);
  assert.equal((await ask(`GET /api/items HTTP/1.1\r\n${cookie}`))[0], 200, "who is in stays in");

  const after = steps();
  await until(() => steps() > after + 2, "the run goes on afterwards");
  const { saw, decided, done, events } = journal(cwd, "bean");
  const wanted = Array.from({ length: done.length }, (_, number) => number);
  assert.ok(after - before >= ATTACKED, `${after - before} steps under attack`);
  assert.deepEqual(saw.slice(0, done.length), wanted);
  assert.deepEqual(decided.slice(0, done.length), wanted);
  assert.deepEqual(done, wanted);
  assert.deepEqual(events.filter((kind) => kind === "missed" || kind === "late" || kind === "stopped"), []);
  assert.equal(bean.exitCode, null);
  t.diagnostic(`${after - before} steps of ${SECONDS} s under attack, none missed; ${opened} silent connections`);
});
