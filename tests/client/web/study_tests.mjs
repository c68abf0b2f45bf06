// A study: its map, its other pictures, its rows.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, kMap, kWhere, server, study, text_of, until, write } from "./here.mjs";

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
  const stored = await page.evaluate(async () => (await (await fetch("/api/studies/1/points/0")).json()).row.fn_peak_N);
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

test("maps are zoomed by dragging and by keys, and lines, gathered points and histograms are drawn", async () => {
  const page = await study();
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
  for (const view of ["#/study/1?pic=histogram&x=mu&xlog=1", "#/study/1?pic=lines&y=e&xlog=1&ylog=1", "#/study/4?pic=histogram&x=mu&xlog=1"]) {
    const page = await browser.open(view);
    const inked = () => {
      const canvas = document.querySelector(".uplot canvas");
      return canvas && new Set(new Uint32Array(canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size > 5;
    };
    await until(page, inked);
    await page.close();
  }
});

test("what lies between the cells of a map is solved while one looks, and is kept as a study", async () => {
  const page = await study();
  // Whatever is asked for when it begins does not end it.
  await page.evaluate(() => {
    const slider = document.querySelector(".sliders input");
    for (const value of ["1", "2", "1"]) {
      slider.value = value;
      slider.dispatchEvent(new Event("input"));
    }
    document.querySelector(".finer").click();
  });
  await until(page, () => document.querySelector(".facts").textContent.match(/(\d+) × \1 cells, [1-9]/));
  await until(page, () => document.querySelector(".facts").textContent.includes("129 × 129"));
  await page.type('[aria-label^="Name under which"]', "kept");
  await page.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent === "Keep it as a study").click());
  await until(page, () => document.querySelector("p.said a")?.textContent === "kept");
  await page.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent === "Back to the study").click());
  await until(page, () => document.querySelector(".facts").textContent.includes("12 × 7"));
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
  const csv = await page.evaluate(async () => (await fetch(document.querySelector(".rows a[download]").href)).text());
  assert.equal(csv.trim().split("\r\n").length, 253);
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
  for (const [view, picture] of [["1?pic=map&block=99", "map"], ["1?pic=nothing", "map"], ["2?pic=map", "gathered"],
    ["1?pic=map&zlog=1&from=1&to=Infinity", "map"]]) {
    const page = await study(`#/study/${view}`);
    assert.equal(await page.$eval(".controls select", (one) => one.value), picture, view);
    assert.equal(await text_of(page, "p.said:not([id])"), "", view);
    await page.close();
  }
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
  const page = await browser.open("#/");
  await page.waitForSelector("table");
  await page.evaluate(async () => {
    const real = window.fetch;
    window.fetch = async (path, how) => {
      const answer = await real(path, how);
      if (path === "/api/studies/1") await new Promise((go_on) => setTimeout(go_on, 300));
      return answer;
    };
    location.hash = "#/study/1";
    await new Promise((go_on) => setTimeout(go_on, 100));
    location.hash = "#/new";
    await new Promise((go_on) => setTimeout(go_on, 600));
  });
  assert.deepEqual(await page.evaluate(() => [location.hash, document.title]), ["#/new", "new study – oblique"]);
  await page.close();
});

test("how many rows there are is told again after a condition was given up while it was counted", async () => {
  const page = await study();
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "1 to 25 of 252 rows.");
  await page.evaluate(() => {
    const real = window.fetch;
    window.fetch = async (path, how) => {
      if (String(path).includes("count")) await new Promise((go_on) => setTimeout(go_on, 500));
      return real(path, how);
    };
  });
  await write(page, kWhere, "mu > 1");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "1 to 25.");
  await write(page, kWhere, "");
  await until(page, () => document.querySelector(".rows p[role=status]").textContent === "1 to 25 of 252 rows.");
  await page.close();
});

test("what is solved between the cells of a block has that block's model", async () => {
  const page = await browser.open("#/");
  const id = await page.evaluate(async () => {
    const axes = [{ key: "H", values: [0.5, 1] }, { key: "mu", values: [0.5, 1] }, { key: "e", values: [1] }];
    const body = { name: "blocks", recipe: { blocks: [{ axes: [{ key: "k", values: [1e7] }, ...axes] }, { axes }] } };
    const made = await fetch("/api/studies", { method: "POST", body: JSON.stringify(body), headers: { "Content-Type": "application/json" } });
    return (await made.json()).id;
  });
  await until(page, async (study) => (await (await fetch(`/api/studies/${study}/rows?select=point&limit=9`)).json()).rows.length === 8, id);
  await page.close();
  const map = await study(`#/study/${id}?pic=map&block=0`);
  const solved_by = async () => {
    const asked = map.waitForRequest((one) => one.url().endsWith("/api/look"));
    await map.click(".finer");
    const { model, blocks } = JSON.parse((await asked).postData()).recipe;
    return blocks[0].axes.find((one) => one.key === "k")?.values?.[0] ?? model.k_N_m;
  };
  assert.equal(await solved_by(), 1e7);
  await map.evaluate(() => [...document.querySelectorAll("button")].find((one) => one.textContent === "Back to the study").click());
  await map.waitForSelector(".finer");
  await map.evaluate(() => {
    const pick = [...document.querySelectorAll(".controls label")].find((one) => one.textContent.startsWith("block")).querySelector("select");
    pick.value = "1";
    pick.dispatchEvent(new Event("change"));
  });
  const of_block = await map.evaluate(async (study) => (await (await fetch(`/api/studies/${study}/points/4`)).json()).row.k, id);
  assert.notEqual(of_block, 1e7);
  assert.equal(await solved_by(), of_block);
  await map.close();
});

test("ranges of a few ulps and without an end have one tick, texts in CSV are quoted", async () => {
  const page = await browser.open("#/");
  const told = await page.evaluate(async () => {
    const { scale, ticks } = await import("/parts/scale.js");
    const { csv_line } = await import("/parts/format.js");
    return [ticks(scale(0.4517539514526256, 0.4517539514526_2565, false), 5), ticks(scale(1, Infinity, true), 5), csv_line([1, "a, \"b\""])];
  });
  assert.deepEqual(told, [[0.4517539514526256], [1], '1,"a, ""b"""']);
  await page.close();
});
