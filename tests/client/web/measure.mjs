// How long people wait: run BINARIES MODULES measure.mjs FILE.db, of which the largest grid is looked at. A copy is
// worked on. All is seen from the browser: from the click to what is painted.
import { constants, copyFileSync } from "node:fs";
import { join } from "node:path";
import { Browser, Server, until } from "./browser.mjs";

const kOpened = 9;
const kSlides = 60;
const kSolved = 5;

const [file] = process.argv.slice(2);
if (!file) {
  console.error("measure.mjs: name a database, as one of a study of 10^6 points on a grid of three axes");
  process.exit(2);
}
const server = new Server(join(process.env.OBLIQUE_BIN, "oblique"));
const browser = new Browser();
const at = (sorted, share) => sorted[Math.min(Math.ceil(share * sorted.length) - 1, sorted.length - 1)];
function say(what, times, wanted) {
  const sorted = [...times].sort((a, b) => a - b);
  console.log(`${what.padEnd(44)} median ${at(sorted, 0.5).toFixed(0).padStart(5)} ms, 95 % ${at(sorted, 0.95).toFixed(0).padStart(5)} ms, `
    + `first ${times[0].toFixed(0).padStart(5)} ms, of ${times.length}; wanted ${wanted} ms`);
}

/** From the start of a navigation to the first picture that is painted. */
async function opened(view) {
  const page = await browser.open(view, { early: () => {
    const watch = new MutationObserver(() => {
      if (window.painted_ms || !document.querySelector("[data-picture-ms]")) return;
      window.painted_ms = -1;
      requestAnimationFrame(() => setTimeout(() => { window.painted_ms = performance.now(); }));
    });
    watch.observe(document, { subtree: true, childList: true, attributes: true, attributeFilter: ["data-picture-ms"] });
  } });
  const painted = await until(page, () => (window.painted_ms > 0 ? window.painted_ms : 0));
  return { page, painted };
}

async function opening(what, view) {
  const { page, painted } = await opened(view);
  const times = [painted];
  while (times.length < kOpened) {
    await page.reload();
    times.push(await until(page, () => (window.painted_ms > 0 ? window.painted_ms : 0)));
  }
  say(what, times, 500);
  await page.close();
}

/** Each step of a slider, from its event to the picture that is painted. */
async function sliding(view) {
  const { page } = await opened(view);
  const times = await page.evaluate(async (slides) => {
    const slider = document.querySelector(".sliders input");
    const root = document.querySelector("[data-picture-ms]");
    const found = [];
    for (let i = 0; i < slides; ++i) {
      slider.value = String(Math.round((Number(slider.max) * ((i * 37) % slides)) / slides));
      const begun = performance.now();
      const painted = new Promise((take) => {
        const watch = new MutationObserver(() => {
          watch.disconnect();
          requestAnimationFrame(() => setTimeout(() => take(performance.now())));
        });
        watch.observe(root, { attributes: true, attributeFilter: ["data-picture-ms"] });
      });
      slider.dispatchEvent(new Event("input"));
      root.dataset.slid = String(i);
      found.push(await painted - begun);
    }
    return found;
  }, kSlides);
  say("slider to repaint", times, 100);
  const slices = await page.evaluate(async () => {
    const asked = performance.getEntriesByType("resource").map((one) => one.name).filter((name) => name.includes("/slice?")).at(-1);
    const found = [];
    for (let i = 0; i < 30; ++i) {
      const begun = performance.now();
      await (await fetch(asked.replace(/n([xy])=\d+/g, "n$1=256"))).arrayBuffer();
      found.push(performance.now() - begun);
    }
    return found;
  });
  say("a slice of 256 × 256 at most", slices, 60);
  await page.close();
}

/** From the click to whole pictures of 33² and 65² points that the study lacks. */
async function solving(study) {
  const found = { 33: [], 65: [] };
  for (let i = 0; i < kSolved; ++i) {
    const { page } = await opened(`#/study/${study.id}?solve=off&x0=${i + 1}&x1=${i + 12}&y0=${2 * i + 1}&y1=${2 * i + 20}`);
    const times = await page.evaluate(() => new Promise((take) => {
      const root = document.querySelector("[data-picture-ms]");
      const told = {};
      const begun = performance.now();
      new MutationObserver(() => {
        const side = root.dataset.side;
        if (!Number(side) || told[side]) return;
        told[side] = -1;
        requestAnimationFrame(() => setTimeout(() => {
          told[side] = performance.now() - begun;
          if (side === "65") take(told);
        }));
      }).observe(root, { attributes: true, attributeFilter: ["data-side"] });
      document.querySelector(".finer").click();
    }));
    for (const side of [33, 65]) found[side].push(times[side]);
    await page.close();
  }
  say("solved while one looks, 33 × 33", found[33], 300);
  say("solved while one looks, 65 × 65", found[65], 1000);
}

/** A study of 10^9 points, of which some are solved. */
async function begin_large(page) {
  return page.evaluate(async () => {
    const axis = (key, from, to) => ({ key, from, to, count: 1000 });
    const body = { name: `measured-${Date.now()}`, recipe: { blocks: [{ axes: [axis("H", 0.2, 1.1), axis("mu", 0.1, 2), axis("e", 0.5, 1)] }] } };
    const { id } = await (await fetch("/api/studies", { method: "POST", body: JSON.stringify(body) })).json();
    await new Promise((go_on) => setTimeout(go_on, 3000));
    await fetch(`/api/studies/${id}/pause`, { method: "POST", body: "{}" });
    return id;
  });
}

try {
  copyFileSync(file, server.database, constants.COPYFILE_FICLONE);
  await server.start();
  await browser.start(server);
  const page = await browser.open("#/");
  const studies = await page.evaluate(async () => (await (await fetch("/api/studies?limit=1000")).json()).studies);
  const study = studies.sort((a, b) => b.points - a.points)[0];
  console.log(`${study.name}: ${study.points} points, ${study.solved} solved`);
  await opening("from opening the study to its first picture", `#/study/${study.id}`);
  await opening("the same of modes", `#/study/${study.id}?pic=map&z=mode`);
  await opening("the same of a scatter", `#/study/${study.id}?pic=gathered&x=mu&y=fn_peak_N`);
  await sliding(`#/study/${study.id}`);
  await solving(study);
  const large = await begin_large(page);
  await opening("the same of 10^9 points, some solved", `#/study/${large}`);
} finally {
  await browser.stop();
  await server.stop();
}
