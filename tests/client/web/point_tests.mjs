// A point: its fall, its contact, the finger moving.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, change, point, submit, text_of, until } from "./here.mjs";

/** Drags the time to a share of all that is watched. */
const scrub = (page, share) => page.$eval(".scrub input", (slider, to) => {
  slider.value = String(to * 1000);
  slider.dispatchEvent(new Event("input"));
}, share);
const time = (page) => text_of(page, ".player output");
/** Run in a tab before its scripts: frames come, and time goes by, only when `go_on` says how long. */
function frames_by_hand() {
  let now = 0;
  let next = 0;
  const asked = new Map();
  performance.now = () => now;
  window.requestAnimationFrame = (draw) => {
    asked.set(++next, draw);
    return next;
  };
  window.cancelAnimationFrame = (which) => asked.delete(which);
  window.go_on = (seconds) => {
    for (const end = now + seconds * 1000; now < end;) {
      now += 50;
      const due = [...asked.values()];
      asked.clear();
      for (const draw of due) draw(now);
    }
  };
}
const go_on = (page, seconds) => page.evaluate((so_long) => window.go_on(so_long), seconds);
const finger = (page) => page.$eval(".two canvas", (canvas) => canvas.toDataURL());

test("the finger falls in two seconds, and then its contact goes on by itself, with the time under every plot", async () => {
  const page = await point({ early: frames_by_hand });
  await go_on(page, 1.9);
  assert.match(await time(page), /^\u2212\d+ ms$/);
  assert.match(await text_of(page, ".player .speed"), /^falls, [\d.]+ times slower than it is$/);
  await go_on(page, 0.2);
  assert.match(await time(page), / µs$/);
  const playing = parseFloat(await time(page));
  await go_on(page, 0.2);
  assert.ok(parseFloat(await time(page)) > playing);
  await page.click(".play");
  const stopped = await time(page);
  await go_on(page, 1);
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
    return [(await head("&fall=1")).fall_rows, (await (await fetch("/api/studies/1/rows?select=fall_time_s&where=point=100")).json()).rows[0][0]];
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

test("what is written beside the finger has the page's colour around it, and nothing is drawn over it", async () => {
  const page = await point({ motion: "reduce", early: () => {
    const { prototype } = CanvasRenderingContext2D;
    const note = (name, told) => {
      const real = prototype[name];
      prototype[name] = function noted(...given) {
        (this.canvas.drawn ??= []).push(told(this, given));
        return real.apply(this, given);
      };
    };
    note("scale", () => "begun");
    note("stroke", () => "line");
    note("fill", () => "shape");
    note("strokeText", (c, [text]) => `${c.strokeStyle} around ${text}`);
    note("fillText", (_, [text]) => `text ${text}`);
  } });
  await page.click(".touch");
  const [ground, drawn] = await page.evaluate(() => {
    const [, near] = document.querySelectorAll(".two canvas");
    const c = document.createElement("canvas").getContext("2d");
    c.strokeStyle = getComputedStyle(document.body).backgroundColor;
    return [c.strokeStyle, near.drawn.slice(near.drawn.lastIndexOf("begun") + 1)];
  });
  const texts = drawn.filter((one) => one.startsWith("text ")).map((one) => one.slice(5));
  assert.equal(texts[0], "P");
  assert.ok(texts.length === 5, String(texts));
  for (const text of texts) assert.equal(drawn[drawn.indexOf(`text ${text}`) - 1], `${ground} around ${text}`);
  // After them comes the bar of the length alone, which is short and in a corner.
  assert.deepEqual(drawn.slice(drawn.indexOf("text P")).filter((one) => ["line", "shape"].includes(one)), ["line"]);
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

test("in a window of 400 pixels the numbers of a point are in one piece each, and so are the words beside them", async () => {
  const page = await point({ width: 400, motion: "reduce" });
  const broken = await page.$$eval("table.values", (tables) => tables.flatMap((table) => {
    const found = [];
    for (const texts = document.createTreeWalker(table, NodeFilter.SHOW_TEXT); texts.nextNode();) {
      for (const word of texts.currentNode.data.matchAll(/\S+/g)) {
        const range = document.createRange();
        range.setStart(texts.currentNode, word.index);
        range.setEnd(texts.currentNode, word.index + word[0].length);
        // Words of two may be broken at their hyphen.
        if (!/[a-z]-[a-z]/.test(word[0]) && new Set([...range.getClientRects()].map((one) => one.top)).size > 1) found.push(word[0]);
      }
    }
    return found;
  }));
  assert.deepEqual(broken, []);
  assert.ok(await page.$$eval(".scroll:has(table.values)", (all) => all.every((one) => one.scrollWidth <= one.clientWidth)));
  await page.close();
});

test("all plots of a point are saved as one PNG", async () => {
  const page = await point({ motion: "reduce", early: () => {
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => {
      createImageBitmap(blob).then(({ height }) => { window.height_px = height; });
      return make.call(URL, blob);
    };
  } });
  await page.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent === "Plots as PNG").click());
  const [height, sum] = await until(page, () => window.height_px && [window.height_px, [...document.querySelectorAll(".uplot canvas, .loop canvas")].reduce((all, one) => all + one.height, 0)]);
  assert.ok(height > sum, `${height} ${sum}`);
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
  const page = await point({ motion: "reduce", early: frames_by_hand });
  const released = await time(page);
  await go_on(page, 1);
  assert.equal(await time(page), released);
  await page.click(".play");
  await go_on(page, 1);
  assert.notEqual(await time(page), released);
  await page.close();
});

test("a trace that was refused is asked for again, and people are told why it does not come", async () => {
  const page = await browser.open("#/study/1/point/7", { motion: "reduce", is_hurried: true, early: () => {
    const real = window.fetch;
    let refused = 0;
    window.told = [];
    window.fetch = async (path, how) => {
      if (/\/trace\?/.test(path)) window.told.push(document.querySelector("[aria-label='The contact over time'] .said").textContent);
      if (/\/trace\?/.test(path) && ++refused <= 2) return new Response(JSON.stringify({ error: "too many wait" }), { status: refused === 1 ? 409 : 503 });
      return real(path, how);
    };
  } });
  await until(page, () => document.querySelectorAll(".uplot").length === 4);
  assert.deepEqual(await page.evaluate(() => window.told.slice(1, 3)), Array(2).fill("No time histories yet: too many wait. They are asked for again."));
  await page.close();
});

test("a point that is solved while somebody looks at it says so", async () => {
  const id = await submit("solved later", { H: [0.2, 1.1, 200], mu: [0.1, 2, 200], e: [0.5, 1, 50] });
  const page = await browser.open(`#/study/${id}/point/0`, { motion: "reduce", early: () => {
    const real = window.fetch;
    window.fetch = async (path, how) => {
      const answer = await real(path, how);
      return /\/rows\?.*where=point/.test(path) && !window.is_solved ? new Response(JSON.stringify({ ...await answer.json(), rows: [] })) : answer;
    };
  } });
  await until(page, () => document.querySelector("main").textContent.includes("This point is not solved yet."));
  await page.evaluate(() => { window.is_solved = true; });
  await until(page, () => document.querySelector(".figures")?.textContent.includes("F_n peak"));
  assert.ok(!(await text_of(page, "main")).includes("not solved yet"));
  await page.close();
  await change(id, "cancel");
});
