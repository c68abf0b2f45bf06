// Measures the time from a click to the painted picture. Usage: run BINARIES MODULES measure.mjs FILE.db|PAGE [PART...]
// The script copies FILE.db before use. PAGE is the address of a server, with its token. The script opens the largest
// study of which at least a tenth is solved. PARTs are opening, modes, scatter, slider and large (default: all).
// OBLIQUE_FIGURES=FILE also stores the times as JSON.
import { constants, copyFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { Browser, Server, until } from "./browser.mjs";

const [given, ...parts] = process.argv.slice(2);
if (!given) {
  console.error("measure.mjs: name a database with a grid of three axes, or the address of a page");
  process.exit(2);
}
const isPage = given.startsWith("http://");
const server = isPage
  ? { address: given, origin: new URL(given).origin }
  : new Server(join(process.env.OBLIQUE_BIN, "oblique"));
const browser = new Browser();
const figures = {};

function say(part, what, times, wanted) {
  figures[part] = times;
  const sorted = [...times].sort((a, b) => a - b);
  const at = (share) => sorted[Math.min(Math.ceil(share * sorted.length) - 1, sorted.length - 1)];
  const [median, most, first] = [at(0.5), at(0.95), times[0]].map((ms) => ms.toFixed(0));
  console.log(
    `${what}: median ${median} ms, 95 % ${most} ms, first ${first} ms, wanted ${wanted} ms`,
  );
}

/**
 * Runs in a tab before its scripts. `paintedMs` becomes the time of the first painted picture;
 * `next()` waits for the next picture and returns its time.
 */
function watchPictures() {
  const painted = () =>
    new Promise((resolve) =>
      requestAnimationFrame(() => setTimeout(() => resolve(performance.now()))),
    );
  window.next = () =>
    new Promise((resolve) => {
      const watch = new MutationObserver(() => {
        if (!document.querySelector("[data-picture-ms]")) return;
        watch.disconnect();
        painted().then(resolve);
      });
      const attributeFilter = ["data-picture-ms"];
      watch.observe(document, {
        subtree: true,
        childList: true,
        attributes: true,
        attributeFilter,
      });
    });
  window.next().then((ms) => (window.paintedMs = ms));
}

async function opening(part, what, view) {
  const page = await browser.open(view, { early: watchPictures });
  const times = [await until(page, () => window.paintedMs)];
  while (times.length < 20) {
    await page.reload();
    times.push(await until(page, () => window.paintedMs));
  }
  say(part, what, times, 500);
  await page.close();
}

/** Measures the time from each step of a slider to the new picture. */
async function sliding(view) {
  const page = await browser.open(view, { early: watchPictures });
  await until(page, () => window.paintedMs);
  const times = await page.evaluate(async () => {
    const slider = document.querySelector(".sliders input");
    const found = [];
    for (let i = 0; i < 60; ++i) {
      slider.value = String(Math.round((Number(slider.max) * ((i * 37) % 60)) / 60));
      delete document.querySelector("[data-picture-ms]").dataset.pictureMs;
      const begun = performance.now();
      const painted = window.next();
      slider.dispatchEvent(new Event("input"));
      found.push((await painted) - begun);
    }
    return found;
  });
  say("slider", "slider to repaint", times, 100);
  await page.close();
}

/** Submits a study of 10^9 points, pauses it after its first results, and returns its number. */
const beginLarge = (page) =>
  page.evaluate(async () => {
    const axis = (key, from, to) => ({ key, from, to, count: 1000 });
    const axes = [axis("H", 0.2, 1.1), axis("mu", 0.1, 2), axis("e", 0.5, 1)];
    const body = {
      name: `measured-${Date.now()}`,
      model: { preset: "paper" },
      recipe: { blocks: [{ axes }] },
    };
    const post = (path, text) => fetch(path, { method: "POST", body: text });
    const { id } = await (await post("/api/studies", JSON.stringify(body))).json();
    await new Promise((resolve) => setTimeout(resolve, 3000));
    await post(`/api/studies/${id}/pause`, "{}");
    return id;
  });

async function measure() {
  const page = await browser.open("#/");
  const list = () => fetch("/api/studies?limit=1000").then((answer) => answer.json());
  const { studies } = await page.evaluate(list);
  const solved = studies.filter((one) => one.solved * 10 >= one.points);
  const study = solved.sort((a, b) => b.points - a.points)[0];
  console.log(`${study.name}: ${study.points} points, ${study.solved} solved`);
  const view = `#/study/${study.id}`;
  const all = {
    opening: () => opening("opening", "opening a study", view),
    modes: () => opening("modes", "the same of modes", `${view}?pic=map&z=mode`),
    scatter: () =>
      opening("scatter", "the same of a scatter", `${view}?pic=scatter&x=mu&y=fn_peak_N`),
    slider: () => sliding(view),
    large: async () =>
      opening("large", "the same of 10^9 points", `#/study/${await beginLarge(page)}`),
  };
  for (const part of parts.length > 0 ? parts : Object.keys(all)) await all[part]();
}

try {
  if (!isPage) {
    copyFileSync(given, server.database, constants.COPYFILE_FICLONE);
    await server.start();
  }
  await browser.start(server);
  await measure();
  if (process.env.OBLIQUE_FIGURES)
    writeFileSync(process.env.OBLIQUE_FIGURES, JSON.stringify(figures));
} finally {
  await browser.stop();
  if (!isPage) await server.stop();
}
