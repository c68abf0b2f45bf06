// Studies and workers, the form for a new study, and missing pages.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { join } from "node:path";
import { test } from "node:test";
import * as web from "./setup.mjs";

/** Index of each text field in the form. */
const fields = { name: 0, H: 1, mu: 2, e: 3, sample: 4, where: 5 };

async function form(how = {}) {
  // The server checks each input, and answers 4xx if it is not a valid study.
  const page = await web.browser.open("#/new", { expected: /status of 4/, ...how });
  await page.waitForSelector("form");
  return page;
}

async function fill(page, values) {
  for (const [name, text] of Object.entries(values)) {
    const field = (await page.$$("form input[type=text]"))[fields[name]];
    await field.click({ clickCount: 3 });
    await page.keyboard.press("Backspace");
    await field.type(text);
  }
}

const showsStatus = (page, pattern) => web.shows(page, "form [role=status]", pattern);
const isOff = (page) => page.$eval("form button", (one) => one.disabled);

test("the overview shows the progress of a study submitted on the page, which can be paused, resumed and cancelled", async () => {
  const page = await form();
  await fill(page, { name: "live", H: "0.2:1.1:200", mu: "0.1:2:200", e: "0.5:1:50" });
  await showsStatus(page, /^2\u202f000\u202f000 points, 1 model/);
  await page.click("form button");
  await web.until(page, () => /^#\/study\/\d/.test(location.hash));
  await web.goTo(page, "#/");
  const bar = 'progress[aria-label^="live"]';
  const solved = (more) =>
    web.until(page, (of, than) => document.querySelector(of)?.value > than, bar, more);
  await solved(0);
  await solved(await page.$eval(bar, (one) => one.value));
  assert.match(await web.textOf(page, "#pace"), /points\/s/);
  assert.match(await web.textOf(page, ".load"), /points open, [\d\u202f]+ at 1 worker/);
  page.once("dialog", (dialog) => dialog.accept());
  const states = { pause: "paused", resume: "running", cancel: "cancelled" };
  for (const [change, state] of Object.entries(states)) {
    await page.click(`[data-change="${change}"]`);
    await web.shows(page, "tbody tr", new RegExp(`^live${state}`));
  }
  await page.close();
});

test("a form with an invalid value shows the allowed values and cannot be submitted", async () => {
  const page = await form();
  for (const [values, sentence] of [
    [{ mu: "0.1:2" }, /FROM:TO:COUNT/],
    [{ mu: "-1" }, /mu/], // only the server checks the range of mu
    [{ mu: "1:2:x" }, /"x" is not a number/],
    [{ mu: "1", H: "0.5:1.25:4" }, /H = 1.25 m is not allowed: the tip drops at most the length/],
    [{ H: "1", sample: "some:10" }, /kinds are random, lhs, sobol/],
  ]) {
    await fill(page, values);
    await showsStatus(page, sentence);
    assert.equal(await isOff(page), true, String(sentence));
  }
  await page.close();
});

test("the form shows points, models, falls and size, and the errors of the server", async () => {
  const page = await form();
  await showsStatus(page, /^40 points, 1 model with 1 fall, about 39 kB in the database\.$/);
  await page.type("form textarea", "rho=2600:2700:3\nk=1e7:3e7:5");
  await showsStatus(
    page,
    /^600 points, 15 models with 3 different falls, about 591 kB in the database\.$/,
  );
  await fill(page, { where: "mu < 0.2" });
  const commands = await page.$$eval(".copied code", (all) => all.map((one) => one.textContent));
  const flags =
    "--name NAME --rho 2600:2700:3 --k 1e7:3e7:5 --H 1 --mu 0.1:2:40 --e 1 --where 'mu < 0.2'";
  const bare = commands.map((one) => one.replace(/ --db \S+$/, ""));
  assert.deepEqual(bare, [`oblique run ${flags}`, `oblique study check ${flags}`]);
  await fill(page, { H: "0.5:1.19:4" });
  await showsStatus(page, /H above 1\.08 m fail if the tip does not fall that far/);
  await fill(page, { name: "friction", H: "1" }); // a study of this name with other points exists
  await showsStatus(page, /different falls/);
  await page.click("form button");
  await web.shows(page, "form [role=alert]", /friction/);
  await page.close();
});

test("the command of a form submits the same study as the form: model and sample", async () => {
  const page = await form();
  await page.type("form textarea", "tolerance=1e-3\nk=2e7");
  const values = {
    name: "drawn",
    H: "0.5:1",
    mu: "0.2:0.8",
    sample: "sobol:16:3",
    where: "mu < 0.6",
  };
  await fill(page, values);
  await page.select("form select", "printed");
  await showsStatus(page, /^1\d points,/);
  const words = web.wordsOf(await web.textOf(page, ".copied code"));
  await page.click("form button");
  await web.shows(page, ".standing", /^done/);
  await page.close();
  const other = join(web.server.folder, "form.db");
  const made = spawnSync(web.server.oblique, [...words.slice(0, -1), other, "--workers", "1"]);
  assert.equal(made.status, 0, String(made.stderr));
  const select = ["query", "drawn", "--select", "point,H,mu,e,k,eta2,fn_peak_N", "--format", "csv"];
  const points = (db) => String(spawnSync(web.server.oblique, [...select, "--db", db]).stdout);
  assert.match(points(other), /\n\d+,0\.\d+,0\.\d+,1,2e\+07,1.21/);
  assert.equal(points(web.server.database), points(other));
});

/** Replaces the server in a tab by a fake server with many studies. The test sends its events. */
function manyStudies() {
  const real = window.fetch;
  const study = {
    state: "done",
    points: 10,
    solved: 10,
    failed: 0,
    left_out: 0,
    points_per_s: 0,
    left_s: null,
  };
  const make = (_, i) => ({ ...study, id: i + 1, name: `study-${i + 1}`, waits_for: "" });
  window.all = Array.from({ length: 1450 }, make);
  window.fetch = async (path, given) => {
    const url = new URL(path, location.href);
    if (url.pathname !== "/api/studies") return real(path, given);
    if (window.refuses) return new Response('{"error":"ask again later"}', { status: 503 });
    const [after, limit] = ["after", "limit"].map((name) => Number(url.searchParams.get(name)));
    const studies = window.all.filter((one) => one.id > after).slice(0, limit);
    const last = studies.at(-1).id;
    return new Response(JSON.stringify({ studies, next_after: last < 1450 ? last : 0 }));
  };
  window.EventSource = class extends EventTarget {
    constructor() {
      super();
      window.stream = this;
    }
    close() {}
  };
  window.send = (changes) => {
    const none = { unlisted: 0, workers_there: 0, threads: 0, points_open: 0, points_per_s: 0 };
    const overview = { studies: [], studies_by_state: {}, workers: [], ...none, ...changes };
    window.stream.dispatchEvent(new MessageEvent("overview", { data: JSON.stringify(overview) }));
  };
}

const names = (page) => page.$$eval("tbody th", (all) => all.map((one) => one.textContent));

test("the overview shows the newest of many studies, finds others by name, and updates changed studies", async () => {
  const how = { early: manyStudies, isHurried: true, expected: /status of 503/ };
  const page = await web.browser.open("#/", how);
  await web.until(page, () => document.querySelectorAll("tbody tr").length === 200);
  assert.equal((await names(page))[0], "study-1450");
  assert.match(await web.textOf(page, "main"), /1\u202f250 more: filter by name/);
  await page.type("input[type=search]", "study-77");
  await web.until(page, () => document.querySelectorAll("tbody tr").length === 11);
  await web.until(page, () => location.hash.includes("name=study-77"));
  await page.evaluate(() => {
    window.refuses = true;
    window.all[76].state = "running";
    window.send({ studies_by_state: { running: 1 } });
  });
  await web.shows(page, "p.said.bad", /ask again later/);
  await page.evaluate(() => (window.refuses = false));
  await web.shows(page, "tbody tr", /^study-77running/);
  assert.equal(await web.textOf(page, "p.said"), "");
  await page.close();
});

test("unknown addresses, studies and points show an error", async () => {
  const page = await web.browser.open("#/study/999", { expected: /status of 404/ });
  await web.shows(page, "main [role=alert]", /no such study/);
  await web.goTo(page, "#/study/1/point/99999");
  await web.shows(page, "main [role=alert]", /99999/);
  await web.goTo(page, "#/nothing");
  await web.shows(page, "main h2", /Studies/);
  await page.close();
});

test("a hidden page closes its stream of events and opens one when it is visible again", async () => {
  const early = () => {
    window.streams = 0;
    window.EventSource = class extends EventTarget {
      constructor() {
        super();
        ++window.streams;
      }
      close() {
        --window.streams;
      }
    };
  };
  const page = await web.browser.open("#/", { early });
  await page.waitForSelector("tbody tr");
  const held = await page.evaluate(() =>
    [true, false].map((value) => {
      Object.defineProperty(document, "hidden", { value, configurable: true });
      document.dispatchEvent(new Event("visibilitychange"));
      return window.streams;
    }),
  );
  assert.deepEqual(held, [0, 1]);
  await page.close();
});
