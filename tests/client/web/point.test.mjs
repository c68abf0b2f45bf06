// The view of a point: time histories, moving finger, numbers.
import assert from "node:assert/strict";
import { test } from "node:test";
import * as web from "./setup.mjs";

const time = (page) => web.textOf(page, ".player output");
const finger = (page) => page.$eval(".two canvas[role=img]", (canvas) => canvas.toDataURL());

/** Runs in a tab before its scripts. Then only `goOn` advances the clock and animation frames. */
function framesByHand() {
  let now = 0;
  let next = 0;
  const frames = new Map();
  performance.now = () => now;
  window.requestAnimationFrame = (draw) => frames.set(++next, draw) && next;
  window.cancelAnimationFrame = (which) => frames.delete(which);
  window.goOn = (seconds) => {
    for (const end = now + seconds * 1000; now < end;) {
      now += 50;
      const due = [...frames.values()];
      frames.clear();
      for (const draw of due) draw(now);
    }
  };
}
const goOn = (page, seconds) => page.evaluate((long) => window.goOn(long), seconds);

test("the contact plays automatically and can be paused; with reduced motion it plays only on request", async () => {
  const page = await web.point({ motion: "no-preference", early: framesByHand });
  await goOn(page, 1);
  const playing = parseFloat(await time(page));
  assert.ok(playing > 0);
  await goOn(page, 1);
  assert.ok(parseFloat(await time(page)) > playing);
  await page.click(".play");
  const stopped = await time(page);
  await goOn(page, 1);
  assert.equal(await time(page), stopped);
  await page.close();
  const still = await web.point({ early: framesByHand });
  await goOn(still, 1);
  assert.equal(await time(still), "0.0 µs");
  await still.click(".play");
  await goOn(still, 1);
  assert.notEqual(await time(still), "0.0 µs");
  await still.close();
});

test("the slider moves the finger and the cursors of the plots, and keys in a plot move the slider", async () => {
  const page = await web.point();
  const cursor = () => page.$eval(".u-cursor-x", (one) => one.style.transform);
  const before = [await finger(page), await cursor()];
  await web.slideTo(page, ".scrub input", 900);
  assert.notEqual(await finger(page), before[0]);
  assert.notEqual(await cursor(), before[1]);
  await page.focus(".plot[role=application]");
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowRight");
  await web.shows(page, "figure .reading:not(:empty)", /µs: F_n [\d.]+ N, F_t/);
  assert.ok(parseFloat(await time(page)) < 50);
  await page.close();
});

test("a point shows all its numbers with their meaning", async () => {
  const page = await web.point({ width: 400 });
  const texts = await page.$$eval("dl.values div", (all) =>
    all.map((one) => [one.firstChild.textContent, one.lastChild.textContent, one.title]),
  );
  const numbers = new Map(texts.map(([name, ...rest]) => [name, rest]));
  for (const name of ["fn_peak_N", "closure", "solver_version", "k"])
    assert.ok(numbers.has(name), name);
  assert.match(numbers.get("duration_s")[0], /^\d+\.\d+ µs$/);
  assert.match(numbers.get("slide_m")[1], /length of the path/);
  await page.close();
});

test("the plots of a point are saved as one PNG and its time histories as CSV", async () => {
  const page = await web.point({ early: web.keepSaved });
  await web.press(page, "Plots as PNG");
  const height = await web.until(page, () => window.image?.height);
  const heights = await page.$$eval(".uplot canvas", (all) => all.map((one) => one.height));
  assert.ok(height > heights.reduce((sum, one) => sum + one), `${height} ${heights}`);
  await web.press(page, "Time histories as CSV");
  const saved = await web.until(page, () => window.saved);
  assert.match(saved, /^t_s,fn_N,.*,state\r\n0,0,/);
  await page.close();
});

test("a refused trace is requested again, and the page shows the reason", web.inFull, async () => {
  const page = await web.browser.open("#/study/1/point/7", {
    isHurried: true,
    early: () => {
      const real = window.fetch;
      let refused = 0;
      window.shown = [];
      window.fetch = async (path, how) => {
        if (!/\/trace\?/.test(path)) return real(path, how);
        window.shown.push(
          document.querySelector("[aria-label='Time histories'] .said").textContent,
        );
        const status = [409, 503][refused++];
        const error = () => new Response('{"error":"too many wait"}', { status });
        return status ? error() : real(path, how);
      };
    },
  });
  await web.until(page, () => document.querySelectorAll(".uplot").length === 4);
  const shown = await page.evaluate(() => window.shown.slice(1));
  assert.deepEqual(shown, Array(2).fill("No time histories yet: too many wait. Trying again."));
  await page.close();
});

test("a point that is solved while its page is open shows its numbers", async () => {
  const page = await web.browser.open("#/", {
    early: () => {
      const real = window.fetch;
      window.fetch = async (path, how) => {
        const answer = await real(path, how);
        if (!/\/rows\?.*where=point/.test(path) || window.isSolved) return answer;
        return new Response(JSON.stringify({ ...(await answer.json()), rows: [] }));
      };
    },
  });
  const id = await web.submit(page, "solved later", web.longAxes);
  await web.goTo(page, `#/study/${id}/point/0`);
  await web.shows(page, "main", /This point is not solved yet\./);
  await page.evaluate(() => (window.isSolved = true));
  await web.shows(page, ".figures", /fn_peak_N/);
  assert.ok(!(await web.textOf(page, "main")).includes("not solved yet"));
  await web.api(page, `/api/studies/${id}/cancel`, {});
  await page.close();
});
