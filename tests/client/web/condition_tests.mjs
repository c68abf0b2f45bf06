// Conditions of the query language: what is shown, and what is marked.
import assert from "node:assert/strict";
import { test } from "node:test";
import { drag, kMany, kMap, kScattered, kWhere, study, text_of, until, write } from "./here.mjs";

const kMark = ".marks input";
const field = (page, name) => page.evaluate((wanted) => new URLSearchParams(location.hash.split("?")[1]).get(wanted), name);
const rows = (page, query) => page.evaluate(async (asked) => (await (await fetch(`/api/studies/${asked.id}/rows?${new URLSearchParams(asked.of)}`)).json()).rows, query);

test("cells of a map that do not meet a condition are greyed and counted, and the condition is in address and commands", async () => {
  const page = await study("#/study/1?at=e@2");
  const colours = () => page.$eval(".map canvas", (canvas) => canvas.toDataURL());
  const before = await colours();
  await write(page, kWhere, "mu > 1 AND e = 1");
  await until(page, () => document.querySelector(".gaps").textContent.includes("42 cells where the condition is not met"));
  await until(page, () => document.querySelector("#said-where").textContent === "42 points that have a result meet it.");
  assert.notEqual(await colours(), before);
  await until(page, () => new URLSearchParams(location.hash.split("?")[1]).get("where") === "mu > 1 AND e = 1");
  assert.match(await text_of(page, ".commands code"), /--where 'mu > 1 AND e = 1'/);
  await until(page, () => /of 42 rows/.test(document.querySelector(".rows p[role=status]").textContent));
  // All of it is greyed, and then nothing.
  await write(page, kWhere, "mu > 100");
  await until(page, () => document.querySelector(".gaps").textContent.includes("84 cells where the condition is not met"));
  await write(page, kWhere, "");
  await until(page, () => document.querySelector(".gaps").textContent === "");
  await page.close();
});

test("Back undoes a condition, what is marked, and what was kept of it", async () => {
  const page = await study("#/study/1?at=e@2");
  const stands = (where, mark) => until(page, (wanted) => JSON.stringify([...document.querySelectorAll(".conditions input")].map((one) => one.value)) === wanted, JSON.stringify([where, mark]));
  await write(page, kWhere, "mu > 1");
  await until(page, () => document.querySelector(".gaps").textContent.includes("42 cells"));
  await page.focus(kMap);
  await page.keyboard.down("Shift");
  for (let i = 0; i < 3; ++i) await page.keyboard.press("ArrowRight");
  await page.keyboard.up("Shift");
  const marked = await until(page, () => document.querySelector(".marks input").value);
  await page.evaluate(() => [...document.querySelectorAll(".marks button")].find((one) => one.textContent === "Keep only these").click());
  await stands(`mu > 1 AND ${marked}`, "");
  await page.goBack();
  await stands("mu > 1", marked);
  await until(page, () => document.querySelector("[data-marks]")?.dataset.marks);
  await page.goBack();  // the keys of one rectangle are one step
  await stands("mu > 1", "");
  await page.goBack();
  await stands("", "");
  await until(page, () => document.querySelector(".gaps").textContent === "");
  await page.close();
});

test("what the language objects to stands beside its field", async () => {
  const page = await study("#/study/1", { expected: /status of 400/ });
  await write(page, kWhere, "muu > 1");
  await until(page, () => document.querySelector("#said-where").textContent.includes("did you mean `mu`?"));
  assert.equal(await page.$eval(kWhere, (one) => one.getAttribute("aria-invalid")), "true");
  await write(page, kWhere, "");
  await until(page, () => document.querySelectorAll(".rows tbody tr").length > 0);
  await write(page, kMark, "mu >");
  await until(page, () => document.querySelector("#said-mark.bad")?.textContent);
  assert.equal(await text_of(page, "p.said:not([id])"), "");
  await page.close();
});

test("a rectangle over a map marks its points in the table and in other pictures, as a condition that can be kept", async () => {
  const page = await study("#/study/1?at=e@2&drag=mark");
  const before = await page.$eval(".map canvas", (canvas) => canvas.toDataURL());
  await drag(page, [0.3, 0.3], [0.6, 0.9]);
  const condition = await until(page, () => document.querySelector(".marks input").value);
  assert.match(condition, /^mu >= [\d.]+ AND mu <= [\d.]+ AND H >= [\d.]+ AND H <= [\d.]+ AND e = 1$/);
  await until(page, () => /^\d+ points are marked/.test(document.querySelector("#said-mark").textContent));
  const marked = Number((await text_of(page, "#said-mark")).split(" ")[0]);
  await until(page, (wanted) => document.querySelector("[data-marks]")?.dataset.marks === wanted, condition);
  assert.notEqual(await page.$eval(".map canvas", (canvas) => canvas.toDataURL()), before);
  // The table has these points, and only these.
  await until(page, (n) => document.querySelector(".rows p[role=status]").textContent.includes(`of ${n} rows`), marked);
  const told = await rows(page, { id: 1, of: { select: "count(*)", where: condition, limit: 1 } });
  assert.equal(told[0][0], marked);
  assert.equal(await page.$$eval(".rows tr.marked", (all) => all.length), Math.min(marked, 25));
  await page.click(".only input");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent.includes("of 252 rows"));
  // Another picture of the same points.
  await page.select(".controls select", "histogram");
  await until(page, () => [...document.querySelectorAll(".lines .legend li")].some((one) => one.textContent === "marked"));
  await page.evaluate(() => [...document.querySelectorAll(".marks button")].find((one) => one.textContent === "Keep only these").click());
  await until(page, () => document.querySelector(".marks input").value === "");
  // Addresses are written a few times a second.
  await until(page, (wanted) => new URLSearchParams(location.hash.split("?")[1]).get("where") === wanted, condition);
  assert.equal(await field(page, "mark"), null);
  await page.close();
});

test("points are marked by keys, and Escape marks none", async () => {
  const page = await study("#/study/1?at=e@2", { early: () => {
    const Real = window.ResizeObserver;
    window.ResizeObserver = class extends Real {
      constructor(call) {
        super((...given) => { if (!window.has_no_room) call(...given); });
      }
    };
  } });
  await page.focus(kMap);
  await page.keyboard.press("ArrowRight");
  await page.keyboard.down("Shift");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowUp");
  await page.keyboard.up("Shift");
  await until(page, () => document.querySelector("#said-mark").textContent === "4 points are marked.");
  await page.keyboard.press("Escape");
  await until(page, () => document.querySelector(".marks input").value === "" && document.querySelector("#said-mark").textContent === "");
  // A span of a histogram.
  await page.goto(`${new URL(page.url()).origin}/#/study/1?pic=histogram&x=mu&drag=mark`);
  await until(page, () => document.querySelector(".uplot canvas"));
  await page.focus(".plot[role=application]");
  await page.keyboard.press("Home");
  // A plot that is made anew takes keys before it is drawn.
  await page.evaluate(() => { window.has_no_room = true; });
  const spans = [];
  for (let i = 0; i < 3; ++i) {
    await page.keyboard.down("Shift");
    await page.keyboard.press("ArrowRight");
    await page.keyboard.up("Shift");
    const condition = await until(page, (before) => {
      const { value } = document.querySelector(".marks input");
      return value !== before && document.querySelector("[data-marks]")?.dataset.marks === value && value;
    }, spans.at(-1)?.condition ?? "");
    const [, from, to] = condition.match(/^mu >= ([\d.]+) AND mu <= ([\d.]+)$/);
    spans.push({ condition, from: Number(from), to: Number(to) });
  }
  assert.ok(spans.every((one, i) => i === 0 || (one.from === spans[0].from && one.to > spans[i - 1].to)), JSON.stringify(spans));
  assert.ok(await page.evaluate(() => document.activeElement.matches(".plot[role=application]")));
  await page.close();
});

test("lines show what is marked elsewhere, and a rectangle over them marks what is seen in it", async () => {
  const page = await study(`#/study/1?pic=lines&x=mu&y=H&at=e@2&mark=${encodeURIComponent("fn_peak_N > 4000")}`);
  await until(page, () => document.querySelector("main > div").dataset.marks === "fn_peak_N > 4000" && document.querySelector(".uplot canvas"));
  await page.focus(".plot[role=application]");
  await page.keyboard.press("Home");
  const said = await until(page, () => document.querySelector(".lines .reading").textContent);
  for (const [, value, is_marked] of said.matchAll(/ ([\d.]+) N( \(marked\))?/g)) assert.equal(is_marked !== undefined, Number(value) > 4000, said);
  const box = await (await page.$(".u-over")).boundingBox();
  const sweep = async ([x0, y0], [x1, y1]) => {
    await page.mouse.move(box.x + x0 * box.width, box.y + y0 * box.height);
    await page.mouse.down();
    await page.mouse.move(box.x + x1 * box.width, box.y + y1 * box.height, { steps: 3 });
    await page.mouse.up();
  };
  await page.keyboard.down("Shift");
  await sweep([0.3, 0.05], [0.7, 0.5]);
  await page.keyboard.up("Shift");
  const condition = await until(page, () => (document.querySelector(".marks input").value.startsWith("mu") ? document.querySelector(".marks input").value : ""));
  assert.match(condition, /^mu >= [\d.]+ AND mu <= [\d.]+ AND fn_peak_N >= [\d.]+ AND fn_peak_N <= [\d.]+ AND e = 1$/);
  await page.focus(".plot[role=application]");
  await page.keyboard.press("Escape");
  await until(page, () => document.querySelector(".marks input").value === "");
  // Without Shift it zooms, unless people choose otherwise.
  await page.evaluate(() => { const drags = [...document.querySelectorAll(".controls select")].at(-1); drags.value = "mark"; drags.dispatchEvent(new Event("change")); });
  await until(page, () => location.hash.includes("drag=mark"));
  await sweep([0.01, 0.2], [0.99, 0.21]);
  assert.match(await until(page, () => document.querySelector(".marks input").value), /^(mu .* AND )?e = 1$/);
  await page.close();
});

test("few points are drawn one by one, and chosen by pointing at them; many are gathered, and it is said", async () => {
  const page = await study(`#/study/${kScattered}?pic=gathered&x=mu&y=fn_peak_N&z=H`);
  assert.match(await text_of(page, ".facts"), /^300 points, each drawn/);
  const first = (await rows(page, { id: kScattered, of: { select: "point,mu,fn_peak_N", order: "fn_peak_N", limit: 1 } }))[0];
  const ends = await rows(page, { id: kScattered, of: { select: "min(mu),max(mu)", limit: 1 } });
  const box = await (await page.$(kMap)).boundingBox();
  await page.mouse.click(box.x + 64 + ((first[1] - ends[0][0]) / (ends[0][1] - ends[0][0])) * (box.width - 78), box.y + box.height - 47);
  await until(page, (n) => document.querySelector(".choice a")?.textContent.replace(/\D/g, "") === String(n), first[0]);
  await page.keyboard.down("Shift");
  await drag(page, [0.2, 0.2], [0.7, 0.8]);
  await page.keyboard.up("Shift");
  const condition = await until(page, () => document.querySelector(".marks input").value);
  assert.match(condition, /^mu >= [\d.]+ AND mu <= [\d.]+ AND fn_peak_N >= \d+ AND fn_peak_N <= \d+$/);
  await until(page, () => Number(document.querySelector("#said-mark").textContent.split(" ")[0]) > 20);
  await page.close();
  const many = await study(`#/study/${kMany}?pic=gathered&x=mu&y=fn_peak_N&z=H`);
  assert.match((await text_of(many, ".facts")).replaceAll("\u202f", ""), /^20100 points in \d+ bins.*Up to 20000 points are drawn one by one, more are gathered/);
  await write(many, kWhere, "mu < 0.5");
  await until(many, () => document.querySelector(".facts").textContent.includes("each drawn"));
  await many.close();
  // Of a part that is zoomed into only its own points are asked for.
  const part = await study(`#/study/${kScattered}?pic=gathered&x=mu&y=H&x0=0.5&x1=1&mark=e+%3E+0.5`);
  await until(part, () => document.querySelector("[data-marks]"));
  assert.equal(await part.evaluate(() => performance.getEntriesByType("resource").map((one) => new URL(one.name).searchParams)
    .find((asked) => asked.get("select") === "point").get("where")), "e > 0.5 AND mu >= 0.5 AND mu <= 1");
  await part.close();
});
