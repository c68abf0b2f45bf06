// What people take with them: files, links, commands.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { browser, facts, kOne, kScattered, server, study, text_of, until, write } from "./here.mjs";

/** Run in a tab before its scripts: files that the page saves are kept as text. */
function keep_saved() {
  const make = URL.createObjectURL;
  URL.createObjectURL = (blob) => {
    blob.text().then((text) => { window.saved = text; });
    return make.call(URL, blob);
  };
}

/** Runs a command that the page shows, as a shell would. */
function made_by(command) {
  const [, ...words] = command.match(/'(?:[^']|'\\'')*'|\S+/g).map((word) => word.replace(/^'|'$/g, "").replaceAll("'\\''", "'"));
  assert.equal(words[words.indexOf("--db") + 1], server.database, command);
  const made = spawnSync(server.oblique, words, { encoding: "utf8" });
  assert.equal(made.status, 0, made.stderr);
  return made.stdout;
}

test("the command of each kind of view draws a picture", async () => {
  const page = await browser.open("#/");
  const out = join(server.folder, "command.csv");
  let before = "";
  for (const view of ["#/study/1?at=e@2", "#/study/1?pic=map&z=mode&at=e@1&where=mu%20%3E%200.3", "#/study/1?x0=2&x1=8&y0=1&y1=5", "#/study/1?pic=lines&y=e&xlog=1",
    `#/study/${kScattered}?pic=gathered&x=mu&y=fn_peak_N&z=H`, `#/study/${kScattered}?pic=histogram&x=duration_s`, `#/study/${kOne}`]) {
    await page.evaluate((address) => { location.hash = address; }, view);
    const command = await until(page, (old) => {
      const text = document.querySelector(".commands code")?.textContent;
      return text !== old && text;
    }, before);
    made_by(command.replace("--out picture.svg", `--out ${out}`));
    assert.ok(readFileSync(out, "utf8").split("\n").length > 1, view);
    before = command;
  }
  await page.close();
});

/** Presses a button by its text. */
const press = (page, text) => page.evaluate((wanted) => [...document.querySelectorAll("button")].find((one) => one.textContent === wanted).click(), text);

test("the CSV of the table is what the command of the rows gives", async () => {
  const page = await study("#/study/1?at=e@2&where=mu%20%3C%201&order=mu%20DESC");
  const table = await page.evaluate(async () => (await fetch(document.querySelector(".rows a[download]").href)).text());
  const [, command] = await page.$$eval(".commands code", (all) => all.map((one) => one.textContent));
  const cells = (text) => text.trim().split(/\r?\n/).map((line) => line.split(",").map((cell) => (cell === "" || Number.isNaN(Number(cell)) ? cell : Number(cell))));
  assert.deepEqual(cells(table), cells(made_by(`${command} --format csv`)));
  await page.close();
});

test("the numbers on screen are saved as a file", async () => {
  const page = await study("#/study/1?at=e@2", { early: keep_saved });
  await page.waitForSelector(".files");
  await press(page, "CSV");
  const lines = (await until(page, () => window.saved)).trim().split("\r\n");
  assert.equal(lines[0], "mu,H,fn_peak_N,point");
  assert.equal(lines.length, 85);
  await page.close();
});

test("each kind of picture is saved as a PNG of what is drawn, with its legend below", async () => {
  const page = await browser.open("#/", { early: () => {
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => {
      if (blob.type === "image/png") createImageBitmap(blob).then((image) => { window.image = image; });
      return make.call(URL, blob);
    };
  } });
  for (const [view, canvas] of [["#/study/1?at=e@2", ".map canvas"], ["#/study/1?pic=map&z=mode&at=e@1", ".map canvas"], ["#/study/1?pic=lines&y=e", ".uplot canvas"],
    [`#/study/${kScattered}?pic=histogram&x=duration_s`, ".uplot canvas"]]) {
    await page.evaluate((address) => {
      window.image = undefined;
      location.hash = address;
    }, view);
    await until(page, (shown) => document.querySelector(shown) && document.querySelector(".files"), canvas);
    const { width, height, colours } = await until(page, (shown) => {
      if (!window.image) {
        [...document.querySelectorAll(".files button")].find((one) => one.textContent === "PNG").click();
        return false;
      }
      const { width, height } = window.image;
      const copy = Object.assign(document.createElement("canvas"), { width, height }).getContext("2d");
      copy.drawImage(window.image, 0, 0);
      const { data } = copy.getImageData(0, 0, width, height);
      const drawn = document.querySelector(shown);
      return { width: width - drawn.width, height: height - drawn.height, colours: new Set(new Uint32Array(data.buffer)).size };
    }, canvas);
    assert.ok(width > 0 && height > 20 && colours > 10, `${view}: ${width} ${height} ${colours}`);
  }
  await page.close();
});

test("the part that a map shows is refined by a study of its own, which is shown as it is solved", async () => {
  const page = await study("#/study/1?pic=map&z=slide_m&x=mu&y=H&at=e@1&x0=2&x1=4&y0=1&y1=3&from=0&to=1", { expected: /status of 409/ });
  assert.equal(await text_of(page, ".refine"), "Refine to 65 × 65 points");
  await page.click(".refine");
  await facts(page, "65 × 65 cells");
  assert.equal(await text_of(page, "h2.name"), "friction-refined");
  assert.match(await page.evaluate(() => location.hash), /pic=map&z=slide_m&x=mu&y=H&from=0&to=1/);
  await facts(page, "4\u202f225 solved");
  const [ends] = await page.evaluate(async () => (await (await fetch(`/api/studies/${/\d+/.exec(location.hash)}/rows?${new URLSearchParams({
    select: "min(mu),max(mu),min(H),max(H),min(e),max(e),count(*)" })}`)).json()).rows);
  const expected = [0.1 + 2 * 1.9 / 11, 0.1 + 4 * 1.9 / 11, 0.6, 0.8, 0.8, 0.8, 4225];
  ends.forEach((end, i) => assert.ok(Math.abs(end - expected[i]) < 1e-12, `${ends}`));
  // The next one has another name; one that is taken is refused in the server's words.
  assert.equal(await page.$eval(".picture .row input", (one) => one.value), "friction-refined-2");
  await write(page, ".picture .row input", "scattered");
  await page.click(".refine");
  await until(page, () => /scattered/.test(document.querySelector("p.said.bad")?.textContent));
  await page.close();
});

test("the address of a view is all of it", async () => {
  const page = await study("#/study/1?pic=map&z=mode&at=e@2&where=mu%20%3E%200.2&mark=H%20%3E%200.8&order=mu%20DESC&drag=mark");
  const told = (one) => one.evaluate(() => [location.hash, document.querySelector(".facts").textContent, document.querySelector(".marks input").value,
    document.querySelector(".rows tbody").textContent]);
  const other = await study(await page.evaluate(() => location.hash));
  assert.deepEqual(await told(other), await told(page));
  await other.close();
  await page.close();
});
