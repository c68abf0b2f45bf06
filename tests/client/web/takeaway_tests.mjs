// What people take with them: files, links, commands.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { browser, kOne, kScattered, server, study, until } from "./here.mjs";

/** Run in a tab before its scripts: files that the page saves are kept as text. */
function keep_saved() {
  const make = URL.createObjectURL;
  URL.createObjectURL = (blob) => {
    blob.text().then((text) => { window.saved = text; });
    return make.call(URL, blob);
  };
}

/** Runs a command that the page shows, as a shell would. */
function made_by(command) {
  const [, ...words] = command.match(/'(?:[^']|'\\'')*'|\S+/g).map((word) => word.replace(/^'|'$/g, "").replaceAll("'\\''", "'"));
  assert.equal(words[words.indexOf("--db") + 1], server.database, command);
  const made = spawnSync(server.oblique, words, { encoding: "utf8" });
  assert.equal(made.status, 0, made.stderr);
  return made.stdout;
}

test("the command of each kind of view draws a picture", async () => {
  const page = await browser.open("#/");
  const out = join(server.folder, "command.csv");
  let before = "";
  for (const view of ["#/study/1?at=e@2", "#/study/1?pic=map&z=mode&at=e@1&where=mu%20%3E%200.3", "#/study/1?x0=2&x1=8&y0=1&y1=5&solve=off", "#/study/1?pic=lines&y=e&xlog=1",
    `#/study/${kScattered}?pic=gathered&x=mu&y=fn_peak_N&z=H`, `#/study/${kScattered}?pic=histogram&x=duration_s`, `#/study/${kOne}`]) {
    await page.evaluate((address) => { location.hash = address; }, view);
    const command = await until(page, (old) => {
      const text = document.querySelector(".commands code")?.textContent;
      return text !== old && text;
    }, before);
    made_by(command.replace("--out picture.svg", `--out ${out}`));
    assert.ok(readFileSync(out, "utf8").split("\n").length > 1, view);
    before = command;
  }
  await page.close();
});

test("the CSV of the table is what the command of the rows gives; a refusal is shown in the server's words", async () => {
  const page = await study("#/study/1?at=e@2&where=mu%20%3C%201&order=mu%20DESC", { early: keep_saved });
  const press = () => page.evaluate(() => [...document.querySelectorAll("a[download]")].find((one) => one.textContent === "Table as CSV").click());
  await press();
  const table = await until(page, () => window.saved);
  const [, command] = await page.$$eval(".commands code", (all) => all.map((one) => one.textContent));
  const cells = (text) => text.trim().split(/\r?\n/).map((line) => line.split(",").map((cell) => (cell === "" || Number.isNaN(Number(cell)) ? cell : Number(cell))));
  assert.deepEqual(cells(table), cells(made_by(`${command} --format csv`)));
  await page.evaluate(() => {
    window.fetch = () => Promise.resolve(new Response('{"error":"ask again later"}', { status: 503 }));
  });
  await press();
  await until(page, () => document.querySelector(".rows .row .bad")?.textContent === "ask again later");
  await page.close();
});

test("the numbers on screen are saved as a file", async () => {
  const page = await study("#/study/1?at=e@2", { early: keep_saved });
  await page.waitForSelector(".files");
  await page.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent === "Numbers on screen as CSV").click());
  const lines = (await until(page, () => window.saved)).trim().split("\r\n");
  assert.equal(lines[0], "mu,H,fn_peak_N,point");
  assert.equal(lines.length, 85);
  await page.close();
});

test("the address of a view is all of it", async () => {
  const page = await study("#/study/1?pic=map&z=mode&at=e@2&where=mu%20%3E%200.2&mark=H%20%3E%200.8&order=mu%20DESC&drag=mark");
  const told = (one) => one.evaluate(() => [location.hash, document.querySelector(".facts").textContent, document.querySelector(".marks input").value,
    document.querySelector(".rows tbody").textContent]);
  const other = await study(await page.evaluate(() => location.hash));
  assert.deepEqual(await told(other), await told(page));
  await other.close();
  await page.close();
});
