// Points that failed: why, and which they are.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, study, submit, text_of, until } from "./here.mjs";

test("a study some of whose points failed says why, how many, and shows them in its table; the overview leads there", async () => {
  const id = await submit("too far", { H: [1.15, 1.19, 3], mu: [0.5, 1, 2], e: [0.9, 1, 2] });  // the tip turns back at 1.179 m
  const running = await browser.open(`#/study/${id}`);
  await until(running, () => document.querySelector(".standing")?.textContent.startsWith("done"));
  await running.close();
  const page = await study(`#/study/${id}`);
  await until(page, () => document.querySelector(".failure").textContent.startsWith("Point"));
  assert.match(await text_of(page, ".failure"), /^Point 8 failed: H = 1\.19 m is not allowed.* 1\.179\d* m.*Show all 4 that failed$/);
  await page.click(".failure a");
  await until(page, () => document.querySelectorAll(".rows tbody tr").length === 4);
  assert.equal(new URLSearchParams(new URL(page.url()).hash.split("?")[1]).get("where"), "error IS NOT NULL");
  const heads = await page.$$eval(".rows thead th", (all) => all.map((one) => one.textContent.trim()));
  assert.ok(heads.some((one) => one.startsWith("error")), heads.join());
  assert.match(await text_of(page, ".rows tbody"), /1\.179\d* m/);
  await page.goBack();
  await until(page, () => document.querySelectorAll(".rows tbody tr").length === 12);
  await page.close();

  const overview = await browser.open("#/");
  await until(overview, () => document.querySelector('a[href*="error"]')?.textContent === "4");
  await overview.click('a[href*="error"]');
  await until(overview, () => document.querySelectorAll(".rows tbody tr").length === 4);
  await overview.close();
});

test("a study none of whose points failed says nothing of failures", async () => {
  const page = await study();
  assert.equal(await page.$eval(".failure", (one) => one.hidden), true);
  await page.close();
});
