// What people take with them: files, links, commands.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { browser, kOne, kScattered, server, study, text_of, until } from "./here.mjs";

/** What a link of the page gives. */
const file = (page, text) => page.evaluate(async (wanted) => {
  const link = [...document.querySelectorAll("a[download]")].find((one) => one.textContent === wanted);
  const answer = await fetch(link.href);
  return { name: link.download, status: answer.status, text: await answer.text() };
}, text);

/** Runs a command that the page shows, as a shell would: it names the database that the page is of, instead of which another may be taken. */
function made_by(command, out, database = server.database) {
  const [, ...words] = ["oblique", ...command.replace(/^oblique /, "").replace("--out picture.svg", `--out ${out}`)
    .match(/'(?:[^']|'\\'')*'|\S+/g).map((word) => word.replace(/^'|'$/g, "").replaceAll("'\\''", "'"))];
  const at = words.indexOf("--db") + 1;
  assert.ok(at > 0 && words[at] === server.database, command);
  words[at] = database;
  const made = spawnSync(server.oblique, words, { encoding: "utf8" });
  assert.equal(made.status, 0, made.stderr);
  return made.stdout;
}

const kViews = ["#/study/1?at=e@2", "#/study/1?pic=map&z=mode&at=e@1&where=mu%20%3E%200.3", "#/study/1?x0=2&x1=8&y0=1&y1=5&pal=cividis", "#/study/1?pic=lines&y=e&xlog=1",
  `#/study/${kScattered}?pic=gathered&x=mu&y=fn_peak_N&z=H`, `#/study/${kScattered}?pic=histogram&x=duration_s`, `#/study/${kOne}`];

test("the SVG that a view gives is what its command draws", async () => {
  for (const view of kViews) {
    const page = await study(view);
    await page.waitForSelector(".files");
    const taken = await file(page, "SVG");
    assert.equal(taken.status, 200, `${view}: ${taken.text}`);
    const out = join(server.folder, "command.svg");
    made_by(await text_of(page, ".commands code"), out);
    assert.equal(taken.text, readFileSync(out, "utf8"), view);
    await page.close();
  }
});

test("what is solved while one looks has commands that solve and draw the same points", async () => {
  const page = await study("#/study/1?at=e@2&x0=2&x1=8&xlog=1");
  await page.evaluate(() => document.querySelector(".finer").click());
  const commands = await until(page, () => { const all = [...document.querySelectorAll(".commands code")].map((one) => one.textContent); return all[0]?.startsWith("oblique run") && all; });
  const side = Number(/--mu [\d.]+:[\d.]+:(\d+):log /.exec(commands[0])?.[1]);
  assert.ok(side >= 33, commands[0]);
  await page.close();
  const [database, out] = [join(server.folder, "part.db"), join(server.folder, "part.csv")];
  made_by(commands[0], "", database);
  made_by(commands[1].replace("picture.svg", out), out, database);
  const rows = readFileSync(out, "utf8").trim().split("\n").slice(1).filter((line) => !line.endsWith(","));
  assert.equal(rows.length, side ** 2, rows[0]);
});

test("a mode has the same place, and so the same look, in the page and in its SVG", async () => {
  const page = await study("#/study/1?z=mode&at=e@1");
  const names = await until(page, () => { const all = [...document.querySelectorAll(".categories > ul li span:first-of-type")]; return all.length > 0 && all.map((one) => one.textContent); });
  assert.ok(names.length > 3, String(names));
  const { text } = await file(page, "SVG");
  // A name that is too long for a line begins there.
  const legend = [...text.matchAll(/<text[^>]*>((?:[sS][CR] ?)+)(?: ?\(|<)/g)].map((found) => found[1].trim());
  let last = -1;
  for (const name of names) {
    const at = legend.findIndex((one, i) => i > last && (name === one || name.startsWith(`${one} `)));
    assert.ok(at > last, `${name} in ${legend}`);
    last = at;
  }
  await page.close();
});

test("the SVG that a point gives is what its command draws", async () => {
  const page = await browser.open("#/study/1/point/100");
  await page.waitForSelector(".files");
  await page.evaluate(() => {
    const pick = document.querySelector(".files").parentElement.querySelector("select");
    pick.value = "forces";
    pick.dispatchEvent(new Event("change"));
  });
  const taken = await file(page, "SVG");
  assert.equal(taken.status, 200, taken.text);
  const command = await page.$$eval("code", (all) => all.map((one) => one.textContent).find((text) => text.startsWith("oblique plot")));
  const out = join(server.folder, "point.svg");
  made_by(command, out);
  assert.equal(taken.text, readFileSync(out, "utf8"));
  await page.close();
});

test("pictures are also taken as PNG and CSV, and tables as CSV, which is what the command of the rows gives", async () => {
  const page = await study("#/study/1?at=e@2&where=mu%20%3C%201&order=mu%20DESC");
  const csv = await file(page, "CSV");
  assert.match(csv.text, /fn_peak/);
  assert.ok(csv.text.trim().split("\n").length > 20, csv.text.slice(0, 200));
  const png = await page.evaluate(async () => {
    const link = [...document.querySelectorAll("a[download]")].find((one) => one.textContent === "PNG");
    const answer = await fetch(link.href);
    return [answer.status, answer.headers.get("Content-Type"), (await answer.arrayBuffer()).byteLength];
  });
  if (png[0] === 200) assert.deepEqual([png[1], png[2] > 1000], ["image/png", true]);  // it needs rsvg-convert
  const table = await file(page, "Table as CSV");
  const [, command] = await page.$$eval(".commands code", (all) => all.map((one) => one.textContent));
  const cells = (text) => text.trim().split(/\r?\n/).map((line) => line.split(",").map((cell) => (cell === "" || Number.isNaN(Number(cell)) ? cell : Number(cell))));
  assert.deepEqual(cells(table.text), cells(made_by(`${command} --format csv`, "")));
  browser.objections = browser.objections.filter((one) => !one.includes("status of 422"));
  await page.close();
});

test("who takes a file gets it, or the sentence of the server that has none", async () => {
  const page = await study("#/study/1?at=e@2", { early: () => {
    const real = window.fetch;
    window.fetch = (path, given) => (String(path).includes("format=png")
      ? Promise.resolve(new Response('{"error":"PNG is made by rsvg-convert, which is not here"}', { status: 422 })) : real(path, given));
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => {
      blob.text().then((text) => { window.saved = text; });
      return make.call(URL, blob);
    };
  } });
  await page.waitForSelector(".files");
  const press = (name) => page.evaluate((wanted) => [...document.querySelectorAll("a[download]")].find((one) => one.textContent === wanted).click(), name);
  await press("PNG");
  await until(page, () => document.querySelector(".files .bad")?.textContent.includes("rsvg-convert"));
  await press("SVG");
  assert.match(await until(page, () => window.saved), /^<\?xml|^<svg/);
  await until(page, () => document.querySelector(".files [role=status]").textContent === "");
  await page.evaluate(() => { window.saved = ""; });
  await press("Table as CSV");
  assert.match(await until(page, () => window.saved), /^point,H,mu,e/);
  await page.close();
});

test("the numbers on screen are saved as a file", async () => {
  const page = await study("#/study/1?at=e@2");
  await page.waitForSelector(".files");
  await page.evaluate(() => {
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => {
      blob.text().then((text) => { window.saved = text; });
      return make.call(URL, blob);
    };
    [...document.querySelectorAll("button")].find((one) => one.textContent === "Numbers on screen as CSV").click();
  });
  const lines = (await until(page, () => window.saved)).trim().split("\r\n");
  assert.equal(lines[0], "mu,H,fn_peak_N,point");
  assert.equal(lines.length, 85);
  await page.close();
});

test("the address of a view is all of it", async () => {
  const page = await study("#/study/1?pic=map&z=mode&at=e@2&where=mu%20%3E%200.2&mark=H%20%3E%200.8&order=mu%20DESC&pal=cividis&drag=mark");
  const told = (one) => one.evaluate(() => [location.hash, document.querySelector(".facts").textContent, document.querySelector(".marks input").value,
    document.querySelector(".rows tbody").textContent]);
  const other = await study(await page.evaluate(() => location.hash));
  assert.deepEqual(await told(other), await told(page));
  await other.close();
  await page.close();
});
