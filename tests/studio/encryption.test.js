// TLS: with one's own certificate, and behind a real nginx with a path prefix and an odd port.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import fs from "node:fs";
import http from "node:http";
import http2 from "node:http2";
import net from "node:net";
import path from "node:path";
import { after } from "node:test";
import { certificate, close, folder, page, photographs, start, studio, test, until } from "./helpers.js";

const NGINX = ["/usr/sbin/nginx", "/usr/bin/nginx"].find((file) => fs.existsSync(file));

after(close);

const tokenOf = (child) => child.said.match(/^token:\s+(\S+)/m)[1];
const ended = (child) => until(() => child.exitCode !== null, "its end", 20);
/** A port that is free now. */
const freePort = () =>
  new Promise((done) => {
    const server = net.createServer().listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => done(port));
    });
  });
/** Logs in on the page that asks for a token. */
async function logIn(opened, token) {
  await opened.locator("#token").waitFor();
  await opened.fill("#token", token);
  await opened.keyboard.press("Enter");
  await until(async () => /Connected/.test((await opened.locator("#link").count()) ? await opened.textContent("#link") : ""), "it is let in");
}
/** Looks at the run in `bean` until photographs have come, and stops it from the page. */
async function watchAndStop(cwd, opened, prefix) {
  await opened.goto(`${prefix}run?at=bean`);
  const frame = () => opened.textContent("#frame");
  await until(async () => /^\d+\.jpg$/.test(await frame()), "a photograph");
  const first = await frame();
  await until(async () => (await frame()) !== first, "the next photograph");
  // The name stands before the picture is loaded.
  await until(() => opened.evaluate(() => document.querySelector("#img").naturalWidth > 0), "its picture is loaded");
  await opened.click("#ask-button");
  await opened.click("#ask button[value=yes]");
  await until(async () => /Stopped/.test(await opened.locator("#state .chip").first().textContent()), "it is stopped", 20);
  const left = photographs(cwd, "bean");
  await opened.waitForTimeout(1500);
  assert.equal(photographs(cwd, "bean"), left);
}

test("behind nginx with TLS, a path prefix and an odd port", { skip: NGINX ? false : "no nginx" }, async (t) => {
  const cwd = folder(t);
  certificate(cwd, "DNS:plants.example.org");
  start(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", "bean", "--speed", "300");
  const { child, address } = await studio(t, cwd, 0, "--ask-token", "--host", "plants.example.org");
  const port = await freePort();
  // As docs/how-to/studio-on-a-phone.md says, and no more than that.
  fs.writeFileSync(
    path.join(cwd, "nginx.conf"),
    `daemon off; pid ${cwd}/nginx.pid; error_log ${cwd}/nginx.log; events {}
http {
  access_log off; client_body_temp_path ${cwd}/body; proxy_temp_path ${cwd}/proxy;
  fastcgi_temp_path ${cwd}/a; uwsgi_temp_path ${cwd}/b; scgi_temp_path ${cwd}/c;
  server {
    listen 127.0.0.1:${port} ssl;
    server_name plants.example.org;
    ssl_certificate ${cwd}/certificate.pem; ssl_certificate_key ${cwd}/key.pem;
    location /green/house/ {
      proxy_pass ${address};
      proxy_http_version 1.1;
      proxy_set_header Host $host;
      proxy_set_header X-Forwarded-Proto $scheme;
    }
  }
}
`,
  );
  const nginx = spawn(NGINX, ["-c", path.join(cwd, "nginx.conf"), "-e", path.join(cwd, "nginx.log")], { stdio: "ignore" });
  t.after(() => nginx.kill("SIGKILL"));
  t.after(() => nginx.kill("SIGTERM"));
  await until(
    () =>
      new Promise((done) => {
        const socket = net.connect(port, "127.0.0.1", () => {
          socket.destroy();
          done(true);
        });
        socket.on("error", () => done(false));
      }),
    "nginx",
    20,
  );
  const prefix = `https://plants.example.org:${port}/green/house/`;
  const opened = await page(t, prefix, { ignoreHTTPSErrors: true });
  assert.equal(opened.url(), `${prefix}login`);
  await logIn(opened, tokenOf(child));
  const [cookie] = await opened.context().cookies();
  assert.deepEqual([cookie.secure, cookie.httpOnly, cookie.sameSite], [true, true, "Strict"]);
  await until(async () => /bean/.test(await opened.textContent("#rows")), "the overview lists the run");
  await watchAndStop(cwd, opened, prefix);
  // What another site sends by the same way is refused.
  const status = await opened.evaluate(async () => {
    const answer = await fetch("api/run/stop", { method: "POST", headers: { "X-Tropism-Csrf": "guess" }, body: '{"at":"bean"}' });
    return answer.status;
  });
  assert.equal(status, 403);
});

test("with one's own certificate", async (t) => {
  const cwd = folder(t);
  certificate(cwd, "DNS:localhost,IP:127.0.0.1");
  start(t, cwd, "run", "--rig", "greenhouse", "--controller", "greedy", "--out", "bean", "--speed", "300");
  const tls = ["--tls-cert", "certificate.pem", "--tls-key", "key.pem"];
  const { child, address } = await studio(t, cwd, 0, "--ask-token", ...tls);
  assert.match(address, /^https:/);
  assert.match(child.said, /SHA-256 of the certificate: ([0-9A-F]{2}:){31}[0-9A-F]{2}/);
  const opened = await page(t, address, { ignoreHTTPSErrors: true });
  await logIn(opened, tokenOf(child));
  const [cookie] = await opened.context().cookies();
  assert.ok(cookie.secure);
  await watchAndStop(cwd, opened, address);
  assert.equal(await opened.evaluate(() => performance.getEntriesByType("navigation")[0].nextHopProtocol), "h2");
  // One connection carries more streams than a browser has connections, and what changes something beside them.
  const connection = http2.connect(address, { rejectUnauthorized: false });
  t.after(() => connection.destroy());
  const cookies = `${cookie.name}=${cookie.value}`;
  const streams = Array.from({ length: 12 }, () => connection.request({ ":path": "/api/events", cookie: cookies }));
  const heads = await Promise.all(streams.map((stream) => new Promise((done) => stream.on("response", done))));
  assert.deepEqual(new Set(heads.map((head) => head[":status"])), new Set([200]));
  const asked = connection.request({ ":path": "/api/session", cookie: cookies });
  const head = await new Promise((done) => asked.on("response", done));
  assert.equal(head[":status"], 200);
  // The host of the address is looked at, too.
  const foreign = connection.request({ ":path": "/api/session", ":authority": "evil.example.org", cookie: cookies });
  assert.equal((await new Promise((done) => foreign.on("response", done)))[":status"], 421);
  // Who forgets the `s` is told so.
  const plain = await new Promise((done, failed) => {
    const asked = http.get(address.replace("https", "http"), (answer) => {
      let text = "";
      answer.on("data", (data) => (text += data));
      answer.on("end", () => done(`${answer.statusCode} ${text}`));
    });
    asked.on("error", failed);
  });
  assert.match(plain, /^400 .*https:\/\//);
});

test("certificates that cannot be used are refused by name", async (t) => {
  const cwd = folder(t);
  certificate(cwd, "DNS:localhost");
  fs.mkdirSync(path.join(cwd, "other"));
  certificate(path.join(cwd, "other"), "DNS:localhost");
  fs.writeFileSync(path.join(cwd, "text.pem"), "no certificate\n", { mode: 0o600 });
  fs.writeFileSync(path.join(cwd, "open.pem"), fs.readFileSync(path.join(cwd, "key.pem")), { mode: 0o644 });
  for (const [cert, key, wanted] of [
    ["none.pem", "key.pem", /none\.pem/],
    ["text.pem", "key.pem", /text\.pem: no certificate here: it is PEM/],
    ["certificate.pem", "text.pem", /text\.pem: no private key here: it is PEM/],
    ["certificate.pem", "other/key.pem", /other\/key\.pem: does not go with certificate\.pem/],
    ["certificate.pem", "open.pem", /open\.pem: found mode 644.*wanted 600/],
  ]) {
    const child = start(t, cwd, "studio", ".", "--listen", "127.0.0.1:0", "--tls-cert", cert, "--tls-key", key);
    await ended(child);
    assert.equal(child.exitCode, 1, child.said);
    assert.match(child.said, wanted);
  }
});
