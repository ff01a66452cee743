// Serves the page to a headless Chromium in its test mode (web/test.js), prints the result, and takes a screenshot.
//
//   node browse.mjs FOLDER CHROMIUM PROFILE SCREENSHOT.png
import { spawn } from "node:child_process";
import { readFile, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join } from "node:path";

const [folder, chromium, profile, picture] = process.argv.slice(2);
const KINDS = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm" };
const LIMIT = 180_000; // ms, on a busy machine

const server = createServer(async (request, response) => {
  const name = new URL(request.url, "http://page").pathname.replace(/\/$/, "/index.html");
  try {
    response.setHeader("Content-Type", KINDS[extname(name)] ?? "text/plain");
    response.end(await readFile(join(folder, name)));
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((ready) => server.listen(0, "127.0.0.1", ready));

const browser = spawn(
  chromium,
  ["--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic"]
    .concat(["--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"])
    .concat([`--user-data-dir=${profile}`, "--window-size=1200,800", "--remote-debugging-pipe"]),
  { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] },
);
// The DevTools protocol over pipes: JSON messages, each terminated by a 0 byte.
const waiting = new Map();
let count = 0, pending = "";
browser.stdio[4].on("data", (data) => {
  const messages = (pending + data).split("\0");
  pending = messages.pop();
  for (const { id, result, error } of messages.map((message) => JSON.parse(message))) {
    waiting.get(id)?.(error ? Promise.reject(new Error(error.message)) : result);
  }
});
const call = (method, params = {}, sessionId = undefined) =>
  new Promise((done) => {
    waiting.set(++count, done);
    browser.stdio[3].write(`${JSON.stringify({ id: count, method, params, sessionId })}\0`);
  });

const overdue = setTimeout(() => finish(new Error(`nothing after ${LIMIT} ms`)), LIMIT);
function finish(error) {
  clearTimeout(overdue);
  if (error) console.error(error);
  process.exitCode = error ? 1 : 0;
  browser.kill();
  server.close();
  server.closeAllConnections();
}

try {
  const { targetId } = await call("Target.createTarget", { url: "about:blank" });
  const { sessionId } = await call("Target.attachToTarget", { targetId, flatten: true });
  await call("Page.enable", {}, sessionId);
  await call("Page.navigate", { url: `http://127.0.0.1:${server.address().port}/?test` }, sessionId);
  const found = { expression: "document.body?.dataset.test ?? ''" };
  for (let said = ""; said === ""; ) {
    await new Promise((later) => setTimeout(later, 200));
    said = (await call("Runtime.evaluate", found, sessionId)).result.value;
    if (said) console.log(said);
  }
  const { data } = await call("Page.captureScreenshot", { format: "png" }, sessionId);
  await writeFile(picture, Buffer.from(data, "base64"));
  finish();
} catch (error) {
  finish(error);
}
