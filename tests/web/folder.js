// The page as a static folder behind a server of its own, as any host would serve it.
import fs from "node:fs";
import http from "node:http";
import path from "node:path";

const KINDS = { html: "text/html", js: "text/javascript", svg: "image/svg+xml", webmanifest: "application/manifest+json", lzma: "application/octet-stream" };

/** The server of the folder of the page, and its address. */
export async function served() {
  const server = http.createServer((request, answer) => {
    const name = request.url.split("?")[0].slice(1) || "index.html";
    const file = path.join(process.env.TROPISM_WEB, "site", name);
    if (!fs.existsSync(file)) return answer.writeHead(404).end();
    answer.writeHead(200, { "Content-Type": KINDS[name.split(".").at(-1)] });
    answer.end(fs.readFileSync(file));
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return { server, address: `http://127.0.0.1:${server.address().port}/` };
}
