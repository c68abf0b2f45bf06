// The server and the browser of the tests of a file, and tabs at its views.
// OBLIQUE_BIN: the folder of programs; OBLIQUE_NODE_MODULES; OBLIQUE_CHROMIUM; OBLIQUE_PAGE_DB: the database of which each file
// has a copy.
import assert from "node:assert/strict";
import { copyFileSync } from "node:fs";
import { join } from "node:path";
import { after, before } from "node:test";
import { Browser, Server, until } from "./browser.mjs";

export { text_of, until } from "./browser.mjs";

export const server = new Server(join(process.env.OBLIQUE_BIN, "oblique"));
export const browser = new Browser();
export const kMap = ".map canvas[tabindex]";
export const kWhere = ".conditions > div:first-child input";

/** Studies by their numbers: a grid, scattered points, more of these than are drawn one by one, a single point. */
export const kGrid = 1;
export const kScattered = 2;
export const kMany = 3;
export const kOne = 4;

before(async () => {
  copyFileSync(process.env.OBLIQUE_PAGE_DB, server.database);
  await server.start();
  await browser.start(server);
});

after(async () => {
  await browser.stop();
  await server.stop();
  assert.deepEqual(browser.objections, [], "an error, a report of the content policy or a request to another host");
});

/** A tab that shows the picture of a study. */
export async function study(view = "#/study/1", how = {}) {
  const page = await browser.open(view, how);
  await until(page, () => /solved|points?[ ,]/.test(document.querySelector(".facts")?.textContent ?? ""));
  await until(page, () => document.querySelectorAll(".rows tbody tr").length > 0);
  return page;
}

/** What is said below the picture has that. */
export const facts = (page, text) => until(page, (wanted) => document.querySelector(".facts")?.textContent.includes(wanted), text);

/** A study of axes from, to and with so many values, and what is done with it at once. @returns its number */
export async function submit(name, axes, changes = []) {
  const page = await browser.open("#/");
  const id = await page.evaluate(async (given) => {
    const recipe = { blocks: [{ axes: Object.entries(given.axes).map(([key, [from, to, count]]) => ({ key, from, to, count })) }] };
    const made = await fetch("/api/studies", { method: "POST", body: JSON.stringify({ name: given.name, model: { preset: "paper" }, recipe }), headers: { "Content-Type": "application/json" } });
    return (await made.json()).id;
  }, { name, axes });
  await page.close();
  for (const what of changes) await change(id, what);
  return id;
}

/** Pauses, resumes, cancels or retries a study. */
export async function change(id, what) {
  const page = await browser.open("#/");
  assert.equal(await page.evaluate(async (path) => (await fetch(path, { method: "POST", body: "{}", headers: { "Content-Type": "application/json" } })).status,
    `/api/studies/${id}/${what}`), 200);
  await page.close();
}

/** A tab whose point has been solved again. */
export async function point(how = {}) {
  const page = await browser.open("#/study/1/point/100", how);
  await until(page, () => document.querySelectorAll(".uplot").length === 4);
  return page;
}

/** Fills a field and leaves it by Enter. */
export async function write(page, selector, text) {
  await page.click(selector, { clickCount: 3 });
  if (text === "") await page.keyboard.press("Backspace");
  else await page.type(selector, text);
  await page.keyboard.press("Enter");
}

/** Drags the mouse over the map, from and to shares of its area. */
export async function drag(page, [x0, y0], [x1, y1]) {
  const box = await (await page.$(kMap)).boundingBox();
  const at = (x, y) => [box.x + 64 + x * (box.width - 78), box.y + 10 + (1 - y) * (box.height - 56)];
  await page.mouse.move(...at(x0, y0));
  await page.mouse.down();
  await page.mouse.move(...at(x1, y1), { steps: 3 });
  await page.mouse.up();
}
