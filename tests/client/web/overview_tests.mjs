// Studies and workers, forms, and what is not there.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { join } from "node:path";
import { test } from "node:test";
import { browser, server, text_of, until } from "./here.mjs";

/** A tab at a form. What is written is judged whenever it stands for a moment, also when it is no study. */
async function form(how = {}) {
  const page = await browser.open("#/new", { expected: /status of 4/, ...how });
  await page.waitForSelector("form");
  return page;
}

test("the overview follows a study that is started on the page, live, and studies are paused, resumed and cancelled", async () => {
  const page = await form();
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
  await until(page, () => /^#\/study\/\d/.test(location.hash));
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

test("a form that is wrong says what is allowed, filters are counted, and a server that refuses is heard", async () => {
  const page = await form();
  const fields = await page.$$("form input");
  const write = async (field, text) => {
    await field.click({ clickCount: 3 });
    await field.type(text);
  };
  const told = () => text_of(page, "form [role=status]");
  await write(fields[2], "0.1:2");
  assert.match(await told(), /FROM:TO:COUNT/);
  await write(fields[2], "-1");  // only the server knows what a recipe may have
  await until(page, () => document.querySelector("form [role=status].bad")?.textContent.includes("mu"));
  assert.equal(await page.$eval("form button", (one) => one.disabled), true);
  await write(fields[2], "1:2:11");
  await write(fields[5], "mu > 1.75");
  await until(page, () => document.querySelector("form [role=status]").textContent.startsWith("3 points,") || document.querySelector("form [role=status]").textContent === "3 points.");
  assert.match(await page.$eval(".copied code", (one) => one.textContent), /--mu 1:2:11 --e 1 --where 'mu > 1.75' --db \S+$/);
  await write(fields[0], "friction");  // there is one, of other points
  await page.click("form button");
  await until(page, () => document.querySelector("form [role=alert]").textContent.includes("friction"));
  await page.close();
});

/** A form's field by its place among those with text. */
const fill = async (page, i, text) => {
  const fields = await page.$$("form input[type=text]");
  await fields[i].click({ clickCount: 3 });
  await fields[i].type(text);
};

test("values that got no judgement may be started all the same, and what is asked of older values is given up", async () => {
  const page = await form({ early: () => {
    const real = window.fetch;
    window.given_up = 0;
    window.how = "silent";
    window.hanging = { "/api/check": 0, "/api/studies": 0 };
    window.fetch = (path, given) => {
      if (!(path in window.hanging)) return real(path, given);
      if (window.how === "busy") return Promise.resolve(new Response('{"error":"ask again later"}', { status: 503 }));
      return new Promise((_, fail) => {
        ++window.hanging[path];
        given.signal?.addEventListener("abort", () => {
          ++window.given_up;
          fail(given.signal.reason);
        });
      });
    };
  } });
  await until(page, () => window.hanging["/api/check"] > 0);
  await fill(page, 0, "judged");
  await until(page, () => window.given_up >= 1);
  await page.evaluate(() => { window.how = "busy"; });
  await fill(page, 2, "0.5");
  await until(page, () => /could not be judged.*ask again later/.test(document.querySelector("form [role=status]").textContent));
  const is_off = () => page.$eval("form button", (one) => one.disabled);
  assert.equal(await is_off(), false);
  // While the start is under way no other is begun, whatever is written meanwhile.
  await page.evaluate(() => { window.how = "silent"; });
  await page.click("form button");
  await until(page, () => window.hanging["/api/studies"] === 1);
  await fill(page, 2, "0.75");
  await until(page, () => document.querySelector(".copied code").textContent.includes("--mu 0.75"));
  assert.equal(await is_off(), true);
  await page.close();
});

test("a form says where only a fall tells whether the tip comes to H, and refuses a drop beyond the finger's length", async () => {
  const page = await form();
  const says = (text) => until(page, (wanted) => document.querySelector("form [role=status]").textContent.includes(wanted), text);
  await fill(page, 1, "0.5:1.19:4");
  await says("Whether the tip comes down further than 1.08 m only its fall tells");
  await fill(page, 1, "0.5:1.25:4");
  await says("H = 1.25 m is not allowed: the tip drops at most the length of the chain, 1.2 m");
  assert.equal(await page.$eval("form button", (one) => one.disabled), true);
  await fill(page, 1, "0.5:1:4");
  await until(page, () => /^160 points[,.]/.test(document.querySelector("form [role=status]").textContent));
  assert.doesNotMatch(await text_of(page, "form [role=status]"), /fall tells/);
  await page.close();
});

test("a form says points, models, falls and size, and has the command that measures the time", async () => {
  const page = await form();
  const says = (text) => until(page, (wanted) => document.querySelector("form [role=status]").textContent === wanted, text);
  await says("40 points, 1 model with 1 fall, about 39 kB in the database.");
  await page.type("form textarea", "rho=2600:2700:3\nk=1e7:3e7:5");
  await says("600 points, 15 models with 3 different falls, about 591 kB in the database.");
  await fill(page, 5, "mu < 0.2");
  await page.click("form input[type=checkbox]");
  const commands = await page.$$eval(".copied code", (all) => all.map((one) => one.textContent));
  const flags = "--name NAME --rho 2600:2700:3 --k 1e7:3e7:5 --H 1 --mu 0.1:2:40 --e 1 --where 'mu < 0.2' --errors";
  assert.deepEqual(commands.map((one) => one.replace(/ --db \S+$/, "")), [`oblique run ${flags}`, `oblique study check ${flags}`]);
  await page.close();
});

test("the command of a form makes the study that the form starts: model, sample, errors, priority", async () => {
  const page = await form();
  await fill(page, 0, "drawn");
  await fill(page, 1, "0.5:1");
  await fill(page, 2, "normal(0.5,0.1,0.2,)");
  await page.type("form textarea", "tolerance=1e-3\nk=2e7");
  await fill(page, 4, "sobol:16:3");
  await fill(page, 5, "mu < 0.6");
  await page.click("form input[type=checkbox]");
  for (const [i, choice] of [[0, "printed"], [2, "10"]]) await (await page.$$("form select"))[i].select(choice);
  await until(page, () => document.querySelector("form [role=status]").textContent.startsWith("13 points,"));
  const command = await text_of(page, ".copied code");
  assert.match(command, /--preset printed --tolerance 1e-3 --k 2e7 .*--errors --db \S+$/, "the file's, once the page is closed: alone it needs no priority");
  await page.click("form button");
  const id = await until(page, () => /^#\/study\/(\d+)/.exec(location.hash)?.[1]);
  await until(page, () => document.querySelector(".standing").textContent.startsWith("done"));
  const told = await page.evaluate(async (study) => (await (await fetch(`/api/studies/${study}`)).json()), id);
  assert.equal(told.errors, true);
  await page.close();
  const other = join(server.folder, "form.db");
  const flags = command.match(/'[^']*'|\S+/g).map((word) => word.replaceAll("'", "")).slice(1, -1);
  const made = spawnSync(server.oblique, [...flags, other, "--workers", "1"], { encoding: "utf8" });
  assert.equal(made.status, 0, made.stderr);
  const points = (database) => spawnSync(server.oblique, ["query", "drawn", "--select", "point,H,mu,e,k,eta2,fn_peak_N", "--format", "csv", "--db", database], { encoding: "utf8" }).stdout;
  assert.match(points(other), /\n\d+,0\.\d+,0\.\d+,1,2e\+07,1.21/);
  assert.equal(points(server.database), points(other));
});

/** A server with many studies, whose events are what a test tells. */
const many_studies = () => {
  const real = window.fetch;
  window.all = Array.from({ length: 450 }, (_, i) => ({ id: i + 1, name: `study-${i + 1}`, state: "done", points: 10, solved: 10, failed: 0, left_out: 0, points_per_s: 0, left_s: null,
    waits_for: "", priority: 0, created_at: "", submitted_by: "" }));
  window.fetch = (path, given) => {
    const url = new URL(path, location.href);
    if (url.pathname !== "/api/studies" || given?.method === "POST") return real(path, given);
    if (window.refuses) return Promise.resolve(new Response('{"error":"ask again later"}', { status: 503 }));
    const [after, limit] = ["after", "limit"].map((name) => Number(url.searchParams.get(name)));
    const studies = window.all.filter((one) => one.id > after).slice(0, limit);
    const last = studies.at(-1)?.id ?? 0;
    return Promise.resolve(new Response(JSON.stringify({ studies, next_after: window.all.some((one) => one.id > last) ? last : 0 })));
  };
  window.EventSource = class extends EventTarget {
    constructor() {
      super();
      window.tell = (now) => this.dispatchEvent(new MessageEvent("overview", { data: JSON.stringify({ studies: [], unlisted: 0, studies_by_state: { done: 450 }, workers: [],
        workers_there: 0, threads: 0, points_open: 0, points_leased: 0, points_per_s: 0, ...now }) }));
      setTimeout(() => window.tell({}));
    }
    close() {}
  };
};
const row_of = (page, name) => until(page, (wanted) => [...document.querySelectorAll("tbody th")].find((one) => one.textContent === wanted)?.parentElement.textContent, name);

test("of many studies the overview says what was read, and keeps what was asked for", async () => {
  const page = await browser.open("#/?name=study-430", { is_hurried: true, early: many_studies });
  const says = (what) => until(page, (text) => document.querySelector("main").textContent.includes(text), what);
  const press = (name) => page.evaluate((wanted) => [...document.querySelectorAll("main button")].find((one) => one.textContent === wanted).click(), name);
  await says("Of the 200 studies that were read none is called so.");
  await press("More studies");
  await says("Of the 400 studies that were read none is called so.");
  await press("More studies");
  await row_of(page, "study-430");
  // Other states are read as far as was read before, and what was refused is asked for again.
  await page.evaluate(() => { window.refuses = true; window.all[429].state = "cancelled"; window.tell({ studies_by_state: { done: 449, cancelled: 1 } }); });
  await says("ask again later");
  await page.evaluate(() => { window.refuses = false; });
  await until(page, () => document.querySelector(".said").textContent === "" && document.querySelector("tbody tr")?.textContent.includes("cancelled"));
  // The name is part of the address.
  await page.evaluate(() => {
    const field = document.querySelector("main input[type=search]");
    field.value = "study-44";
    field.dispatchEvent(new Event("input"));
  });
  await until(page, () => location.hash === "#/?name=study-44" && document.querySelectorAll("tbody tr").length === 11);
  await page.evaluate(() => { location.hash = "#/"; });
  await row_of(page, "study-1");
  await page.goBack();
  await until(page, () => document.querySelector("main input[type=search]").value === "study-44");
  await page.close();
});

test("studies that events leave out are asked for: in the overview, which says how many these are, and in their own view", async () => {
  for (const view of ["#/", "#/study/1"]) {
    const page = await browser.open(view, { is_hurried: true, early: many_studies });
    await until(page, () => document.querySelector("progress"));
    const settled = () => page.$eval('progress[aria-label^="study-1:"]', (one) => one.value);
    await page.evaluate(() => {
      Object.assign(window.all[0], { state: "running", points: 1000 });
      window.tell({ unlisted: 13, studies_by_state: { done: 449, running: 1 } });
    });
    if (view === "#/") await until(page, () => document.querySelector("main").textContent.includes("13 more studies run or are paused"));
    for (const solved of [300, 600]) {
      await page.evaluate((n) => { window.all[0].solved = n; }, solved);
      await until(page, (n) => document.querySelector('progress[aria-label^="study-1:"]').value === n, solved);
    }
    assert.equal(await settled(), 600);
    await page.close();
  }
});

test("what stays in the overview after it ended is kept though it lies beyond what was read", async () => {
  const page = await browser.open("#/", { early: many_studies });
  await row_of(page, "study-200");
  await page.evaluate(() => {
    window.all[448].state = "running";
    window.tell({ studies: [window.all[448]], studies_by_state: { done: 449, running: 1 } });
  });
  await row_of(page, "study-449");
  await page.evaluate(() => {
    window.all[448].state = "done";
    window.tell({});
  });
  await until(page, () => [...document.querySelectorAll("tbody tr")].some((row) => row.cells[0].textContent === "study-449" && row.cells[1].textContent === "done"));
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

test("what is not there is said", async () => {
  for (const [view, sentence] of [["#/study/999", /no such study/], ["#/study/1/point/999999", /no point/]]) {
    const page = await browser.open(view, { expected: /status of 404/ });
    await page.waitForSelector("[role=alert]");
    assert.match(await text_of(page, "[role=alert]"), sentence);
    await page.close();
  }
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

test("a form's pickers show all of what is chosen where there is room", async () => {
  const page = await form();
  await page.waitForSelector("form select");
  const cut = await page.$$eval("form select", (pickers) => pickers.filter((picker) => {
    const shown = picker.clientWidth;
    picker.style.maxWidth = "none";
    return picker.clientWidth > shown;
  }).map((picker) => picker.selectedOptions[0].text));
  assert.deepEqual(cut, []);
  await page.close();
});
