// What the view of a study shows beside its pictures: rows, failed points, a lost server; modules
// and ticks.
import assert from "node:assert/strict";
import { test } from "node:test";
import * as web from "./setup.mjs";

test("rows are paged and sorted, also by keyboard, and the address contains the page", async () => {
  const page = await web.study("#/study/1");
  await web.showsRowCount(page, /^1 to 25 of 252 rows\.$/);
  await web.press(page, "Next");
  await web.showsRowCount(page, /^26 to 50 of 252 rows\.$/);
  await web.until(page, () => location.hash.includes("page=2"));
  await web.write(page, web.whereField, "mu > 1"); // a new filter returns to the first page
  await web.showsRowCount(page, /^1 to 25 of 126 rows/);
  await page.evaluate(() =>
    [...document.querySelectorAll("th button")].find((one) => one.textContent === "mu").focus(),
  );
  for (const order of ["ascending", "descending"]) {
    await page.keyboard.press("Enter");
    await web.shows(page, `.rows th[aria-sort=${order}]`, /^mu/);
    assert.match(await page.evaluate(() => document.activeElement.textContent), /^mu/);
  }
  await web.showsRowCount(page, /^1 to 25/);
  await page.close();
});

test("a study with failed points shows their number and the reason, and lists them in its table", async () => {
  const page = await web.browser.open("#/");
  const axes = { H: [1.15, 1.19, 3], mu: [0.5, 1, 2], e: [0.9, 1, 2] };
  const id = await web.submit(page, "too far", axes);
  await web.goTo(page, `#/study/${id}`); // the tip falls at most 1.179 m
  const why = /^Point 8 failed: H = 1\.19 m is not allowed.* 1\.179\d* m.*Show all 4$/;
  await web.shows(page, ".failure", why);
  await page.click(".failure a");
  await web.showsRowCount(page, /^1 to 4 of 4 rows/);
  assert.equal(await web.fieldOf(page, "where"), "error IS NOT NULL");
  assert.match(await web.textOf(page, ".rows thead"), /statuserror/);
  await page.close();
});

test("a server that does not answer is reported, and requests to it are repeated", async () => {
  const page = await web.study("#/study/1", {
    isHurried: true,
    expected: /ERR_INTERNET_DISCONNECTED/,
  });
  await page.setOfflineMode(true);
  await web.slideTo(page, ".sliders input", 2);
  await web.shows(page, "p.said", /^The server does not answer\. The last answer is shown\.$/);
  await web.goTo(page, "#/study/1/point/3");
  await web.shows(page, "main [role=alert]", /^The server does not answer\.$/);
  await page.evaluate(() => history.back());
  await web.until(page, () => location.hash.startsWith("#/study/1?"));
  await page.setOfflineMode(false);
  await web.facts(page, /e = 1/);
  await web.until(page, () => document.querySelector("p.said").textContent === "");
  await page.close();
});

test("all modules are preloaded, and no others", async () => {
  const page = await web.study("#/study/1");
  const [preloaded, needed] = await page.evaluate(async () => {
    const path = (address) => new URL(address, location.href).pathname;
    const links = [...document.querySelectorAll("link[rel=modulepreload]")];
    const found = new Set(["/main.js"]);
    // The loop also visits the modules that it adds to `found`.
    for (const module of found) {
      const text = await (await fetch(module)).text();
      for (const [, wanted] of text.matchAll(/ from "([^"]+)";$/gm)) {
        found.add(new URL(wanted, `${location.origin}${module}`).pathname);
      }
    }
    const named = [...links.map((one) => path(one.href)), "/main.js"];
    return [named.sort(), [...found].sort()];
  });
  assert.deepEqual(preloaded, needed);
  await page.close();
});

test("axes of any range have several ticks with different, short texts; infinite, tiny and huge ranges have a few round ones", async () => {
  const page = await web.study("#/study/1");
  const wrong = await page.evaluate(async () => {
    const { baseOf, scale, ticks, tickText } = await import("./lib/scale.js");
    const found = [];
    for (const from of [1e-280, 3e-14, 0.4, 1, 6e10, 1e200]) {
      for (const share of [2e-12, 1e-10, 1e-8, 1e-6, 1e-3, 0.38, 2.3, 11, 450, 1e40]) {
        for (const isLog of [false, true]) {
          const to = from * (1 + share);
          const base = baseOf(from, to);
          const texts = ticks(scale(from, to, isLog), 6).map((value) => tickText(value, base));
          const isShort = texts.every((text) => text.length <= 11);
          if (new Set(texts).size < Math.max(texts.length, 2) || !isShort)
            found.push({ from, to, isLog, texts });
        }
      }
    }
    return found;
  });
  assert.deepEqual(wrong, []);
  const shown = await page.evaluate(async () => {
    const { scale, ticks } = await import("/lib/scale.js");
    const ranges = [
      [0.01, 10, true],
      [3, 3 + 1e-15],
      [1, Infinity],
      [0, Number.MAX_VALUE],
    ];
    return ranges.map((ends) => ticks(scale(...ends), 6).join());
  });
  const expected = ["0.01,0.03,0.1,0.3,1,3,10", "3", "1", "0,5e+307,1e+308,1.5e+308"];
  assert.deepEqual(shown, expected);
  await page.close();
});
