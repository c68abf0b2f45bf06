// A point: its fall, its contact, the finger moving.
import assert from "node:assert/strict";
import { test } from "node:test";
import { point, text_of, until } from "./here.mjs";

/** Drags the time to a share of all that is watched. */
const scrub = (page, share) => page.$eval(".scrub input", (slider, to) => {
  slider.value = String(to * 1000);
  slider.dispatchEvent(new Event("input"));
}, share);
const time = (page) => text_of(page, ".player output");
const finger = (page) => page.$eval(".two canvas", (canvas) => canvas.toDataURL());

test("the finger falls in two seconds, and then its contact goes on by itself, with the time under every plot", async () => {
  const page = await point();
  await until(page, () => /^\u2212\d+ ms$/.test(document.querySelector(".player output").textContent));  // it falls
  assert.match(await text_of(page, ".player .speed"), /^falls, [\d.]+ times slower than it is$/);
  const begun = Date.now();
  await until(page, () => document.querySelector(".player output").textContent.endsWith("µs"));
  assert.ok(Date.now() - begun < 8000);
  const playing = parseFloat(await time(page));
  await until(page, (then) => parseFloat(document.querySelector(".player output").textContent) > then, playing);
  await page.click(".play");
  const stopped = await time(page);
  await new Promise((go_on) => setTimeout(go_on, 200));
  assert.equal(await time(page), stopped);
  await page.close();
});

test("the time is scrubbed from release through the contact, and the finger and the plots follow", async () => {
  const page = await point({ motion: "reduce" });
  const fall = await page.evaluate(async () => {
    const head = async (query) => {
      const bytes = await (await fetch(`/api/studies/1/points/100/trace?shape=1${query}`)).arrayBuffer();
      return JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, new DataView(bytes).getUint32(0, true))));
    };
    return [(await head("&fall=1")).fall_rows, (await (await fetch("/api/studies/1/points/100")).json()).row.fall_time_s];
  });
  assert.ok(fall[0] > 100);
  assert.equal(await time(page), `\u2212${(fall[1] * 1000).toFixed(0)} ms`);  // released
  const released = await finger(page);
  await scrub(page, 0.15);
  const falling = await finger(page);
  assert.notEqual(falling, released);
  const cursor = () => page.$eval(".u-cursor-x", (one) => one.style.transform);
  await page.click(".touch");
  assert.equal(await time(page), "0.0 µs");
  const touching = await cursor();
  await scrub(page, 0.9);
  assert.notEqual(await finger(page), falling);
  assert.notEqual(await cursor(), touching);
  await page.close();
});

test("a point shows its numbers and where they come from, and its plots are read by keys", async () => {
  const page = await point({ motion: "reduce" });
  const names = await page.$$eval("table.values th[scope=row]", (all) => all.map((one) => one.textContent));
  for (const name of ["fn_peak_N", "duration_s", "closure", "solver_version", "worker_name", "k"]) assert.ok(names.includes(name), name);
  await page.focus(".plot[role=application]");
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowRight");
  assert.match(await text_of(page, "figure .reading:not(:empty)"), /µs: F_n [\d.]+ N, F_t/);
  assert.match(await time(page), /^[\d.]+ µs$/);  // the finger stands where the plot is pointed at
  await page.close();
});

test("loops of more instants than a call has arguments are drawn", async () => {
  const page = await point({ motion: "reduce" });
  assert.equal(await page.evaluate(async () => {
    const { loop_plot } = await import("/point/loop.js");
    const long = { name: "x", unit: "m", values: Float64Array.from({ length: 300_000 }, (_, i) => i) };
    return loop_plot("long", long, long, 0).element.tagName;
  }), "FIGURE");
  await page.close();
});

test("who wants little motion sees the finger move only when asked", async () => {
  const page = await point({ motion: "reduce" });
  const released = await time(page);
  await new Promise((go_on) => setTimeout(go_on, 300));
  assert.equal(await time(page), released);
  await page.click(".play");
  await until(page, (then) => document.querySelector(".player output").textContent !== then, released);
  await page.close();
});
