// Focus and cursor stay where they are when the page reloads a running study.
import assert from "node:assert/strict";
import { test } from "node:test";
import * as web from "./setup.mjs";

test("updates of a running study keep the focused button, the plot with its cursor, and the commands", async () => {
  const page = await web.browser.open("#/", { isHurried: true });
  const id = await web.submit(page, "looked at", web.longAxes);
  await web.goTo(page, `#/study/${id}?pic=histogram&x=mu`);
  const isRefreshed = async () => {
    const isBins = (answer) => answer.url().includes("/bins?");
    for (let i = 0; i < 2; ++i) await page.waitForResponse(isBins);
  };
  await page.waitForSelector(".u-over");
  for (const selector of ["[data-change=pause]", ".plot[role]", ".copied button"]) {
    const one = await page.waitForSelector(selector);
    await one.focus();
    if (selector.startsWith(".plot")) await page.keyboard.press("Home");
    await isRefreshed();
    assert.ok(await one.evaluate((element) => element === document.activeElement), selector);
    if (!selector.startsWith(".plot")) continue;
    await page.keyboard.press("ArrowRight");
    assert.match(await web.textOf(page, ".lines .reading"), /^mu [\d.]+ /);
  }
  await page.click('[data-change="pause"]');
  await page.waitForSelector('[data-change="resume"]');
  await web.api(page, `/api/studies/${id}/cancel`, {});
  await page.close();
});

test("points that are solved while a study is loading are shown", async () => {
  const page = await web.browser.open("#/study/1", {
    early: () => {
      const real = window.fetch;
      let tables = 0;
      window.fetch = async (path, how) => {
        const answer = await real(path, how);
        const changed = async (fields) =>
          new Response(JSON.stringify({ ...(await answer.json()), ...fields }));
        if (path === "api/studies/1") return changed({ state: "running" });
        return /\/rows\?.*select=point/.test(path) && ++tables === 1
          ? changed({ rows: [] })
          : answer;
      };
    },
  });
  await web.until(page, () => document.querySelectorAll(".rows tbody tr").length === 25);
  await web.showsRowCount(page, /of 252 rows/);
  await page.close();
});
