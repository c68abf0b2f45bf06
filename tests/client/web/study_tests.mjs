// A study: its map, its other pictures, its rows.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, kMap, server, study, text_of, until } from "./here.mjs";

test("a map shows its cells; pointing at one tells its value, a click chooses it, two open its point", async () => {
  const page = await study();
  assert.match(await text_of(page, ".facts"), /12 × 7 cells, 84 solved/);
  const colours = await page.$eval(".map canvas", (canvas) => new Set(new Uint32Array(
    canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size);
  assert.ok(colours > 20, `${colours} colours`);
  const box = await (await page.$(kMap)).boundingBox();
  // The first cell lies at the foot on the left.
  await page.mouse.move(box.x + 75, box.y + box.height - 60);
  await until(page, () => /mu 0.1, H 0.5 m: fn_peak_N [\d.]+ N/.test(document.querySelector(".reading").textContent));
  const told = Number((await text_of(page, ".reading")).match(/fn_peak_N ([\d.]+)/)[1]);
  const stored = await page.evaluate(async () => (await (await fetch("/api/studies/1/points/0")).json()).row.fn_peak_N);
  assert.ok(Math.abs(told / stored - 1) < 1e-4, `${told} ${stored}`);
  await page.mouse.click(box.x + 75, box.y + box.height - 60);
  assert.equal(await text_of(page, ".choice a"), "Open point 0");
  assert.equal(await page.$eval("tr.chosen", (row) => row.dataset.point), "0");
  await page.mouse.click(box.x + 75, box.y + box.height - 60, { clickCount: 2 });
  await until(page, () => location.hash === "#/study/1/point/0");
  await page.goBack();
  await until(page, () => document.querySelector(".choice a")?.textContent === "Open point 0");
  await page.close();
});

test("a map is moved over by keys, and its values are spoken", async () => {
  const page = await study();
  await page.focus(kMap);
  await page.keyboard.press("ArrowRight");
  assert.match(await text_of(page, ".reading[aria-live=polite]"), /mu 0.1, H 0.5 m/);
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowUp");
  assert.match(await text_of(page, ".reading[aria-live=polite]"), /mu 0.27273, H 0.6 m/);
  await page.keyboard.press("Enter");
  await until(page, () => /point\/\d+$/.test(location.hash));
  await page.close();
});

test("every view is a link, and tells the command that makes it", async () => {
  const page = await study("#/study/1?pic=map&z=mode&x=mu&y=H&at=e@2");
  assert.match(await text_of(page, ".categories"), /mode: \d+ here/);
  assert.match(await text_of(page, ".commands code"), /^oblique plot friction --map mode --x mu --y H --at e=1 --out/);
  await page.$eval("input[type=range]", (slider) => {
    slider.value = "0";
    slider.dispatchEvent(new Event("input"));
  });
  await until(page, () => document.querySelector(".facts").textContent.includes("e = 0.6"));
  const address = await page.evaluate(() => location.hash);
  const other = await study(address);
  assert.equal(await text_of(other, ".facts"), await text_of(page, ".facts"));
  await other.close();
  await page.close();
});

test("maps are zoomed by dragging and by keys, and lines, gathered points and histograms are drawn", async () => {
  const page = await study();
  const box = await (await page.$(kMap)).boundingBox();
  await page.mouse.move(box.x + 100, box.y + 40);
  await page.mouse.down();
  await page.mouse.move(box.x + 260, box.y + 160, { steps: 3 });
  await page.mouse.up();
  await until(page, () => !document.querySelector(".facts").textContent.includes("12 × 7"));
  await page.focus(kMap);
  await page.keyboard.press("0");
  await until(page, () => document.querySelector(".facts").textContent.includes("12 × 7"));
  for (const kind of ["lines", "gathered", "histogram"]) {
    await page.select(".controls select", kind);
    await until(page, (pic) => location.hash.includes(`pic=${pic}`) && (pic === "gathered"
      ? !document.querySelector(".map").hidden : document.querySelector(".uplot canvas")), kind);
    assert.equal(await text_of(page, "p.said"), "");
  }
  await page.close();
});

test("logarithmic axes of lines and bars are drawn, whatever their ends are", async () => {
  for (const view of ["#/study/1?pic=histogram&x=mu&xlog=1", "#/study/1?pic=lines&y=e&xlog=1&ylog=1", "#/study/4?pic=histogram&x=mu&xlog=1"]) {
    const page = await browser.open(view);
    const inked = () => {
      const canvas = document.querySelector(".uplot canvas");
      return canvas && new Set(new Uint32Array(canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size > 5;
    };
    await until(page, inked);
    await page.close();
  }
});

test("what lies between the cells of a map is solved while one looks, and is kept as a study", async () => {
  const page = await study();
  await page.click(".finer");
  await until(page, () => document.querySelector(".facts").textContent.match(/(\d+) × \1 cells, [1-9]/));
  await until(page, () => document.querySelector(".facts").textContent.includes("129 × 129"));
  await page.type('[aria-label^="Name under which"]', "kept");
  await page.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent === "Keep it as a study").click());
  await until(page, () => document.querySelector("p.said a")?.textContent === "kept");
  await page.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent === "Back to the study").click());
  await until(page, () => document.querySelector(".facts").textContent.includes("12 × 7"));
  await page.close();
});

test("rows are turned a page at a time and sorted, and nothing is truncated unsaid", async () => {
  const page = await study();
  const said = () => text_of(page, ".rows p[role=status]");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "1 to 25 of 252 rows.");
  await page.click(".rows button:not([disabled]):not(.plain)");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "26 to 50 of 252 rows.");
  await page.evaluate(() => [...document.querySelectorAll(".rows button.plain")].find((one) => one.textContent === "mu").click());
  await until(page, () => document.querySelector(".rows th[aria-sort=ascending]")?.textContent.startsWith("mu"));
  assert.equal(await said(), "1 to 25 of 252 rows.");
  const csv = await page.evaluate(async () => (await fetch(document.querySelector(".rows a[download]").href)).text());
  assert.equal(csv.trim().split("\r\n").length, 253);
  await page.close();
});

test("all modules that a study's map needs are asked for at once, and no others", async () => {
  const page = await study();
  const [preloaded, needed] = await page.evaluate(async () => {
    const path = (address) => new URL(address, location.href).pathname;
    const links = [...document.querySelectorAll("link[rel=modulepreload]")].map((one) => path(one.href)).concat(path("/main.js"));
    const found = new Set(["/main.js"]);
    for (const module of found) {  // grows meanwhile
      const text = await (await fetch(module)).text();
      for (const [, wanted] of text.matchAll(/^import .* from "([^"]+)";$/gm)) found.add(new URL(wanted, `${location.origin}${module}`).pathname);
      if (module === "/main.js") found.add("/study/study.js");
    }
    return [links.sort(), [...found].sort()];
  });
  assert.deepEqual(preloaded, needed);
  await page.close();
});
