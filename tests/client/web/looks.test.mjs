// Layout and colours of every view, light and dark, in wide and narrow windows.
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import * as web from "./setup.mjs";

/** Address of each view, and selector of an element that exists once the view is drawn. */
const views = {
  overview: ["#/", "tbody tr"],
  selected: ["#/study/1?at=e@2&where=mu>0.3&mark=H>0.8", "[data-selected] .gaps li"],
  start: ["#/new", "form"],
  point: ["#/study/1/point/100", ".uplot"],
  lines: ["#/study/1?pic=lines&y=e&mark=H>0.8", "[data-selected] .uplot"],
  nothing: ["#/study/999", "[role=alert]"],
  map: ["#/study/1?cell=3", ".choice a"],
  modes: ["#/study/1?pic=map&z=mode&at=e@2", ".categories li"],
  medians: [`#/study/${web.studies.scattered}?pic=lines&x=mu`, ".uplot"],
  points: [`#/study/${web.studies.scattered}?x=mu&y=fn_peak_N&z=major_mode`, ".categories li"],
  bins: [`#/study/${web.studies.many}?x=mu&y=fn_peak_N&z=H`, ".bar"],
  histogram: [
    `#/study/${web.studies.scattered}?pic=histogram&mark=H>0.8`,
    "[data-selected] .uplot",
  ],
  one: [`#/study/${web.studies.one}`, ".files"],
  wrong: ["#/study/1?where=muu>1", "#said-where:not(:empty)"],
};

test("axe-core finds no fault in any view, light or dark, and nothing is wider than a window of 400 or 1400 pixels", async () => {
  const folder = process.env.OBLIQUE_SCREENSHOTS;
  if (folder) mkdirSync(folder, { recursive: true });
  const faults = [];
  for (const [i, [name, [view, drawn]]] of web.casesOf(Object.entries(views), 6).entries()) {
    // Each view has one look by default, in turn, and both looks with --all.
    const widths = i % 2 === 0 ? [1400, 400] : [400, 1400];
    for (const width of web.casesOf(widths, 1)) {
      const scheme = width > 400 ? "light" : "dark";
      const page = await web.browser.open(view, { width, scheme, expected: /status of 40[04]/ });
      await page.waitForSelector(drawn);
      const found = await web.browser.faults(page);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      if (wide > width) found.push(`${wide} pixels wide`);
      faults.push(...found.map((one) => `${name} ${width} ${scheme}: ${one}`));
      const path = folder && join(folder, `${name}-${width}-${scheme}.png`);
      if (path) await page.screenshot({ path, fullPage: true });
      await page.close();
    }
  }
  assert.deepEqual(faults, []);
});

test("in a window of 1400 x 900 pixels a map and its legend are visible without scrolling", async () => {
  for (const z of ["fn_peak_N", "mode"]) {
    const page = await web.study(`#/study/1?pic=map&z=${z}&at=e@2`);
    const ends = await page.$$eval(".colours, .map", (all) =>
      all.map((one) => one.getBoundingClientRect().bottom),
    );
    assert.ok(Math.max(...ends) <= 900, `${z}: ${ends}`);
    await page.close();
  }
});

test("a point's time histories and numbers fit two screens of 1400 x 900 pixels, with the forces first and the finger beside them", async () => {
  const page = await web.point();
  const [forces, tip] = await page.$$eval("figure", (all) =>
    all.map((one) => one.getBoundingClientRect().toJSON()),
  );
  assert.ok(tip.top === forces.top && tip.left > forces.right && forces.bottom < 900);
  const end = await page.$eval("dl.values", (one) => one.getBoundingClientRect().bottom);
  assert.ok(end <= 1800, `${end}`);
  await page.close();
});
