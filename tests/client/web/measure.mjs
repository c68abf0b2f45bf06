// How long people wait: run BINARIES MODULES measure.mjs FILE.db|PAGE [PART...]. Of a database a copy is worked on; PAGE is the
// address of a server, with its token. The largest grid of which a tenth is solved is looked at. PARTs are opening, modes, scatter, slider,
// solving and large; all when none is named. OBLIQUE_FIGURES=FILE gets the times as JSON as well. All is seen from the
// browser: from the click to what is painted.
import { constants, copyFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { Browser, Server, until } from "./browser.mjs";

const kOpened = 20;
const kSlides = 60;
const kSolved = 5;

const [given, ...parts] = process.argv.slice(2);
if (!given) {
  console.error("measure.mjs: name a database, as one of a study of 10^6 points on a grid of three axes, or the address of a page");
  process.exit(2);
}
const is_page = given.startsWith("http://");
const server = is_page ? { address: given, origin: new URL(given).origin } : new Server(join(process.env.OBLIQUE_BIN, "oblique"));
const browser = new Browser();
const figures = {};
const at = (sorted, share) => sorted[Math.min(Math.ceil(share * sorted.length) - 1, sorted.length - 1)];
function say(part, what, times, wanted) {
  figures[part] = times;
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

async function opening(part, what, view) {
  const { page, painted } = await opened(view);
  const times = [painted];
  while (times.length < kOpened) {
    await page.reload();
    times.push(await until(page, () => (window.painted_ms > 0 ? window.painted_ms : 0)));
  }
  say(part, what, times, 500);
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
  say("slider", "slider to repaint", times, 100);
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
  say("slice", "a slice of 256 × 256 at most", slices, 60);
  await page.close();
}

/** A study of 10^9 points, of which some are solved. */
async function begin_large(page) {
  return page.evaluate(async () => {
    const axis = (key, from, to) => ({ key, from, to, count: 1000 });
    const body = { name: `measured-${Date.now()}`, model: { preset: "paper" }, recipe: { blocks: [{ axes: [axis("H", 0.2, 1.1), axis("mu", 0.1, 2), axis("e", 0.5, 1)] }] } };
    const { id } = await (await fetch("/api/studies", { method: "POST", body: JSON.stringify(body) })).json();
    await new Promise((go_on) => setTimeout(go_on, 3000));
    await fetch(`/api/studies/${id}/pause`, { method: "POST", body: "{}" });
    return id;
  });
}

async function measure() {
  const page = await browser.open("#/");
  const studies = await page.evaluate(async () => (await (await fetch("/api/studies?limit=1000")).json()).studies);
  const study = studies.filter((one) => one.solved * 10 >= one.points).sort((a, b) => b.points - a.points)[0];
  console.log(`${study.name}: ${study.points} points, ${study.solved} solved`);
  const view = `#/study/${study.id}`;
  const all = {
    opening: () => opening("opening", "from opening the study to its first picture", view),
    modes: () => opening("modes", "the same of modes", `${view}?pic=map&z=mode`),
    scatter: () => opening("scatter", "the same of a scatter", `${view}?pic=gathered&x=mu&y=fn_peak_N`),
    slider: () => sliding(view),
    large: async () => opening("large", "the same of 10^9 points, some solved", `#/study/${await begin_large(page)}`),
  };
  for (const part of parts.length > 0 ? parts : Object.keys(all)) await all[part]();
}

try {
  if (!is_page) {
    copyFileSync(given, server.database, constants.COPYFILE_FICLONE);
    await server.start();
  }
  await browser.start(server);
  await measure();
  if (process.env.OBLIQUE_FIGURES) writeFileSync(process.env.OBLIQUE_FIGURES, JSON.stringify(figures));
} finally {
  await browser.stop();
  if (!is_page) await server.stop();
}
