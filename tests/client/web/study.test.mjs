// The view of a study: map, other pictures, and table of points.
import assert from "node:assert/strict";
import { test } from "node:test";
import * as web from "./setup.mjs";

const optionsOf = (page, label) =>
  page.$$eval(
    ".controls label",
    (all, text) => {
      const field = all.find((one) => one.firstChild.textContent === text);
      return [...field.querySelectorAll("option")].map((one) => one.textContent);
    },
    label,
  );
const plotCommand = (page) => web.textOf(page, ".commands code");

test("a map shows the value of a cell; a click chooses the cell, a double click opens its point, and Back keeps the choice", async () => {
  const page = await web.study("#/study/1");
  await web.facts(page, /12 × 7 cells, 84 solved/);
  const box = await (await page.$(web.mapCanvas)).boundingBox();
  const first = [box.x + 75, box.y + box.height - 60]; // a cell at the bottom left
  await page.mouse.move(...first);
  await web.shows(page, ".reading", /mu 0.1, H 0.5 m: fn_peak_N [\d.]+ N/);
  const shown = Number((await web.textOf(page, ".reading")).match(/fn_peak_N ([\d.]+)/)[1]);
  const [[stored]] = await web.rowsOf(page, 1, { select: "fn_peak_N", where: "point = 0" });
  assert.ok(Math.abs(shown / stored - 1) < 1e-4, `${shown} ${stored}`);
  await page.mouse.click(...first);
  assert.equal(await web.textOf(page, ".choice a"), "Open point 0");
  assert.equal(await page.$eval("tr.chosen", (row) => row.dataset.point), "0");
  await page.mouse.click(...first, { clickCount: 2 });
  await web.until(page, () => location.hash === "#/study/1/point/0");
  await page.goBack();
  await web.shows(page, ".choice a", /Open point 0/);
  await page.close();
});

test("keys move over a map and zoom it, a live region announces its values, Enter opens the point, and Back undoes the zoom", async () => {
  const page = await web.study("#/study/1");
  await page.focus(web.mapCanvas);
  for (const key of ["ArrowRight", "ArrowRight", "ArrowUp"]) await page.keyboard.press(key);
  assert.match(await web.textOf(page, ".reading[aria-live=polite]"), /mu 0.27273, H 0.6 m/);
  await page.keyboard.press("+");
  await web.until(page, () => !document.querySelector(".facts").textContent.includes("12 × 7"));
  await page.keyboard.press("0");
  await web.facts(page, /12 × 7/);
  await page.goBack();
  await web.facts(page, /Zoomed/);
  await page.focus(web.mapCanvas);
  await page.keyboard.press("Enter");
  await web.until(page, () => /point\/\d+$/.test(location.hash));
  await page.close();
});

test(
  "pickers list the columns that vary, then the main outputs, each once",
  web.inFull,
  async () => {
    const page = await web.study(`#/study/${web.studies.scattered}`);
    const options = await optionsOf(page, "colour");
    const first = "none,H [m],mu,e,fn_peak_N,ft_peak_N,duration_s [µs],slide_m [mm]".split(",");
    assert.deepEqual(options.slice(0, first.length), first);
    assert.deepEqual([...new Set(options)], options);
    for (const absent of ["attempt", "k", "fn_peak_error"])
      assert.ok(!options.includes(absent), absent);
    await page.close();
  },
);

test("a study shows its axes with their ranges, its mesh with a warning if coarse, and its model", async () => {
  const page = await web.study("#/study/1");
  const summary =
    /H 0\.5 m to 1\.1 m \(7\); mu 0\.1 to 2 \(12\); e 0\.6, 0\.8, 1; 4 elements a link – not converged/;
  assert.match(await web.textOf(page, ".model summary"), summary);
  assert.match(await web.textOf(page, ".model ul"), /k = 2\.7e7 N\/m/);
  await web.goTo(page, `#/study/${web.studies.scattered}`);
  await web.shows(page, ".model summary", /H 0\.3\d* m to 1\.09\d* m \(uniform\)/);
  await page.close();
});

test("tables, maps and lines have the units of the tables of oblique, and the table has the points of the shown part", async () => {
  const page = await web.study(
    "#/study/1?pic=map&z=duration_s&x=mu&y=H&at=e@2&x0=2&x1=4&y0=1&y1=3",
  );
  await web.showsRowCount(page, /of 27 rows/);
  const heads = await page.$$eval(".rows thead th", (all) => all.map((one) => one.textContent));
  const expected =
    "point,H [m],mu,e,duration_s [µs],fn_peak_N,ft_peak_N,slide_m [mm],stick_total_s [µs],major_mode";
  assert.deepEqual(heads, expected.split(","));
  const [point, , , , shown] = await page.$$eval("tbody tr:first-child td", (all) =>
    all.map((one) => Number(one.textContent)),
  );
  const query = { select: "duration_s", where: `point = ${point}` };
  const [[seconds]] = await web.rowsOf(page, 1, query);
  assert.ok(Math.abs(shown / (seconds * 1e6) - 1) < 1e-4, `${shown} ${seconds}`);
  assert.match(await web.textOf(page, ".bar p"), /duration_s \[µs\]/);
  await page.close();
});

test(
  "a mode keeps its colour while the page is open: when zoomed, for another slider value, and as points",
  web.inFull,
  async () => {
    const page = await web.study("#/study/1?pic=map&z=major_mode&x=mu&y=H&at=e@2");
    const looks = () =>
      page.$$eval(".categories li", (all) => {
        const looks = all.map((one) => [one.childNodes[1].data, one.firstChild.toDataURL()]);
        return looks.filter(([text]) => !text.includes("others"));
      });
    const known = new Map(await looks());
    for (const view of [
      "map&x=mu&y=H&at=e@0",
      "map&x=mu&y=H&at=e@2&x0=6&x1=11&y0=3&y1=6",
      "scatter&x=mu&y=H",
    ]) {
      const before = await web.textOf(page, ".facts");
      await web.goTo(page, `#/study/1?z=major_mode&pic=${view}`);
      await web.until(page, (old) => document.querySelector(".facts").textContent !== old, before);
      const shared = (await looks()).filter(([text]) => known.has(text));
      assert.ok(shared.length > 1, view);
      for (const [text, look] of shared) assert.ok(known.get(text) === look, `${view}: ${text}`);
    }
    await page.close();
  },
);

test("a sample is drawn as points, its lines are medians and quartiles, and its histogram shows an output and begins at 0", async () => {
  const page = await web.study(`#/study/${web.studies.scattered}`, {
    early: () => {
      const { prototype } = CanvasRenderingContext2D;
      const real = prototype.fillText;
      window.written = [];
      prototype.fillText = function fillText(text, ...place) {
        window.written.push(text);
        real.call(this, text, ...place);
      };
    },
  });
  await web.facts(page, /^300 points, drawn one by one/);
  await page.select(".controls select", "lines");
  await web.facts(page, /Median and quartiles of 300 points in \d+ bins/);
  await web.shows(page, ".legend", /median25 % lie below75 % lie below/);
  await page.evaluate(() => (window.written = []));
  await page.select(".controls select", "histogram");
  await web.shows(page, "figcaption", /Distribution of fn_peak_N/);
  await web.until(page, () => window.written.includes("0"));
  await page.close();
});

test("zooming by mouse changes address and command, Back undoes it, also on lines, bars and logarithmic axes", async () => {
  const range = String.raw`[\d.]+ AND \w+ <= [\d.]+`;
  const commands = {
    "1?pic=map&x=mu&y=H": `--where 'mu >= ${range} AND H >= ${range}'`,
    "1?pic=lines&x=mu&y=H&z=fn_peak_N": `--where 'mu >= ${range}' --range [\\d.]+:[\\d.]+`,
    "1?pic=histogram&x=fn_peak_N": "--range [\\d.]+:[\\d.]+",
    "2?pic=histogram&x=closure&xlog=1": "--range [\\de.-]+:[\\de.-]+ --log-x",
    "2?pic=scatter&x=mu&y=fn_peak_N&z=": "--scatter mu,fn_peak_N --where",
  };
  for (const [view, command] of web.casesOf(Object.entries(commands), 2)) {
    const selector = web.pictureIn(view);
    const page = await web.study(`#/study/${view}`);
    await web.drag(page, selector, [0.2, 0.2], [0.8, 0.8]);
    await web.facts(page, /Zoomed/);
    assert.match(await plotCommand(page), new RegExp(command), view);
    assert.ok((await web.fieldOf(page, "x0")) !== "", view);
    await web.press(page, "Show all");
    await web.until(page, () => !document.querySelector(".facts").textContent.includes("Zoomed"));
    await page.goBack();
    await web.facts(page, /Zoomed/);
    assert.equal(await web.textOf(page, "p.said:not([id])"), "", view);
    await page.close();
  }
});

test(
  "a slider shows other values and writes the address only a few times however fast it moves",
  web.inFull,
  async () => {
    const page = await web.study("#/study/1?pic=map&z=mode&x=mu&y=H&at=e@2");
    assert.match(
      await plotCommand(page),
      /^oblique plot friction --map mode --x mu --y H --at e=1 --out/,
    );
    const [times, address] = await page.evaluate(() => {
      const real = history.replaceState.bind(history);
      let written = 0;
      history.replaceState = (...given) => {
        ++written;
        real(...given);
      };
      const slider = document.querySelector(".sliders input");
      for (let i = 0; i <= 300; ++i) {
        slider.value = String(i % 3);
        slider.dispatchEvent(new Event("input"));
      }
      document.querySelector("h2.name").click(); // a click updates the address
      return [written, location.hash];
    });
    assert.ok(times <= 3, `${times} times`);
    assert.match(address, /at=e%400/);
    await web.facts(page, /e = 0\.6/);
    await page.close();
  },
);

test("unsuitable addresses show the default view", web.inFull, async () => {
  const page = await web.browser.open("#/");
  for (const [view, picture] of [
    ["1?pic=map&block=99", "map"],
    ["2?pic=map&block=0", "scatter"],
    ["1?pic=nothing", "map"],
    ["4", "scatter"],
    ["1?pic=map&zlog=1&from=1&to=Infinity&z=none", "map"],
  ]) {
    await web.goTo(page, `#/study/${view}`);
    const isShown = (kind) =>
      document.querySelector(".controls select")?.value === kind &&
      document.querySelector(".facts").textContent;
    await web.until(page, isShown, picture);
    assert.equal(await web.textOf(page, "p.said:not([id])"), "", view);
    await web.goTo(page, "#/");
    await page.waitForSelector("input[type=search]");
  }
  await page.close();
});

test(
  "a map shows one block of a study and says so, and another block can be chosen",
  web.inFull,
  async () => {
    const page = await web.browser.open("#/");
    const axes = [
      { key: "H", values: [0.5, 1] },
      { key: "mu", values: [0.5, 1] },
      { key: "e", values: [1] },
    ];
    const recipe = { blocks: [{ axes: [{ key: "k", values: [1e7] }, ...axes] }, { axes }] };
    const body = { name: "blocks", model: { preset: "paper" }, recipe };
    const { id } = await web.api(page, "/api/studies", body);
    await web.goTo(page, `#/study/${id}?pic=map&block=0`);
    await web.facts(page, /Block 1 of 2; 4 points in others\./);
    assert.match(await plotCommand(page), /--map fn_peak_N --x mu --y H --block 1 /);
    await page.$$eval(".controls label", (all) => {
      const select = all.find((one) => one.textContent.startsWith("block")).querySelector("select");
      select.value = "1";
      select.dispatchEvent(new Event("change"));
    });
    await web.facts(page, /Block 2 of 2/);
    await page.close();
  },
);

test(
  "the colour scale spans from a typed end, in the shown unit, to the other end of the data",
  web.inFull,
  async () => {
    const page = await web.study("#/study/1?z=slide_m&from=0.0002");
    assert.match(await plotCommand(page), /--range 0\.0002:0\.00\d+/);
    const from = "input[inputmode=decimal]";
    assert.equal(await page.$eval(from, (one) => one.value), "0.2");
    await web.write(page, from, "0.5");
    await web.shows(page, ".commands code", /--range 0\.0005:/);
    await web.write(page, from, "abc");
    assert.equal(await page.$eval(from, (one) => one.getAttribute("aria-invalid")), "true");
    await page.close();
  },
);

test(
  "an outdated picture does not delay the next, and a large map appears coarse first",
  web.inFull,
  async () => {
    const page = await web.study("#/study/1?pic=map&z=fn_peak_N&x=mu&y=H", {
      early: () => {
        const real = window.fetch;
        window.sides = [];
        window.fetch = (what, how) => {
          if (what.includes("/slice?")) window.sides.push(new URLSearchParams(what).get("nx"));
          if (!what.includes("z=slide_m")) return real(what, how);
          window.isWaiting = true;
          return new Promise((_, reject) =>
            how.signal.addEventListener("abort", () => reject(how.signal.reason)),
          );
        };
      },
    });
    await web.goTo(page, "#/study/1?pic=map&z=slide_m&x=mu&y=H");
    await web.until(page, () => window.isWaiting);
    await web.goTo(page, "#/study/1?pic=map&z=mode&x=mu&y=H");
    await page.waitForSelector(".categories");
    const id = await web.submit(page, "large", {
      H: [0.5, 1.1, 200],
      mu: [0.1, 2, 200],
      e: [0.8, 0.8, 1],
    });
    await web.api(page, `/api/studies/${id}/pause`, {});
    await page.evaluate(() => (window.sides = []));
    await web.goTo(page, `#/study/${id}?pic=map&x=mu&y=H`);
    await web.facts(page, /200 × 200/);
    assert.deepEqual(await page.evaluate(() => window.sides.slice(0, 2)), ["96", "256"]);
    await web.api(page, `/api/studies/${id}/cancel`, {});
    await page.close();
  },
);
