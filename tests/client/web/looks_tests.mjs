// Every view, light and dark, wide and narrow.
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { browser, kMany, kOne, kScattered, until } from "./here.mjs";

/** Addresses, and what is there when they are drawn. */
const kViews = { overview: ["#/", "table"], map: ["#/study/1?cell=3", ".choice a"], modes: ["#/study/1?pic=map&z=mode&at=e@2", ".categories li"],
  marked: ["#/study/1?at=e@2&where=mu%20%3E%200.3&mark=H%20%3E%200.8", "[data-marks] .gaps li"],
  lines: ["#/study/1?pic=lines&y=e", ".uplot"], points: [`#/study/${kScattered}?pic=gathered&x=mu&y=fn_peak_N&z=H&mark=H%20%3E%200.8`, "[data-marks] .bar"],
  bins: [`#/study/${kMany}?pic=gathered&x=mu&y=fn_peak_N&z=H`, ".bar"], histogram: [`#/study/${kScattered}?pic=histogram&x=duration_s&mark=H%20%3E%200.8`, "[data-marks] .uplot"],
  one: [`#/study/${kOne}`, ".files"], wrong: ["#/study/1?where=muu%20%3E%201", "#said-where.bad"], point: ["#/study/1/point/100", ".uplot"], start: ["#/new", "form"],
  nothing: ["#/study/999", "[role=alert]"] };

test("axe-core finds nothing wrong with any view, light or dark, and nothing is wider than a window of 400 or 1280 pixels", async () => {
  const folder = process.env.OBLIQUE_SCREENSHOTS;
  if (folder) mkdirSync(folder, { recursive: true });
  const faults = [];
  for (const [name, [view, there]] of Object.entries(kViews)) {
    const page = await browser.open(view, { motion: "reduce", expected: /status of 40[04]/ });
    for (const [width, scheme] of [[1280, "light"], [400, "dark"], ...(folder ? [[400, "light"], [1280, "dark"]] : [])]) {
      await browser.look(page, { width, scheme, motion: "reduce" });
      await page.waitForSelector(there);
      if (folder) {  // drawings have the colours of when they were drawn
        await page.reload();
        await page.waitForSelector(there);
        await until(page, () => !document.querySelector("p.said:not([id])")?.textContent);
      }
      faults.push(...(await browser.faults(page)).map((one) => `${name} ${width} ${scheme}: ${one}`));
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      if (wide > width) faults.push(`${name} is ${wide} pixels wide in ${width}`);
      if (folder) await page.screenshot({ path: join(folder, `${name}-${width}-${scheme}.png`), fullPage: true });
    }
    await page.close();
  }
  assert.deepEqual(faults, []);
});
