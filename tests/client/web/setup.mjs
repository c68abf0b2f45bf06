// Server and browser of one test file, and actions in the browser's tabs. Environment variables: OBLIQUE_BIN (folder of the
// programs), OBLIQUE_NODE_MODULES, OBLIQUE_CHROMIUM, and OBLIQUE_PAGE_DB (database that each test file copies).
import assert from "node:assert/strict";
import { copyFileSync } from "node:fs";
import { join } from "node:path";
import { after, before } from "node:test";
import { Browser, Server, until } from "./browser.mjs";

export { until };

export const server = new Server(join(process.env.OBLIQUE_BIN, "oblique"));
export const browser = new Browser();
export const mapCanvas = ".map canvas[tabindex]";
/** Selector of the picture in which tests drag the mouse. */
export const pictureIn = (view) => (/pic=(lines|histogram)/.test(view) ? ".u-over" : mapCanvas);
export const whereField = ".conditions > div:first-child input";
export const markField = ".marks input";

/**
 * Numbers of the studies: a grid, scattered points, too many scattered points to draw each of them,
 * a single point.
 */
export const studies = { grid: 1, scattered: 2, many: 3, one: 4 };

/** Options of a test that only `deploy/test --all` runs. */
export const inFull = { skip: process.env.OBLIQUE_TEST_ALL ? false : "runs with --all" };
/** Returns the first `count` cases, or all cases in `deploy/test --all`. */
export const casesOf = (all, count) => (process.env.OBLIQUE_TEST_ALL ? all : all.slice(0, count));

before(async () => {
  copyFileSync(process.env.OBLIQUE_PAGE_DB, server.database);
  await server.start();
  await browser.start(server);
});

after(async () => {
  await browser.stop();
  await server.stop();
  assert.deepEqual(browser.errors, [], "errors, policy reports or requests to other hosts");
});

export const textOf = (page, selector) => page.$eval(selector, (one) => one.textContent);

/** Waits until the text of an element matches `pattern`. */
export const shows = (page, selector, pattern) =>
  until(
    page,
    (of, source) => new RegExp(source, "u").test(document.querySelector(of)?.textContent ?? ""),
    selector,
    pattern.source,
  );

export const facts = (page, pattern) => shows(page, ".facts", pattern);
/** Waits until the line with the table's number of rows matches `pattern`. */
export const showsRowCount = (page, pattern) => shows(page, ".rows p[role=status]", pattern);
export const fieldOf = (page, name) =>
  page.evaluate((of) => new URLSearchParams(location.hash.split("?")[1]).get(of) ?? "", name);

/** Opens a tab with the picture and the table of a study. */
export async function study(view = "#/study/1", how = {}) {
  const page = await browser.open(view, how);
  await facts(page, /solved|points?[ ,]/);
  await showsRowCount(page, /rows/);
  return page;
}

/** Opens a tab with a point, and waits until the point has been solved again. */
export async function point(how = {}) {
  const page = await browser.open("#/study/1/point/100", how);
  await until(page, () => document.querySelectorAll(".uplot").length === 4);
  return page;
}

/** Sends a request to the server's API and returns the JSON answer. */
export const api = (page, path, body) =>
  page.evaluate(
    async (of, text) => {
      const headers = { "Content-Type": "application/json" };
      const answer = await fetch(of, text ? { method: "POST", headers, body: text } : {});
      return answer.json();
    },
    path,
    body && JSON.stringify(body),
  );

export const rowsOf = async (page, id, query) =>
  (await api(page, `/api/studies/${id}/rows?${new URLSearchParams(query)}`)).rows;

/** Submits a study over axes {key: [from, to, count]}; returns its number. */
export async function submit(page, name, axes) {
  const given = Object.entries(axes).map(([key, [from, to, count]]) => ({ key, from, to, count }));
  const recipe = { blocks: [{ axes: given }] };
  return (await api(page, "/api/studies", { name, model: { preset: "paper" }, recipe })).id;
}

/** Axes of a study that takes minutes. */
export const longAxes = { H: [0.2, 1.1, 200], mu: [0.1, 2, 200], e: [0.5, 1, 50] };

/** Opens another view in the same tab. */
export const goTo = (page, view) => page.evaluate((to) => void (location.hash = to), view);

/** Fills a field and presses Enter. */
export async function write(page, selector, text) {
  await page.click(selector, { clickCount: 3 });
  await page.keyboard.press("Backspace");
  await page.type(selector, text);
  await page.keyboard.press("Enter");
}

export const press = (page, text) =>
  page.evaluate((wanted) => {
    const buttons = [...document.querySelectorAll("button")];
    buttons.find((one) => one.textContent === wanted).click();
  }, text);

export const slideTo = (page, selector, value) =>
  page.$eval(
    selector,
    (slider, to) => {
      slider.value = String(to);
      slider.dispatchEvent(new Event("input"));
    },
    value,
  );

/**
 * Drags the mouse between two positions in an element. A position is a fraction of the element's
 * size; in maps, a fraction of the area within the margins.
 */
export async function drag(page, selector, [x0, y0], [x1, y1]) {
  const box = await (await page.waitForSelector(selector)).boundingBox();
  const [left, right, top, bottom] = selector === mapCanvas ? [64, 14, 10, 46] : [0, 0, 0, 0];
  const at = (x, y) => [
    box.x + left + x * (box.width - left - right),
    box.y + top + (1 - y) * (box.height - top - bottom),
  ];
  await page.mouse.move(...at(x0, y0));
  await page.mouse.down();
  await page.mouse.move(...at(x1, y1), { steps: 3 });
  await page.mouse.up();
}

/** Splits a command into words as a shell does, and drops the first word. */
export const wordsOf = (command) =>
  command
    .match(/'(?:[^']|'\\'')*'|\S+/g)
    .map((word) => word.replace(/^'|'$/g, "").replaceAll("'\\''", "'"))
    .slice(1);

/** Runs in a tab before its scripts. Stores each file that the page saves in `saved` or `image`. */
export function keepSaved() {
  const make = URL.createObjectURL;
  URL.createObjectURL = (blob) => {
    if (blob.type === "image/png") createImageBitmap(blob).then((image) => (window.image = image));
    else blob.text().then((text) => (window.saved = text));
    return make.call(URL, blob);
  };
}
