// What a study lacks is solved while somebody looks: axes that it does not vary, one value of an axis, what is zoomed into.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, kMap, kOne, study, text_of, until, write } from "../here.mjs";

const facts = (page, text) => until(page, (wanted) => document.querySelector(".facts")?.textContent.includes(wanted), text);

/** The picture that is solved is there, with all its cells. */
const solved = (page) => page.waitForSelector('[data-side]:not([data-side="0"])');

/** Chooses in the picker that is called so. */
const pick = (page, name, value) => page.evaluate((called, chosen) => {
  const select = [...document.querySelectorAll(".controls label")].find((one) => one.textContent.startsWith(called)).querySelector("select");
  select.value = chosen;
  select.dispatchEvent(new Event("change"));
}, name, value);

/** What was asked to be solved, since. */
function asked_of(page) {
  const recipes = [];
  page.on("request", (one) => { if (one.url().endsWith("/api/look")) recipes.push(JSON.parse(one.postData()).recipe); });
  return recipes;
}

const axis_of = (recipe, key) => recipe.blocks[0].axes.find((one) => one.key === key);

/** Presses the button that is called so. */
const press = (page, text) => page.evaluate((wanted) => [...document.querySelectorAll("button")].find((one) => one.textContent === wanted).click(), text);

/** A browser reports answers that are meant to be refusals. */
const gone = (status) => { browser.objections = browser.objections.filter((one) => !one.includes(`status of ${status}`)); };

/** Of a map of 129 a side cells are missing, whatever was solved. */
function never_finest() {
  const real = window.fetch;
  window.asked = [];
  window.fetch = async (path, how) => {
    window.asked.push(String(path));
    const answer = await real(path, how);
    if (!/\/slice\?.*nx=129/.test(path) || answer.status !== 200) return answer;
    const bytes = new Uint8Array(await answer.arrayBuffer());
    const begin = 4 + new DataView(bytes.buffer).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, begin)));
    const told = JSON.stringify({ ...head, missing: (129 * 129 - 1) / 4 });
    const size = Math.ceil((told.length + 4) / 8) * 8 - 4;  // numbers lie at multiples of their size
    const changed = new Uint8Array(4 + size + bytes.length - begin);
    new DataView(changed.buffer).setUint32(0, size, true);
    changed.set(new TextEncoder().encode(told.padEnd(size)), 4);
    changed.set(bytes.subarray(begin), 4 + size);
    return new Response(changed);
  };
}

test("an axis that a study lacks is solved at once around its value, and its ends are said in fields, in the address and in the command", async () => {
  const page = await study("#/study/1?at=e@1");
  const recipes = asked_of(page);
  await pick(page, "across", "k");
  await facts(page, "33 × 33");
  const { model } = recipes[0];
  const k = axis_of(recipes[0], "k");
  assert.ok(k.from < model.k_N_m && model.k_N_m < k.to, JSON.stringify(k));
  assert.deepEqual([axis_of(recipes[0], "H").from, axis_of(recipes[0], "H").to], [0.5, 1.1]);
  assert.deepEqual([axis_of(recipes[0], "mu").values, axis_of(recipes[0], "e").values], [[0.1], [0.8]]);
  await until(page, () => decodeURIComponent(location.hash).includes("between=k:13500000:40500000,H:0.5:1.1"));
  await write(page, '[aria-label="k to"]', "3e7");
  await until(page, () => decodeURIComponent(location.hash).includes("k:13500000:30000000"));
  await until(page, () => [...document.querySelectorAll(".commands code")].some((one) => /^oblique run .*--k 13500000:30000000:\d+ --H 0.5:1.1/.test(one.textContent)));
  // A reload and a link find it.
  const other = await study(await page.evaluate(() => location.hash));
  await until(other, () => document.querySelector(".map canvas[tabindex]").getAttribute("aria-label").includes("k"));
  assert.equal(await other.$eval('[aria-label="k to"]', (one) => one.value), "30000000");
  await other.close();
  await page.goBack();
  await until(page, () => document.querySelector('[aria-label="k to"]').value === "40500000");
  await page.goBack();
  await facts(page, "12 × 7");
  assert.equal(await page.$('[aria-label="k to"]').then((one) => one.isVisible()), false);
  await page.close();
});

test("ends that are no range, or that the server refuses, are told of beside the fields, and what was solved stays", async () => {
  const page = await study("#/study/1?x=rho&y=mu");
  await solved(page);
  const told = () => text_of(page, ".ends + p");
  await write(page, '[aria-label="rho from"]', "9000");
  await until(page, () => document.querySelector(".ends + p").textContent === "rho must go from a number to a greater one.");
  assert.equal(await page.$eval('[aria-label="rho from"]', (one) => one.getAttribute("aria-invalid")), "true");
  await write(page, '[aria-label="rho from"]', "-5");
  await until(page, () => document.querySelector(".ends + p").textContent.includes("rho must be > 0"));
  await until(page, () => decodeURIComponent(location.hash).includes("rho:1350:4050"));
  await solved(page);
  await write(page, '[aria-label="rho from"]', "1000");
  await until(page, () => decodeURIComponent(location.hash).includes("rho:1000:"));
  assert.equal(await told(), "");
  gone(400);
  await page.close();
});

test("what is solved over an axis that a study lacks is kept as a study, its points are opened, and the study is come back to", async () => {
  const page = await study("#/study/1?x=tip_mass&y=e&at=mu@5", { early: never_finest });
  await facts(page, "65 × 65 cells");
  const named = () => page.evaluate(() => [...document.querySelectorAll(".commands a[download], .commands code")].map((one) => one.download ?? one.textContent));
  assert.ok((await named()).every((one) => one.includes("friction-part")), String(await named()));
  await page.type('[aria-label^="Name under which"]', "with a mass");
  await page.keyboard.press("Enter");
  await until(page, () => /^Kept as with a mass, [\d\s]+ points/.test(document.querySelector(".solving + p").textContent));
  await until(page, () => document.querySelector(".commands p").textContent === "These points are kept as a study.");
  assert.ok((await named()).every((one) => one.startsWith("with a mass.") || one.includes("'with a mass'")), String(await named()));
  await page.focus(kMap);
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  await until(page, () => document.querySelector("h2.name")?.textContent.startsWith("friction, between its points: 0 of"));
  await until(page, () => [...document.querySelectorAll("code")].some((one) => one.textContent.includes("--tip-mass 0 ")));
  await page.goBack();
  await solved(page);
  await press(page, "Back to the study");
  await facts(page, "12 × 7");
  assert.doesNotMatch(await page.evaluate(() => location.hash), /between|tip_mass/);
  await page.close();
});

test("while finer cells are solved the page says how far they are, and what is on the screen is asked for, so that it stays", async () => {
  const page = await study("#/study/1?x=mu&y=H&at=e@1&between=mu:0.1:2,H:0.5:1.1", { early: never_finest });
  await facts(page, "65 × 65 cells, 4\u202f225 solved. e = 0.8. 129 × 129 are being solved: 75 %.");
  const path = await page.evaluate(() => new URL([...document.querySelectorAll(".files a")].find((one) => one.textContent === "SVG").href).pathname.replace("/picture", ""));
  await until(page, (shown) => window.asked.includes(shown), path);
  await press(page, "Back to the study");
  await facts(page, "12 × 7");
  assert.doesNotMatch(await text_of(page, ".facts"), /being solved/);
  await page.close();
});

test("of a study of one point a map is solved over any two keys", async () => {
  const page = await study(`#/study/${kOne}`);
  await pick(page, "picture", "map");
  await facts(page, "33 × 33");
  await pick(page, "across", "E");
  await until(page, () => /between=E:[\d.]+:[\d.]+,H:/.test(decodeURIComponent(location.hash)));
  await press(page, "Back to the study");
  await until(page, () => document.querySelector(".controls select").value === "gathered");
  await page.close();
});

test("the files of what is solved are what oblique plot draws of it", async () => {
  const page = await study("#/study/1?x=mu&y=g");
  await solved(page);
  await page.waitForFunction(() => [...document.querySelectorAll(".files a")].some((one) => one.textContent === "SVG"));
  const svg = await page.evaluate(async () => {
    const link = [...document.querySelectorAll(".files a")].find((one) => one.textContent === "SVG");
    const answer = await fetch(link.href);
    return [link.download, answer.status, await answer.text()];
  });
  assert.deepEqual(svg.slice(0, 2), ["friction-part.svg", 200]);
  assert.ok(svg[2].includes("g [m/s^2] over coefficient of friction"), svg[2].slice(0, 400));
  await page.close();
});

test("one column or one cell of a map is solved half-way to its neighbours", async () => {
  const page = await study("#/study/1?solve=off&x0=3&x1=3&y0=0&y1=0");
  await facts(page, "1 × 1");
  const recipes = asked_of(page);
  await page.click(".finer");
  await facts(page, "33 × 33");
  const [step, first] = [1.9 / 11, 0.1 + 3 * 1.9 / 11];
  const [mu, H] = ["mu", "H"].map((key) => axis_of(recipes[0], key));
  // To what a pixel tells.
  for (const [one, other] of [[mu.from, first - step / 2], [mu.to, first + step / 2], [H.from, 0.5], [H.to, 0.55]]) assert.ok(Math.abs(one - other) < step / 500, `${one} ${other}`);
  await page.close();
});

test("ends of what is solved have the digits that a pixel can tell, and their fields show all of them", async () => {
  // Its steps of H and mu are no round numbers, and the values are sums of them.
  const page = await study("#/study/1?solve=off&x0=3&x1=8&y0=1&y1=4");
  await facts(page, "6 × 4");
  await page.click(".finer");
  await until(page, () => decodeURIComponent(location.hash).includes("between=mu:0.618:1.482,H:0.6:0.9"));
  await pick(page, "across", "E");
  const field = '[aria-label="E to"]';
  await page.waitForSelector(field);
  const is_seen = () => page.$eval(field, (one) => one.value.length > 10 && one.scrollWidth <= one.clientWidth);
  assert.ok(await is_seen());
  await write(page, field, "123456789123");
  assert.ok(await is_seen());
  await page.close();
});

test("a map that is zoomed in until few cells are left is solved by itself, unless people say no", async () => {
  const page = await study();
  const recipes = asked_of(page);
  assert.equal(await page.$eval(".solving input[type=checkbox]", (one) => one.checked), true);
  await page.focus(kMap);
  await page.keyboard.press("+");
  await page.keyboard.press("+");
  await solved(page);
  assert.ok(axis_of(recipes[0], "mu").count === 33 && axis_of(recipes[0], "mu").to < 2, JSON.stringify(recipes[0]));
  await press(page, "Back to the study");
  await page.waitForFunction(() => location.hash.includes("solve=off") && document.querySelector(".finer").checkVisibility());
  assert.equal(await page.$eval(".solving input[type=checkbox]", (one) => one.checked), false);
  const count = recipes.length;
  await page.focus(kMap);
  await page.keyboard.press("+");
  await until(page, () => /A part is shown/.test(document.querySelector(".facts").textContent));
  await page.click(".solving input[type=checkbox]");
  await facts(page, "33 × 33");
  assert.ok(recipes.length > count);
  await page.close();
});

test("cells that a paused study lacks are solved by itself, and not while the study runs, nor for who may only look", async () => {
  const page = await browser.open("#/");
  const id = await page.evaluate(async () => {
    const axis = (key, from, to, count) => ({ key, from, to, count });
    const body = { name: "paused", recipe: { blocks: [{ axes: [axis("H", 0.3, 1.1, 1000), axis("mu", 0.1, 2, 1000), axis("e", 0.5, 1, 1000)] }] } };
    const made = await (await fetch("/api/studies", { method: "POST", body: JSON.stringify(body) })).json();
    return made.id;
  });
  const running = await study(`#/study/${id}`);
  const recipes = asked_of(running);
  await until(running, () => document.querySelector(".standing").textContent.includes("running"));
  // A refresh comes later than it would have begun.
  const shown = await text_of(running, ".facts");
  await until(running, (before) => document.querySelector(".facts").textContent !== before, shown);
  assert.equal(recipes.length, 0);
  await page.evaluate(async (number) => fetch(`/api/studies/${number}/pause`, { method: "POST", body: "{}" }), id);
  await running.close();
  const reader = await browser.open("#/", { early: () => {
    const real = window.fetch;
    window.fetch = async (path, how) => (String(path) === "/api/session" ? new Response(JSON.stringify({ ...await (await real(path, how)).json(), may_change: false })) : real(path, how));
  } });
  const read = asked_of(reader);
  await reader.evaluate((number) => { location.hash = `#/study/${number}`; }, id);
  await until(reader, () => /cells/.test(document.querySelector(".facts")?.textContent ?? ""));
  const paused = await study(`#/study/${id}`);
  await solved(paused);
  assert.equal(read.length, 0);
  assert.equal(await reader.$$eval(".controls optgroup", (all) => all.length), 0);
  await reader.close();
  await paused.close();
  await page.evaluate(async (number) => fetch(`/api/studies/${number}/cancel`, { method: "POST", body: "{}" }), id);
  await page.close();
});
