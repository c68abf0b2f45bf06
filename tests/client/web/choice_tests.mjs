// The cell that is chosen, while pictures become finer and coarser.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, facts, kMap, study, submit, text_of, until } from "./here.mjs";

/** Run in a tab before its scripts: pictures of more cells a side come when `let_go` is called. */
function hold_finer_ones() {
  const real = window.fetch;
  const released = new Promise((go_on) => { window.let_go = go_on; });
  window.sides = [];
  window.fetch = async (path, how) => {
    const cells = /\/slice\?/.test(path) ? Number(new URL(path, location.href).searchParams.get("nx")) : 0;
    if (cells) window.sides.push(cells);
    if (cells === 256) await released;
    return real(path, how);
  };
}
const place = async (page) => (await text_of(page, ".reading")).split(":")[0];
/** Chooses the last cell of the fourth row. A view that has just been opened may take the focus once more, amidst the keys. */
const choose_by_keys = async (page) => {
  for (let tries = 0; tries < 5 && !(await place(page)).startsWith("mu 2,"); ++tries) {
    await page.focus(kMap);
    for (const key of [...Array(3 * tries).fill("ArrowDown"), "Home", "End", "ArrowUp", "ArrowUp", "ArrowUp"]) await page.keyboard.press(key);
  }
};

test("a large map is asked for with few cells first, and the cell that is chosen in it is the same point in the finer one", async () => {
  const id = await submit("large", { H: [0.5, 1.1, 200], mu: [0.1, 2, 200], e: [0.8, 0.8, 1] }, ["pause"]);
  const page = await browser.open(`#/study/${id}?pic=map&x=mu&y=H`, { early: hold_finer_ones });
  await facts(page, "96 × 96");
  await choose_by_keys(page);
  const [spoken, choice] = [await place(page), await text_of(page, ".choice a")];
  assert.match(spoken, /^mu 2, H 0\.5\d+ m$/);
  await page.evaluate(() => window.let_go());
  await facts(page, "200 × 200");
  assert.equal(await place(page), spoken);
  assert.equal(await text_of(page, ".choice a"), choice);
  await until(page, (text) => text.replace(/\D/g, "") === new URLSearchParams(location.hash.split("?")[1]).get("cell"), choice);
  assert.deepEqual(await page.evaluate(() => window.sides.slice(0, 2)), [96, 256]);
  // Keys go on from there. On a slow machine the coarse picture may have come again meanwhile.
  await facts(page, "200 × 200");
  await page.keyboard.press("ArrowLeft");
  assert.match(await place(page), /^mu 1\.99\d*, H 0\.5\d+ m$/);
  await page.close();
});

test("a coarse picture comes first when a large map is opened, and never for a few points more", async () => {
  const page = await browser.open("#/");
  const steps = await page.evaluate(async () => {
    const { steps_to } = await import("/study/pictures.js");
    const axes = ["mu", "H"].map((key) => ({ key, values: 200 }));
    const view = (is_refreshing) => ({ is: (name) => ({ pic: "map", z: "fn_peak_N", x: "mu", y: "H" })[name] ?? "", block: { kind: "grid", axes }, is_refreshing });
    return [view(false), view(true)].map(steps_to);
  });
  assert.deepEqual(steps, [[96, 256], [256]]);
  await page.close();
});

test("a study with few values along one of its two axes is lines unless somebody chooses, as a map would reach to what cannot be", async () => {
  const id = await submit("few", { H: [1, 1, 1], mu: [0.1, 2, 7], e: [0.6, 1, 3] });
  const page = await study(`#/study/${id}`);
  await until(page, () => document.querySelector(".commands code"));
  assert.match(await text_of(page, ".commands code"), /^oblique plot few --lines fn_peak_N --x mu --by e /);
  await page.close();
});
