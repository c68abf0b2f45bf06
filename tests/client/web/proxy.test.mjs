// The page behind a proxy that adds a prefix to each path, as JupyterHub and Open OnDemand do.
import assert from "node:assert/strict";
import { copyFileSync } from "node:fs";
import { createServer, request } from "node:http";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { Browser, Server, until } from "./browser.mjs";

const prefix = "/user/ann/proxy/7602";
const server = new Server(join(process.env.OBLIQUE_BIN, "oblique"));
const browser = new Browser();
let proxy;

/** Starts a proxy for paths below the prefix; returns its origin. */
async function startProxy({ hostname, port }) {
  proxy = createServer((asked, answer) => {
    if (!asked.url.startsWith(`${prefix}/`)) return answer.writeHead(404).end();
    const headers = {
      ...asked.headers,
      host: `${hostname}:${port}`,
      "x-forwarded-host": asked.headers.host,
    };
    const path = asked.url.slice(prefix.length);
    const passed = request({ hostname, port, path, method: asked.method, headers }, (given) => {
      answer.writeHead(given.statusCode, given.headers);
      given.pipe(answer);
    });
    passed.on("error", () => answer.destroy());
    answer.on("close", () => passed.destroy());
    return asked.pipe(passed);
  });
  await new Promise((ready) => proxy.listen(0, "127.0.0.1", ready));
  return `http://127.0.0.1:${proxy.address().port}`;
}

before(async () => {
  copyFileSync(process.env.OBLIQUE_PAGE_DB, server.database);
  await server.start();
  const at = new URL(server.address);
  const origin = `${await startProxy(at)}${prefix}`;
  await browser.start({ origin, address: `${origin}${at.pathname}${at.search}` });
});

after(async () => {
  await browser.stop();
  proxy.closeAllConnections();
  proxy.close();
  await server.stop();
  assert.deepEqual(browser.errors, [], "errors, policy reports or requests outside of the prefix");
});

const shows = (page, selector) => until(page, (of) => document.querySelector(of), selector);

test("studies, pictures, tables and time histories are shown", async () => {
  const page = await browser.open("#/");
  await shows(page, "a[href='#/study/1']");
  await page.evaluate(() => void (location.hash = "#/study/1"));
  await shows(page, ".map canvas[tabindex]");
  await shows(page, ".rows tbody td");
  const link = await page.$eval("a[href*='format=csv']", (one) => one.href);
  assert.ok(link.startsWith(browser.server.origin), link);
  await page.evaluate(() => void (location.hash = "#/study/1/point/100"));
  await until(page, () => document.querySelectorAll(".uplot").length === 4);
  await page.close();
});

test("changes are accepted, and their cookie is for the prefix", async () => {
  const page = await browser.open("#/");
  const status = await page.evaluate(async () => {
    const axes = ["H", "mu", "e"].map((key) => ({ key, from: 0.5, to: 1, count: 2 }));
    const body = JSON.stringify({ model: { preset: "paper" }, recipe: { blocks: [{ axes }] } });
    const headers = { "Content-Type": "application/json" };
    return (await fetch("api/check", { method: "POST", headers, body })).status;
  });
  assert.equal(status, 200);
  const cookies = await page.cookies();
  assert.deepEqual(
    cookies.map((one) => one.path),
    [prefix],
  );
  await page.close();
});
