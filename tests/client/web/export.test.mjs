// Files, links and commands that a view offers, and the button Refine.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import * as web from "./setup.mjs";

/** Runs a command that the page shows, and returns its output. */
function outputOf(command) {
  const words = web.wordsOf(command);
  assert.equal(words[words.indexOf("--db") + 1], web.server.database, command);
  const made = spawnSync(web.server.oblique, words, { encoding: "utf8" });
  assert.equal(made.status, 0, `${command}: ${made.stderr}`);
  return made.stdout;
}

const views = [
  ["1?at=e@2", "mu,H,fn_peak_N,point", 85],
  ["1?pic=map&z=mode&at=e@1&where=mu>0.3", "mu,H,mode,point", 85],
  ["1?pic=lines&y=e&xlog=1", "mu,e,fn_peak_N,point", 37],
  ["1?x0=2&x1=8&y0=1&y1=5", "mu,H,fn_peak_N,point", 36],
  [`${web.studies.scattered}?x=mu&y=fn_peak_N&z=major_mode`, "point,mu,fn_peak_N,major_mode", 301],
  [`${web.studies.scattered}?pic=histogram&x=duration_s`, "duration_s,points,point", 21],
  [`${web.studies.scattered}?pic=lines&x=mu`, "mu,share_below,fn_peak_N,point", 28],
  [`${web.studies.one}`, "point,mu,H,fn_peak_N", 2],
];

test("each kind of view offers a command that draws it, a CSV of its numbers, and a PNG with its legend", async () => {
  for (const [view, head, lines] of web.casesOf(views, 3)) {
    const page = await web.study(`#/study/${view}`, { early: web.keepSaved });
    const out = join(web.server.folder, "command.csv");
    outputOf((await web.textOf(page, ".commands code")).replace("picture.svg", out));
    assert.ok(readFileSync(out, "utf8").split("\n").length > 1, view);
    await web.press(page, "CSV");
    const saved = (await web.until(page, () => window.saved)).trim().split("\r\n");
    assert.deepEqual([saved[0], saved.length], [head, lines], view);
    const canvas = web.pictureIn(view) === web.mapCanvas ? ".map canvas" : ".uplot canvas";
    await page.waitForSelector(canvas);
    await web.press(page, "PNG");
    await web.until(page, () => window.image);
    const [higher, colours] = await page.$eval(canvas, (drawn) => {
      const { width, height } = window.image;
      const copy = new OffscreenCanvas(width, height).getContext("2d");
      copy.drawImage(window.image, 0, 0);
      const { data } = copy.getImageData(0, 0, width, height);
      return [height - drawn.height, new Set(new Uint32Array(data.buffer)).size];
    });
    assert.ok(higher > 20 && colours > 10, `${view}: ${higher} ${colours}`);
    await page.close();
  }
});

test("the CSV of the table equals the output of its command", async () => {
  const page = await web.study("#/study/1?at=e@2&where=mu<1&order=mu%20DESC");
  const table = await page.evaluate(async () => {
    const { href } = document.querySelector(".rows a[download]");
    return (await fetch(href)).text();
  });
  const [, command] = await page.$$eval(".commands code", (all) =>
    all.map((one) => one.textContent),
  );
  const value = (cell) => (cell === "" || Number.isNaN(Number(cell)) ? cell : Number(cell));
  const cells = (text) =>
    text
      .trim()
      .split(/\r?\n/)
      .map((line) => line.split(",").map(value));
  assert.deepEqual(cells(table), cells(outputOf(`${command} --format csv`)));
  await page.close();
});

test("Refine submits the shown part of a map as a new study and shows its progress", async () => {
  const view = "#/study/1?pic=map&z=slide_m&x=mu&y=H&at=e@1&x0=2&x1=4&y0=1&y1=3&from=0&to=1";
  const page = await web.study(view, { expected: /status of 409/ });
  assert.equal(await web.textOf(page, ".refine"), "Refine to 65 × 65 points");
  await page.click(".refine");
  await web.facts(page, /65 × 65 cells/);
  assert.equal(await web.textOf(page, "h2.name"), "friction-refined");
  assert.match(await page.evaluate(() => location.hash), /pic=map&z=slide_m&x=mu&y=H&from=0&to=1/);
  await web.facts(page, /4\u202f225 solved/);
  const id = await page.evaluate(() => Number(/\d+/.exec(location.hash)));
  const select = "min(mu),max(mu),min(H),max(H),min(e),max(e),min(k),count(*)";
  const [ends] = await web.rowsOf(page, id, { select });
  const expected = [0.1 + (2 * 1.9) / 11, 0.1 + (4 * 1.9) / 11, 0.6, 0.8, 0.8, 0.8, 2.7e7, 4225];
  ends.forEach((end, i) => assert.ok(Math.abs(end / expected[i] - 1) < 1e-12, `${ends}`));
  const name = ".picture .row input";
  assert.equal(await page.$eval(name, (one) => one.value), "friction-refined-2");
  await web.write(page, name, "scattered"); // a study of this name exists
  await page.click(".refine");
  await web.shows(page, "p.said.bad", /scattered/);
  await page.close();
});

test("the address describes the whole view", web.inFull, async () => {
  const page = await web.study(
    "#/study/1?pic=map&z=mode&at=e@2&where=mu>0.2&mark=H>0.8&order=mu%20DESC&drag=select",
  );
  const all = async (one) => [
    await one.evaluate(() => location.hash),
    await web.textOf(one, ".facts"),
    await web.fieldOf(one, "mark"),
    await web.textOf(one, ".rows tbody"),
  ];
  const other = await web.study(await page.evaluate(() => location.hash));
  assert.deepEqual(await all(other), await all(page));
  await other.close();
  await page.close();
});
