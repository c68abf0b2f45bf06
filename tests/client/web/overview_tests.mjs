// Studies and workers, forms, and what is not there.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, text_of, until } from "./here.mjs";

test("the overview follows a study that is started on the page, live, and studies are paused, resumed and cancelled", async () => {
  const page = await browser.open("#/new");
  await page.waitForSelector("form");
  await page.type("form input", "live");
  const fields = await page.$$("form input");
  await fields[1].click({ clickCount: 3 });
  await fields[1].type("0.2:1.1:200");
  await fields[2].click({ clickCount: 3 });
  await fields[2].type("0.1:2:200");
  await fields[3].click({ clickCount: 3 });
  await fields[3].type("0.5:1:50");
  assert.match(await text_of(page, "form [role=status]"), /2\u202f000\u202f000 points/);
  await page.click("form button");
  await until(page, () => /^#\/study\/\d/.test(location.hash));
  await page.evaluate(() => { location.hash = "#/"; });
  const progress = () => page.$eval('progress[aria-label^="live"]', (bar) => bar.value);
  await until(page, () => document.querySelector('progress[aria-label^="live"]')?.value > 0);
  const first = await progress();
  await until(page, (then) => document.querySelector('progress[aria-label^="live"]').value > then, first);
  assert.match(await text_of(page, "#pace"), /points\/s/);
  const row_has = (state) => until(page, (wanted) => [...document.querySelectorAll("tr")].some((row) =>
    row.textContent.includes("live") && row.cells[1]?.textContent === wanted), state);
  await page.click('[data-change="pause"]');
  await row_has("paused");
  await page.click('[data-change="resume"]');
  await row_has("running");
  page.once("dialog", (dialog) => dialog.accept());
  await page.click('[data-change="cancel"]');
  await row_has("cancelled");
  await page.close();
});

test("a form that is wrong says what is allowed, filters are counted, and a server that refuses is heard", async () => {
  const page = await browser.open("#/new");
  await page.waitForSelector("form");
  const fields = await page.$$("form input");
  const write = async (field, text) => {
    await field.click({ clickCount: 3 });
    await field.type(text);
  };
  const told = () => text_of(page, "form [role=status]");
  await write(fields[2], "0.1:2");
  assert.match(await told(), /FROM:TO:COUNT/);
  await write(fields[2], "-1");  // only the server knows what a recipe may have
  await until(page, () => document.querySelector("form [role=status].bad")?.textContent.includes("mu"));
  assert.equal(await page.$eval("form button", (one) => one.disabled), true);
  await write(fields[2], "1:2:11");
  await write(fields[4], "mu > 1.75");
  await until(page, () => document.querySelector("form [role=status]").textContent.startsWith("3 points,") || document.querySelector("form [role=status]").textContent === "3 points.");
  assert.match(await page.$eval(".copied code", (one) => one.textContent), /--mu 1:2:11 --e 1 --where 'mu > 1.75'$/);
  await write(fields[0], "friction");  // there is one, of other points
  await page.click("form button");
  await until(page, () => document.querySelector("form [role=alert]").textContent.includes("friction"));
  browser.objections = browser.objections.filter((one) => !one.includes("status of 4"));  // these answers are wanted here
  await page.close();
});

test("nothing is listened to while the page is hidden", async () => {
  const page = await browser.open("#/");
  await page.waitForSelector("table");
  assert.equal(await page.evaluate(() => window.open_streams), 1);
  const hide = (is) => page.evaluate((hidden) => {
    Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
    return window.open_streams;
  }, is);
  assert.equal(await hide(true), 0);
  assert.equal(await hide(false), 1);
  await page.close();
});

test("what is not there is said", async () => {
  for (const [view, sentence] of [["#/study/999", /no such study/], ["#/study/1/point/999999", /no point/]]) {
    const page = await browser.open(view);
    await page.waitForSelector("[role=alert]");
    assert.match(await text_of(page, "[role=alert]"), sentence);
    await page.close();
  }
  browser.objections = browser.objections.filter((one) => !one.includes("status of 404"));
});

test("ticks, numbers and values on flags are what people expect", async () => {
  const page = await browser.open("#/");
  const told = await page.evaluate(async () => {
    const { scale, ticks } = await import("/parts/scale.js");
    const { heading, shown, quoted, time_left } = await import("/parts/format.js");
    const { axis_of } = await import("/start.js");
    const { axis_value } = await import("/study/axes.js");
    return { linear: ticks(scale(0.02, 2, false), 5), log: ticks(scale(0.01, 10, true), 6), constant: ticks(scale(3, 3, false), 5),
      shown: [0, 1e-9, 123456.78, -0.5, null].map((v) => shown(v)), heading: heading("fn_peak_N", "N"), quoted: quoted("it's"),
      left: [1, 600, 86400].map(time_left), list: axis_of("e", "0.6, 1").axis.values,
      log_axis: axis_of("k", "1:100:3:log").axis, last: axis_value({ range: { from: 1, to: 100, count: 3, spacing: "log" } }, 1) };
  });
  assert.deepEqual(told.linear, [0.5, 1, 1.5, 2]);
  assert.deepEqual(told.log, [0.01, 0.03, 0.1, 0.3, 1, 3, 10]);
  assert.deepEqual(told.constant, [3]);
  assert.deepEqual(told.shown, ["0", "1e-9", "123460", "-0.5", "–"]);
  assert.equal(told.heading, "fn_peak [N]");
  assert.equal(told.quoted, "'it'\\''s'");
  assert.deepEqual(told.left, ["1 s", "10 min", "24.0 h"]);
  assert.deepEqual(told.list, [0.6, 1]);
  assert.deepEqual(told.log_axis, { key: "k", from: 1, to: 100, count: 3, spacing: "SPACING_LOGARITHMIC" });
  assert.ok(Math.abs(told.last - 10) < 1e-12);
  await page.close();
});
