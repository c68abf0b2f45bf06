// Hands and focus stay where they are while a study runs and its pictures and tables are made anew.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, change, study, submit, text_of, until } from "./here.mjs";

/** A tab at a study that goes on for minutes, until it is cancelled. */
async function running(name) {
  const id = await submit(name, { H: [0.2, 1.1, 200], mu: [0.1, 2, 200], e: [0.5, 1, 50] });
  return { id, page: await study(`#/study/${id}?pic=histogram&x=mu`, { is_hurried: true }) };
}

/** Until more of its points are known than when it was asked. */
async function goes_on(page) {
  const settled = await page.$eval(".standing progress", (one) => one.value);
  await until(page, (before_) => document.querySelector(".standing progress").value > before_, settled);
}
/** Until what the page asks for by that path has been asked twice, so that the first answer is shown. */
async function is_refreshed(page, path) {
  for (let i = 0; i < 2; ++i) await page.waitForResponse((answer) => answer.url().includes(path));
}
const has_focus = (page, selector) => page.evaluate((wanted) => document.activeElement.matches(wanted), selector);

test("the buttons of a running study stay under the finger that presses one, and keep the focus", async () => {
  const { id, page } = await running("pressed");
  const kPause = '[data-change="pause"]';
  await page.focus(kPause);
  await goes_on(page);
  assert.ok(await has_focus(page, kPause));
  const box = await (await page.$(kPause)).boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await goes_on(page);
  await page.mouse.up();
  await page.waitForSelector('[data-change="resume"]');
  assert.ok(await has_focus(page, '[data-change="resume"]'));
  await page.keyboard.press("Enter");
  await page.waitForSelector(kPause);
  await page.close();
  await change(id, "cancel");
});

test("a plot of a running study is the same one after a refresh, with its focus and cursor, and so are the commands", async () => {
  const { id, page } = await running("looked at");
  const kPlot = ".plot[role=application]";
  await page.waitForSelector(".u-over");
  await page.focus(kPlot);
  await page.keyboard.press("Home");
  const plot = await page.$(kPlot);
  await is_refreshed(page, "/bins?");
  assert.ok(await plot.evaluate((one) => one === document.activeElement));
  await page.keyboard.press("ArrowRight");
  assert.match(await text_of(page, ".lines .reading"), /^mu [\d.]+ /);
  const copy = await page.$(".commands .copied button");
  await copy.focus();
  await is_refreshed(page, "/bins?");
  assert.ok(await copy.evaluate((one) => one === document.activeElement));
  await page.close();
  await change(id, "cancel");
});

test("points that were solved while a study was opened are shown", async () => {
  const page = await browser.open("#/study/1", { early: () => {
    const real = window.fetch;
    let tables = 0;
    window.fetch = async (path, how) => {
      const answer = await real(path, how);
      if (path === "/api/studies/1") return new Response(JSON.stringify({ ...await answer.json(), state: "running" }));
      if (/\/rows\?.*select=point/.test(path) && ++tables === 1) return new Response(JSON.stringify({ ...await answer.json(), rows: [] }));
      return answer;
    };
  } });
  await until(page, () => document.querySelectorAll(".rows tbody tr").length > 0);
  await page.close();
});

test("who sorts by keys stays at the column, who fits colours at the button, and who turns to the last page at the other button", async () => {
  const page = await study();
  await page.evaluate(() => [...document.querySelectorAll(".rows button.plain")].find((one) => one.textContent.startsWith("mu")).focus());
  for (const order of ["ascending", "descending"]) {
    await page.keyboard.press("Enter");
    await until(page, (wanted) => document.querySelector(`.rows th[aria-sort=${wanted}]`)?.textContent.startsWith("mu"), order);
    assert.match(await page.evaluate(() => document.activeElement.textContent), /^mu/);
  }
  await page.evaluate(() => [...document.querySelectorAll(".rows button")].find((one) => one.textContent === "Next").focus());
  await page.keyboard.press("Enter");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent.startsWith("26 to 50"));
  await page.evaluate(() => [...document.querySelectorAll(".rows button")].find((one) => one.textContent === "Previous").focus());
  await page.keyboard.press("Enter");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent.startsWith("1 to 25"));
  assert.equal(await page.evaluate(() => document.activeElement.textContent), "Next");
  await page.evaluate(() => [...document.querySelectorAll(".picture button")].find((one) => one.textContent === "Fit").focus());
  await page.keyboard.press("Enter");
  assert.equal(await page.evaluate(() => document.activeElement.textContent), "Fit");
  await page.close();
});

test("the list of the rarer modes stays open when the picture is drawn anew", async () => {
  const page = await study("#/study/1?z=mode&at=e@2");
  await page.click(".categories summary");
  const list = await page.$(".categories details");
  await page.evaluate(() => document.querySelector(".controls .ticks input").click());
  await until(page, (old) => !old.isConnected && document.querySelector(".categories details"), list);
  assert.ok(await page.$eval(".categories details", (one) => one.open));
  await page.close();
});
