// A study: its map, its other pictures, its rows.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, facts, kMap, kScattered, kWhere, server, study, text_of, until, write } from "./here.mjs";

test("a map shows its cells; pointing at one tells its value, a click chooses it, two open its point", async () => {
  const page = await study();
  assert.match(await text_of(page, ".facts"), /12 × 7 cells, 84 solved/);
  const colours = await page.$eval(".map canvas", (canvas) => new Set(new Uint32Array(
    canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size);
  assert.ok(colours > 20, `${colours} colours`);
  const box = await (await page.$(kMap)).boundingBox();
  // The first cell lies at the foot on the left.
  await page.mouse.move(box.x + 75, box.y + box.height - 60);
  await until(page, () => /mu 0.1, H 0.5 m: fn_peak_N [\d.]+ N/.test(document.querySelector(".reading").textContent));
  const told = Number((await text_of(page, ".reading")).match(/fn_peak_N ([\d.]+)/)[1]);
  const stored = await page.evaluate(async () => (await (await fetch("/api/studies/1/rows?select=fn_peak_N&where=point=0")).json()).rows[0][0]);
  assert.ok(Math.abs(told / stored - 1) < 1e-4, `${told} ${stored}`);
  await page.mouse.click(box.x + 75, box.y + box.height - 60);
  assert.equal(await text_of(page, ".choice a"), "Open point 0");
  assert.equal(await page.$eval("tr.chosen", (row) => row.dataset.point), "0");
  await page.mouse.click(box.x + 75, box.y + box.height - 60, { clickCount: 2 });
  await until(page, () => location.hash === "#/study/1/point/0");
  await page.goBack();
  await until(page, () => document.querySelector(".choice a")?.textContent === "Open point 0");
  await page.close();
});

test("the table has the axes that vary in the study, what the picture shows, and the main outputs", async () => {
  const heads = async (/** @type {any} */ page) => page.$$eval(".rows thead th", (all) => all.map((one) => one.textContent.split(" ")[0]));
  const outputs = ["status", "fn_peak", "ft_peak", "duration", "slide", "stick_total", "major_mode"];
  const page = await study("#/study/1?pic=map&z=vn_out_m_s&x=mu&y=H&at=e@2");
  await until(page, () => document.querySelector(".rows tbody tr"));
  assert.deepEqual(await heads(page), ["point", "H", "mu", "e", "vn_out", ...outputs]);
  await page.close();
});

test("a map is moved over by keys, and its values are spoken", async () => {
  const page = await study();
  await page.focus(kMap);
  await page.keyboard.press("ArrowRight");
  assert.match(await text_of(page, ".reading[aria-live=polite]"), /mu 0.1, H 0.5 m/);
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowUp");
  assert.match(await text_of(page, ".reading[aria-live=polite]"), /mu 0.27273, H 0.6 m/);
  await page.keyboard.press("Enter");
  await until(page, () => /point\/\d+$/.test(location.hash));
  await page.close();
});

test("every view is a link, and tells the command that makes it", async () => {
  const page = await study("#/study/1?pic=map&z=mode&x=mu&y=H&at=e@2");
  assert.match(await text_of(page, ".categories"), /mode: \d+ here/);
  assert.match(await text_of(page, ".commands code"), /^oblique plot friction --map mode --x mu --y H --at e=1 --out/);
  await page.$eval("input[type=range]", (slider) => {
    slider.value = "0";
    slider.dispatchEvent(new Event("input"));
  });
  await until(page, () => document.querySelector(".facts").textContent.includes("e = 0.6"));
  const address = await page.evaluate(() => location.hash);
  const other = await study(address);
  assert.equal(await text_of(other, ".facts"), await text_of(page, ".facts"));
  await other.close();
  await page.close();
});

test("the histogram that comes after a map is one of the map's output", async () => {
  const page = await study("#/study/1?pic=map&z=duration_s&x=mu&y=H");
  await page.select(".controls select", "histogram");
  await until(page, () => new URLSearchParams(location.hash.split("?")[1]).get("x") === "duration_s");
  await page.evaluate(() => { location.hash = "#/study/1?pic=histogram&z=mass_ratio_that_is_not_there"; });
  await until(page, () => [...document.querySelectorAll(".controls select")].some((one) => one.value === "fn_peak_N"));
  await page.close();
});

test("pickers tell all that can be picked apart", async () => {
  for (const kind of ["map", "gathered"]) {
    const page = await study(`#/study/1?pic=${kind}`);
    for (const names of await page.$$eval(".controls select", (all) => all.map((one) => [...one.options].map((option) => option.text)))) {
      assert.deepEqual(names.filter((name, i) => names.indexOf(name) !== i), []);
    }
    await page.close();
  }
});

test("maps are zoomed by dragging and by keys, and lines, gathered points and histograms are drawn", async () => {
  const page = await study("#/study/1");
  const box = await (await page.$(kMap)).boundingBox();
  await page.mouse.move(box.x + 100, box.y + 40);
  await page.mouse.down();
  await page.mouse.move(box.x + 260, box.y + 160, { steps: 3 });
  await page.mouse.up();
  await until(page, () => !document.querySelector(".facts").textContent.includes("12 × 7"));
  await page.focus(kMap);
  await page.keyboard.press("0");
  await until(page, () => document.querySelector(".facts").textContent.includes("12 × 7"));
  for (const kind of ["lines", "gathered", "histogram"]) {
    await page.select(".controls select", kind);
    await until(page, (pic) => location.hash.includes(`pic=${pic}`) && (pic === "gathered"
      ? !document.querySelector(".map").hidden : document.querySelector(".uplot canvas")), kind);
    assert.equal(await text_of(page, "p.said"), "");
  }
  await page.close();
});

test("logarithmic axes of lines and bars are drawn, whatever their ends are", async () => {
  const page = await browser.open("#/");
  for (const view of ["#/study/1?pic=histogram&x=mu&xlog=1", "#/study/4?pic=histogram&x=mu&xlog=1", "#/study/1?pic=lines&y=e&xlog=1&ylog=1"]) {
    await page.evaluate((address) => { location.hash = address; }, view);  // another study is another view
    const inked = () => {
      const canvas = document.querySelector(".uplot canvas");
      return canvas && new Set(new Uint32Array(canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size > 5;
    };
    await until(page, inked);
  }
  await page.close();
});

test("Back undoes a zoom and another output, and leaves the focus where it was", async () => {
  const page = await study("#/study/1");
  await page.focus(kMap);
  await page.keyboard.press("+");
  await until(page, () => !document.querySelector(".facts").textContent.includes("12 × 7"));
  await page.keyboard.press("0");
  await facts(page, "12 × 7");
  await page.goBack();
  await until(page, () => !document.querySelector(".facts").textContent.includes("12 × 7"));
  await page.goBack();
  await facts(page, "12 × 7");
  assert.ok(await page.evaluate((map) => document.activeElement.matches(map), kMap));
  await page.close();
});

test("Back finds the address that was left, whatever the view was about to write into it", async () => {
  const page = await study("#/study/1", { early: () => {
    const real = window.setTimeout;
    window.setTimeout = (call, ms, ...given) => {
      if (ms !== 150) return real(call, ms, ...given);
      window.write_again = call;  // when the test says so
      return 1;
    };
  } });
  await page.focus(kMap);
  await page.keyboard.press("+");
  await until(page, () => !document.querySelector(".facts").textContent.includes("12 × 7"));
  await page.keyboard.press("ArrowRight");
  await page.evaluate(() => {
    addEventListener("popstate", window.write_again);
    history.back();
  });
  await facts(page, "12 × 7");
  await page.close();
});

test("the lower decades of logarithmic scales can be zoomed into", async () => {
  for (const view of [`#/study/${kScattered}?pic=histogram&x=closure&xlog=1`, "#/study/1?pic=lines&x=mu&y=&z=closure&ylog=1&at=e@2,H@3"]) {
    const page = await study(view);
    await page.waitForSelector(".u-over");
    const box = await (await page.$(".u-over")).boundingBox();
    await page.mouse.move(box.x + 0.02 * box.width, box.y + 0.98 * box.height);
    await page.mouse.down();
    await page.mouse.move(box.x + 0.9 * box.width, box.y + 0.4 * box.height, { steps: 3 });
    await page.mouse.up();
    const end = await until(page, (name) => new URLSearchParams(location.hash.split("?")[1]).get(name), view.includes("histogram") ? "x0" : "from");
    assert.ok(Number(end) > 0, `${view}: ${end}`);
    await until(page, () => document.querySelector(".facts").textContent.includes("A part is shown"));
    assert.equal(await text_of(page, "p.said:not([id])"), "");
    await page.close();
  }
});

test("percentages of modes are of the cells that have one, and axes are held at values with units", async () => {
  const page = await study(`#/study/1?z=mode&x=mu&y=e&at=H@3&where=${encodeURIComponent("mu > 0.5")}`);
  await until(page, () => document.querySelector(".gaps").textContent.includes("condition is not met"));
  const shares = await page.$$eval(".categories > ul .weak", (all) => all.map((one) => Number.parseFloat(one.textContent)));
  assert.ok(Math.abs(shares.reduce((sum, one) => sum + one, 0) - 100) < 0.5, String(shares));
  assert.match(await text_of(page, ".facts"), / H = 0\.8 m\./);
  await page.close();
});

test("rows are turned a page at a time and sorted, and nothing is truncated unsaid", async () => {
  const page = await study();
  const said = () => text_of(page, ".rows p[role=status]");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "1 to 25 of 252 rows.");
  await page.click(".rows button:not([disabled]):not(.plain)");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "26 to 50 of 252 rows.");
  await page.evaluate(() => [...document.querySelectorAll(".rows button.plain")].find((one) => one.textContent === "mu").click());
  await until(page, () => document.querySelector(".rows th[aria-sort=ascending]")?.textContent.startsWith("mu"));
  assert.equal(await said(), "1 to 25 of 252 rows.");
  // The page of the table is part of the address, and other rows begin at the first.
  await page.evaluate(() => [...document.querySelectorAll(".rows button")].find((one) => one.textContent === "Next").click());
  await until(page, () => new URLSearchParams(location.hash.split("?")[1]).get("page") === "2");
  const other = await study(await page.evaluate(() => location.hash));
  assert.equal(await text_of(other, ".rows tbody"), await text_of(page, ".rows tbody"));
  assert.equal(await text_of(other, ".rows p[role=status]"), "26 to 50 of 252 rows.");
  await write(other, kWhere, "mu > 1");
  await until(other, () => /^1 to 25 of/.test(document.querySelector(".rows p[role=status]").textContent) && !location.hash.includes("page="));
  await other.goBack();
  await until(other, () => document.querySelector(".rows p[role=status]").textContent === "26 to 50 of 252 rows.");
  await other.close();
  await page.close();
});

test("all modules that a study's map needs are asked for at once, and no others", async () => {
  const page = await study();
  const [preloaded, needed] = await page.evaluate(async () => {
    const path = (address) => new URL(address, location.href).pathname;
    const links = [...document.querySelectorAll("link[rel=modulepreload]")].map((one) => path(one.href)).concat(path("/main.js"));
    const found = new Set(["/main.js"]);
    for (const module of found) {  // grows meanwhile
      const text = await (await fetch(module)).text();
      for (const [, wanted] of text.matchAll(/^import .* from "([^"]+)";$/gm)) found.add(new URL(wanted, `${location.origin}${module}`).pathname);
      if (module === "/main.js") found.add("/study/study.js");
    }
    return [links.sort(), [...found].sort()];
  });
  assert.deepEqual(preloaded, needed);
  await page.close();
});

test("addresses that do not fit a study, or have numbers that are none, show what is usual there", async () => {
  const page = await browser.open("#/");
  for (const [view, picture] of [["1?pic=map&block=99", "map"], ["2?pic=map", "gathered"], ["1?pic=nothing", "map"],
    ["2", "gathered"], ["1?pic=map&zlog=1&from=1&to=Infinity", "map"]]) {
    await page.evaluate((address) => { location.hash = `#/study/${address}`; }, view);  // another study is another view
    await until(page, (kind) => document.querySelector(".controls select")?.value === kind && document.querySelector(".facts").textContent, picture);
    assert.equal(await text_of(page, "p.said:not([id])"), "", view);
  }
  await page.close();
});

test("a slider writes the address a few times, however fast it is dragged, and its last place at last", async () => {
  const page = await study();
  const written = await page.evaluate(async () => {
    const real = history.replaceState.bind(history);
    let times = 0;
    history.replaceState = (...given) => {
      ++times;
      real(...given);
    };
    const slider = document.querySelector(".sliders input");
    for (let i = 0; i <= 300; ++i) {
      slider.value = String(i % 3);
      slider.dispatchEvent(new Event("input"));
    }
    slider.value = "2";
    slider.dispatchEvent(new Event("input"));
    document.querySelector("h2.name").click();  // any click finds it written
    return [times, location.hash];
  });
  assert.ok(written[0] <= 3, `${written[0]} times`);
  assert.match(written[1], /at=e%402/);
  await page.close();
});

test("a view that was left changes neither the address nor the name of the next", async () => {
  const page = await browser.open("#/", { early: () => {
    const real = window.fetch;
    const released = new Promise((go_on) => { window.let_go = go_on; });
    window.fetch = async (path, how) => {
      const answer = await real(path, how);
      if (path !== "/api/studies/1") return answer;
      window.is_held = true;
      await released;
      return answer;
    };
  } });
  await page.waitForSelector("table");
  await page.evaluate(() => { location.hash = "#/study/1"; });
  await until(page, () => window.is_held);
  await page.evaluate(() => { location.hash = "#/new"; });
  await page.waitForSelector("form");
  // The view that was left gets its answer before this one comes.
  await page.evaluate(async () => {
    window.let_go();
    await (await fetch("/api/studies/1")).json();
  });
  assert.deepEqual(await page.evaluate(() => [location.hash, document.title]), ["#/new", "new study – oblique"]);
  await page.close();
});

test("how many rows there are is told again after a condition was given up while it was counted", async () => {
  const page = await study();
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "1 to 25 of 252 rows.");
  await page.evaluate(() => {
    const real = window.fetch;
    const released = new Promise((go_on) => { window.let_go = go_on; });
    window.counts = 0;
    window.fetch = async (path, how) => {
      if (/select=count/.test(path)) {
        ++window.counts;
        await released;
      }
      return real(path, how);
    };
  });
  await write(page, kWhere, "mu > 1");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "1 to 25.");
  const counts = await page.evaluate(() => window.counts);
  await write(page, kWhere, "");
  await until(page, (before) => window.counts > before, counts);
  await page.evaluate(() => window.let_go());
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "1 to 25 of 252 rows.");
  await page.close();
});

test("a map shows one block of a study, says so, and another one is chosen", async () => {
  const page = await browser.open("#/");
  const id = await page.evaluate(async () => {
    const axes = [{ key: "H", values: [0.5, 1] }, { key: "mu", values: [0.5, 1] }, { key: "e", values: [1] }];
    const body = { name: "blocks", model: { preset: "paper" }, recipe: { blocks: [{ axes: [{ key: "k", values: [1e7] }, ...axes] }, { axes }] } };
    const made = await fetch("/api/studies", { method: "POST", body: JSON.stringify(body), headers: { "Content-Type": "application/json" } });
    return (await made.json()).id;
  });
  await until(page, async (study) => (await (await fetch(`/api/studies/${study}/rows?select=point&limit=9`)).json()).rows.length === 8, id);
  await page.close();
  const map = await study(`#/study/${id}?pic=map&block=0`);
  assert.match(await text_of(map, ".facts"), /Block 1 of 2; not shown: 4 points of the others\./);
  assert.match(await text_of(map, ".commands code"), /^oblique plot blocks --map fn_peak_N --x mu --y H --block 1 /);
  await map.evaluate(() => {
    const pick = [...document.querySelectorAll(".controls label")].find((one) => one.textContent.startsWith("block")).querySelector("select");
    pick.value = "1";
    pick.dispatchEvent(new Event("change"));
  });
  await facts(map, "Block 2 of 2");
  assert.match(await text_of(map, ".commands code"), /^oblique plot blocks --map fn_peak_N --x mu --y H --block 2 /);
  await map.close();
});

test("ranges of a few ulps and without an end have one tick, the widest some, texts in CSV are quoted", async () => {
  const page = await browser.open("#/");
  const told = await page.evaluate(async () => {
    const { scale, ticks } = await import("/parts/scale.js");
    const { csv_line } = await import("/parts/format.js");
    return [ticks(scale(0.4517539514526256, 0.4517539514526_2565, false), 5), ticks(scale(1, Infinity, true), 5), csv_line([1, "a, \"b\""]),
      ticks(scale(0, Number.MAX_VALUE, false), 2)];
  });
  assert.deepEqual(told, [[0.4517539514526256], [1], '1,"a, ""b"""', [0, 1e308]]);
  await page.close();
});

test("a part of lines or of a histogram that is zoomed into is in the address, in the command and in words, and all is shown again", async () => {
  for (const [view, said] of [["#/study/1?pic=lines&x=mu&y=H&z=fn_peak_N", /--where 'mu >= [\d.]+ AND mu <= [\d.]+'.* --range [\d.]+:[\d.]+/], ["#/study/1?pic=histogram&x=fn_peak_N", /--range [\d.]+:[\d.]+/]]) {
    const page = await study(view);
    const box = await (await page.waitForSelector(".u-over")).boundingBox();
    const whole = await text_of(page, ".facts");
    await page.mouse.move(box.x + 0.3 * box.width, box.y + 0.2 * box.height);
    await page.mouse.down();
    await page.mouse.move(box.x + 0.8 * box.width, box.y + 0.8 * box.height, { steps: 3 });
    await page.mouse.up();
    await facts(page, "A part is shown.");
    assert.match(await text_of(page, ".commands code"), said);
    const address = await page.evaluate(() => location.hash);
    assert.match(address, /x0=[\d.]+&x1=[\d.]+/);
    if (view.includes("lines")) {
      await page.$eval(".sliders input", (slider) => {
        slider.value = "1";
        slider.dispatchEvent(new Event("input"));
      });
      await facts(page, "e = 0.8");
      await facts(page, "A part is shown.");
    }
    await page.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent === "Show all").click());
    await until(page, (all) => document.querySelector(".facts").textContent.startsWith(all.split(" ").slice(0, 4).join(" ")), whole);
    assert.ok(!(await text_of(page, ".facts")).includes("A part"));
    await page.close();
  }
});

test("colours span what is said at one end and what is there at the other, also in the command", async () => {
  const page = await study("#/study/1?from=300");
  assert.match(await text_of(page, ".commands code"), /--range 300:\d+/);
  await page.close();
  const dark = await study("#/study/1?from=90000");
  assert.match(await text_of(dark, ".facts"), /All values lie below what colours span/);
  assert.match(await text_of(dark, ".commands code"), /--range 90000:9\d{4}/);
  await write(dark, "input[inputmode=decimal]", "abc");
  await until(dark, () => document.querySelector(".picture .bad")?.textContent === '"abc" is no number.');
  await dark.close();
});

test("the command of the rows and the address say whether only marked points are shown", async () => {
  const page = await study("#/study/1?mark=mu%20%3E%201");
  const rows = () => page.$$eval(".commands code", (all) => all.map((one) => one.textContent).find((one) => one.startsWith("oblique query")));
  assert.match(await rows(), /--where 'mu > 1'/);
  await page.click(".only input");
  await until(page, () => /all=1/.test(location.hash) && document.querySelector(".rows p[role=status]").textContent === "1 to 25 of 252 rows.");
  assert.ok(!(await rows()).includes("--where"));
  await page.waitForSelector("tr.marked");
  const other = await study(await page.evaluate(() => location.hash));
  assert.equal(await other.$eval(".only input", (one) => one.checked), false);
  await other.close();
  await page.close();
});

test("a server that does not answer is told of in words, and what it was asked meanwhile is asked again", async () => {
  const page = await study("#/study/1", { is_hurried: true, expected: /ERR_INTERNET_DISCONNECTED/ });
  await page.setOfflineMode(true);
  await page.$eval(".sliders input", (slider) => {
    slider.value = "2";
    slider.dispatchEvent(new Event("input"));
  });
  await until(page, () => document.querySelector("p.said").textContent === "The server does not answer: what is shown is what came last.");
  await page.evaluate(() => { location.hash = "#/study/1/point/3"; });
  await until(page, () => document.querySelector("main [role=alert]")?.textContent === "The server does not answer.");
  await page.evaluate(() => history.back());
  await until(page, () => location.hash.startsWith("#/study/1?"));
  await page.setOfflineMode(false);
  await facts(page, "e = 1");
  await until(page, () => document.querySelector("p.said").textContent === "");
  await page.close();
});

test("a picture that nobody wants any more does not keep people from the next", async () => {
  const page = await study("#/study/1?pic=map&z=fn_peak_N&x=mu&y=H", { early: () => {
    const real = window.fetch;
    window.fetch = (what, how) => (!String(what).includes("z=slide_m") ? real(what, how) : new Promise((_, fail) => {
      window.is_waiting = true;  // until it is ended
      how.signal.addEventListener("abort", () => fail(how.signal.reason));
    }));
  } });
  await page.evaluate(() => { location.hash = "#/study/1?pic=map&z=slide_m&x=mu&y=H"; });
  await until(page, () => window.is_waiting);
  await page.evaluate(() => { location.hash = "#/study/1?pic=map&z=mode&x=mu&y=H"; });
  await page.waitForSelector(".categories");
  await page.close();
});
