// The filter and the selection of the page, which are conditions of the query language.
import assert from "node:assert/strict";
import { test } from "node:test";
import * as web from "./setup.mjs";

const imageOf = (page) => page.$eval(".map canvas", (canvas) => canvas.toDataURL());
const valueOf = (page, selector) =>
  web.until(page, (of) => document.querySelector(of).value, selector);
const hasSelected = (page, condition) =>
  web.until(
    page,
    (wanted) => document.querySelector("main > div").dataset.selected === wanted,
    condition,
  );

test("cells outside the filter are grey and counted, and table, address and commands contain the filter", async () => {
  const page = await web.study("#/study/1?at=e@2");
  const before = await imageOf(page);
  await web.write(page, web.whereField, "mu > 1 AND e = 1");
  await web.shows(page, ".gaps", /42 cells filtered out/);
  await web.showsRowCount(page, /of 42 rows/);
  assert.notEqual(await imageOf(page), before);
  assert.equal(await web.fieldOf(page, "where"), "mu > 1 AND e = 1");
  assert.match(await web.textOf(page, ".commands code"), /--where 'mu > 1 AND e = 1'/);
  await web.write(page, web.whereField, "");
  await web.shows(page, ".gaps", /^$/);
  await page.close();
});

test("errors in a condition appear beside its field", async () => {
  const page = await web.study("#/study/1", { expected: /status of 400/ });
  await web.write(page, web.whereField, "muu > 1");
  await web.shows(page, "#said-where", /did you mean `mu`\?/);
  assert.equal(await page.$eval(web.whereField, (one) => one.getAttribute("aria-invalid")), "true");
  await web.write(page, web.whereField, "");
  await web.showsRowCount(page, /of 252 rows/);
  await web.write(page, web.markField, "mu >");
  await web.shows(page, "#said-mark", /./);
  assert.equal(await web.textOf(page, "p.said:not([id])"), "");
  await page.close();
});

test("a rectangle over a map selects its points in the table and in other pictures; the selection can become the filter; Back undoes both", async () => {
  const page = await web.study("#/study/1?at=e@2&drag=select");
  const before = await imageOf(page);
  await web.drag(page, web.mapCanvas, [0.3, 0.3], [0.6, 0.9]);
  const condition = await valueOf(page, web.markField);
  assert.match(
    condition,
    /^mu >= [\d.]+ AND mu <= [\d.]+ AND H >= [\d.]+ AND H <= [\d.]+ AND e BETWEEN 0\.9{12} AND 1\.0{11}1$/,
  );
  await hasSelected(page, condition);
  assert.notEqual(await imageOf(page), before);
  const [[selected]] = await web.rowsOf(page, 1, { select: "count(*)", where: condition });
  await web.showsRowCount(page, new RegExp(`of ${selected} rows`));
  await page.select(".controls select", "histogram");
  await web.shows(page, ".lines .legend", /selected/);
  await web.press(page, "Use selection as filter");
  await web.until(page, () => document.querySelector(".marks input").value === "");
  assert.equal(await web.fieldOf(page, "where"), condition);
  await page.goBack();
  assert.equal(await valueOf(page, web.markField), condition);
  assert.equal(await page.$eval(web.whereField, (one) => one.value), "");
  await web.press(page, "Clear");
  await web.showsRowCount(page, /of 252 rows/);
  await page.close();
});

test("Escape clears the selection, and Shift makes dragging select instead of zoom, on a map, lines and bars", async () => {
  const range = String.raw`[\d.]+ AND \w+ <= [\d.]+`;
  const heldE = "e BETWEEN 0.9{12} AND 1.0{11}1";
  const conditions = {
    "1?at=e@2": `mu >= ${range} AND H >= ${range} AND ${heldE}`,
    "1?pic=lines&x=mu&y=H&at=e@2": `mu >= ${range} AND fn_peak_N >= ${range} AND ${heldE}`,
    "1?pic=histogram&x=mu": `mu >= ${range}`,
    "2?x=mu&y=H&z=": `mu >= ${range} AND H >= ${range}`,
  };
  for (const [view, pattern] of web.casesOf(Object.entries(conditions), 2)) {
    const selector = web.pictureIn(view);
    const page = await web.study(`#/study/${view}`);
    await page.keyboard.down("Shift");
    await web.drag(page, selector, [0.2, 0.2], [0.7, 0.8]);
    await page.keyboard.up("Shift");
    const condition = await valueOf(page, web.markField);
    assert.match(condition, new RegExp(`^${pattern}$`), view);
    await hasSelected(page, condition);
    await page.focus(selector === web.mapCanvas ? selector : ".plot[role=application]");
    await page.keyboard.press("Escape");
    await web.until(page, () => document.querySelector(".marks input").value === "");
    await page.close();
  }
});

test("lines show a selection made in another picture, and keys read their values", async () => {
  const page = await web.study("#/study/1?pic=lines&x=mu&y=H&at=e@2&mark=fn_peak_N>4000");
  await hasSelected(page, "fn_peak_N>4000");
  await page.focus(".plot[role=application]");
  await page.keyboard.press("Home");
  await web.shows(page, ".lines .reading", /^mu 0\.1 : H = 0\.5 m 3007\.7 N/);
  const said = await web.textOf(page, ".lines .reading");
  const selected = [...said.matchAll(/\(selected\) ([\d.–]+) N/g)].map(([, value]) => value);
  assert.equal(selected.length, 7);
  assert.ok(
    selected.every((value) => value === "–" || Number(value) > 4000),
    said,
  );
  await page.close();
});

test(
  "few points are drawn one by one and can be clicked; many are grouped in bins, and the page says so",
  web.inFull,
  async () => {
    const page = await web.study(`#/study/${web.studies.scattered}?x=mu&y=fn_peak_N&z=H`);
    await web.facts(page, /^300 points, drawn one by one/);
    const id = web.studies.scattered;
    const [[lowest, mu]] = await web.rowsOf(page, id, {
      select: "point,mu",
      order: "fn_peak_N",
      limit: 1,
    });
    const [[least, most]] = await web.rowsOf(page, id, { select: "min(mu),max(mu)" });
    const box = await (await page.$(web.mapCanvas)).boundingBox();
    const x = box.x + 64 + ((mu - least) / (most - least)) * (box.width - 78);
    await page.mouse.click(x, box.y + box.height - 47);
    await web.shows(page, ".choice a", new RegExp(`Open point ${lowest}$`));
    await page.close();
    const many = await web.study(`#/study/${web.studies.many}?x=mu&y=fn_peak_N&z=H`);
    await web.facts(
      many,
      /^20\u202f100 points in [\d\u202f]+ bins\. More than 20\u202f000 points are grouped in bins/,
    );
    await web.write(many, web.whereField, "mu < 0.5");
    await web.facts(many, /drawn one by one/);
    await many.close();
  },
);
