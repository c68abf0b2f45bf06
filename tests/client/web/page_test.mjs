// The page in a real browser. OBLIQUE_BIN: the folder of programs; OBLIQUE_NODE_MODULES; OBLIQUE_CHROMIUM;
// OBLIQUE_SCREENSHOTS: where pictures of all views are left, if anywhere.
import assert from "node:assert/strict";
import { readFileSync, readdirSync, mkdirSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { Browser, Server, text_of, until } from "./browser.mjs";

const server = new Server(join(process.env.OBLIQUE_BIN, "oblique"));
const browser = new Browser();
const kMap = ".map canvas[tabindex]";

before(async () => {
  server.run("--name", "friction", "--H", "0.5:1.1:7", "--mu", "0.1:2:12", "--e", "0.6,0.8,1");
  await server.start();
  await browser.start(server);
});
after(async () => {
  await browser.stop();
  await server.stop();
});

/** A tab that shows the picture of the study. */
async function study(view = "#/study/1", how = {}) {
  const page = await browser.open(view, how);
  await until(page, () => document.querySelector(".facts")?.textContent.includes("solved"));
  await until(page, () => document.querySelectorAll(".rows tbody tr").length > 0);
  return page;
}

/** A tab whose point has been solved again. */
async function point(how = {}) {
  const page = await browser.open("#/study/1/point/100", how);
  await until(page, () => document.querySelectorAll(".uplot").length === 4);
  return page;
}

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
  await until(page, () => location.hash.startsWith("#/study/2"));
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

test("a form that is wrong says what is allowed, and a server that refuses is heard", async () => {
  const page = await browser.open("#/new");
  await page.waitForSelector("form");
  const fields = await page.$$("form input");
  await fields[2].click({ clickCount: 3 });
  await fields[2].type("0.1:2");
  assert.match(await text_of(page, "form [role=status]"), /FROM:TO:COUNT/);
  await fields[2].click({ clickCount: 3 });
  await fields[2].type("-1");
  await page.type("form input", "wrong");
  await page.click("form button");
  await until(page, () => document.querySelector("form [role=alert]").textContent.includes("mu"));
  browser.objections = browser.objections.filter((one) => !one.includes("status of 4"));  // that answer is wanted here
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

test("a map shows its cells; pointing at one tells its value, a click chooses it, two open its point", async () => {
  const page = await study();
  assert.match(await text_of(page, ".facts"), /12 × 7 cells, 84 solved/);
  const colours = await page.$eval(".map canvas", (canvas) => new Set(new Uint32Array(
    canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size);
  assert.ok(colours > 20, `${colours} colours`);
  const box = await (await page.$(kMap)).boundingBox();
  // The first cell lies at the foot on the left.
  await page.mouse.move(box.x + 75, box.y + box.height - 60);
  await until(page, () => /mu 0.1, H 0.5 m: fn_peak_N [\d.]+ N/.test(document.querySelector(".reading").textContent));
  const told = Number((await text_of(page, ".reading")).match(/fn_peak_N ([\d.]+)/)[1]);
  const stored = await page.evaluate(async () => (await (await fetch("/api/studies/1/points/0")).json()).row.fn_peak_N);
  assert.ok(Math.abs(told / stored - 1) < 1e-4, `${told} ${stored}`);
  await page.mouse.click(box.x + 75, box.y + box.height - 60);
  assert.equal(await text_of(page, ".choice a"), "Open point 0");
  assert.equal(await page.$eval("tr.chosen", (row) => row.dataset.point), "0");
  await page.mouse.click(box.x + 75, box.y + box.height - 60, { clickCount: 2 });
  await until(page, () => location.hash === "#/study/1/point/0");
  await page.goBack();
  await until(page, () => document.querySelector(".choice a")?.textContent === "Open point 0");
  await page.close();
});

test("a map is moved over by keys, and its values are spoken", async () => {
  const page = await study();
  await page.focus(kMap);
  await page.keyboard.press("ArrowRight");
  assert.match(await text_of(page, ".reading[aria-live=polite]"), /mu 0.1, H 0.5 m/);
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowUp");
  assert.match(await text_of(page, ".reading[aria-live=polite]"), /mu 0.27273, H 0.6 m/);
  await page.keyboard.press("Enter");
  await until(page, () => /point\/\d+$/.test(location.hash));
  await page.close();
});

test("every view is a link, and tells the command that makes it", async () => {
  const page = await study("#/study/1?pic=map&z=mode&x=mu&y=H&at=e@2");
  assert.match(await text_of(page, ".categories"), /mode: \d+ here/);
  assert.match(await text_of(page, ".commands code"), /^oblique plot friction --map mode --x mu --y H --at e=1 --out/);
  await page.$eval("input[type=range]", (slider) => {
    slider.value = "0";
    slider.dispatchEvent(new Event("input"));
  });
  await until(page, () => document.querySelector(".facts").textContent.includes("e = 0.6"));
  const address = await page.evaluate(() => location.hash);
  const other = await study(address);
  assert.equal(await text_of(other, ".facts"), await text_of(page, ".facts"));
  await other.close();
  await page.close();
});

test("maps are zoomed by dragging and by keys, and lines, gathered points and histograms are drawn", async () => {
  const page = await study();
  const box = await (await page.$(kMap)).boundingBox();
  await page.mouse.move(box.x + 100, box.y + 40);
  await page.mouse.down();
  await page.mouse.move(box.x + 260, box.y + 160, { steps: 3 });
  await page.mouse.up();
  await until(page, () => !document.querySelector(".facts").textContent.includes("12 × 7"));
  await page.focus(kMap);
  await page.keyboard.press("0");
  await until(page, () => document.querySelector(".facts").textContent.includes("12 × 7"));
  for (const kind of ["lines", "gathered", "histogram"]) {
    await page.select(".controls select", kind);
    await until(page, (pic) => location.hash.includes(`pic=${pic}`) && (pic === "gathered"
      ? !document.querySelector(".map").hidden : document.querySelector(".uplot canvas")), kind);
    assert.equal(await text_of(page, "p.said"), "");
  }
  await page.close();
});

test("what lies between the cells of a map is solved while one looks, and is kept as a study", async () => {
  const page = await study();
  await page.click(".finer");
  await until(page, () => document.querySelector(".facts").textContent.match(/(\d+) × \1 cells, [1-9]/));
  await until(page, () => document.querySelector(".facts").textContent.includes("129 × 129"));
  await page.type('[aria-label^="Name under which"]', "kept");
  await page.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent === "Keep it as a study").click());
  await until(page, () => document.querySelector("p.said a")?.textContent === "kept");
  await page.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent === "Back to the study").click());
  await until(page, () => document.querySelector(".facts").textContent.includes("12 × 7"));
  await page.close();
});

test("rows are filtered as with --where, a page at a time, and nothing is truncated unsaid", async () => {
  const page = await study();
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "1 to 25 of 252 rows.");
  await page.click(".rows button:not([disabled]):not(.plain)");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "26 to 50 of 252 rows.");
  await page.type(".rows input", "mu > 1 AND e = 1");
  await page.keyboard.press("Enter");
  await until(page, () => /of 42 rows/.test(document.querySelector(".rows p[role=status]").textContent));
  const csv = await page.evaluate(async () => (await fetch(document.querySelector(".rows a[download]").href)).text());
  assert.equal(csv.trim().split("\r\n").length, 43);
  await page.$eval(".rows input", (field) => { field.value = "muu > 1"; });
  await page.focus(".rows input");
  await page.keyboard.press("Enter");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent.includes("did you mean `mu`?"));
  browser.objections = browser.objections.filter((one) => !one.includes("status of 400"));
  await page.close();
});

test("the numbers of a picture are saved as a file", async () => {
  const page = await study();
  const session = await page.createCDPSession();
  await session.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: server.folder });
  await page.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent.includes("numbers as CSV")).click());
  const file = join(server.folder, "picture.csv");
  for (let i = 0; i < 100 && !readdirSync(server.folder).includes("picture.csv"); ++i) await new Promise((go_on) => setTimeout(go_on, 50));
  const lines = readFileSync(file, "utf8").trim().split("\r\n");
  assert.equal(lines[0], "mu,H,fn_peak_N,point");
  assert.equal(lines.length, 85);
  await page.close();
});

test("a point shows its contact over time, its numbers and where they come from, and the finger moves", async () => {
  const page = await point();
  await until(page, () => document.querySelector(".player output").textContent !== "0.0 µs");  // it plays
  const playing = await page.$eval(".player output", (one) => parseFloat(one.textContent));
  await until(page, (then) => parseFloat(document.querySelector(".player output").textContent) > then, playing);
  const pixels = () => page.$eval(".two canvas", (canvas) => canvas.toDataURL());
  await page.click(".play");
  const before = await pixels();
  await page.$eval(".scrub input", (slider) => {
    slider.value = "900";
    slider.dispatchEvent(new Event("input"));
  });
  assert.notEqual(await pixels(), before);
  const names = await page.$$eval("table.values th[scope=row]", (all) => all.map((one) => one.textContent));
  for (const name of ["fn_peak_N", "duration_s", "closure", "solver_version", "worker_name", "k"]) assert.ok(names.includes(name), name);
  await page.focus(".plot[role=application]");
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowRight");
  assert.match(await text_of(page, "figure .reading:not(:empty)"), /µs: F_n [\d.]+ N, F_t/);
  await page.close();
});

test("who wants little motion sees the finger move only when asked", async () => {
  const page = await point({ motion: "reduce" });
  await new Promise((go_on) => setTimeout(go_on, 300));
  assert.equal(await text_of(page, ".player output"), "0.0 µs");
  await page.click(".play");
  await until(page, () => document.querySelector(".player output").textContent !== "0.0 µs");
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

test("axe-core finds nothing wrong with any view, light or dark, and nothing is wider than a window of 400 or 1280 pixels", async () => {
  const views = { overview: ["#/", "table"], map: ["#/study/1", ".rows tbody tr"], modes: ["#/study/1?pic=map&z=mode&at=e@2", ".categories li"],
    lines: ["#/study/1?pic=lines&y=e", ".uplot"], gathered: ["#/study/1?pic=gathered&x=mu&y=fn_peak_N", ".bar"],
    histogram: ["#/study/1?pic=histogram&x=duration_s", ".uplot"], point: ["#/study/1/point/100", ".uplot"], start: ["#/new", "form"] };
  const folder = process.env.OBLIQUE_SCREENSHOTS;
  if (folder) mkdirSync(folder, { recursive: true });
  const faults = [];
  for (const [name, [view, there]] of Object.entries(views)) {
    for (const [width, scheme] of [[1280, "light"], [400, "dark"], ...(folder ? [[400, "light"], [1280, "dark"]] : [])]) {
      const page = await browser.open(view, { width, scheme, motion: "reduce" });
      await page.waitForSelector(there);
      if (there !== "form" && there !== "table") await until(page, () => !document.querySelector("p.said")?.textContent);
      faults.push(...(await browser.faults(page)).map((one) => `${name} ${width} ${scheme}: ${one}`));
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      if (wide > width) faults.push(`${name} is ${wide} pixels wide in ${width}`);
      if (folder) await page.screenshot({ path: join(folder, `${name}-${width}-${scheme}.png`), fullPage: true });
      await page.close();
    }
  }
  assert.deepEqual(faults, []);
});

test("nothing was objected to: no error, no report of the content policy, no request to another host", () => {
  assert.deepEqual(browser.objections, []);
});
