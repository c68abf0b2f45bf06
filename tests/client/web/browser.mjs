// A server of a database, and a browser that writes down all it objects to.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

const need = createRequire(join(process.env.OBLIQUE_NODE_MODULES, "x"));
const puppeteer = need("puppeteer-core");
const axe_source = need("axe-core").source;

/** Ends a wait only where something hangs. */
const kHangs_ms = 300_000;

/** Shows a database as `oblique view` does, until `stop`. */
export class Server {
  constructor(oblique) {
    this.oblique = oblique;
    this.folder = mkdtempSync(join(tmpdir(), "oblique-page-"));
    this.database = join(this.folder, "page.db");
  }

  async start(...flags) {
    this.process = spawn(this.oblique, ["view", this.database, "--port", "0", ...flags], { stdio: ["ignore", "pipe", "pipe"] });
    this.said = "";
    this.process.stderr.on("data", (text) => { this.said += text; });
    this.address = await new Promise((take, fail) => {
      this.process.stdout.once("data", (text) => take(String(text).trim().split("\n")[0]));
      this.process.once("exit", () => fail(new Error(`oblique view ended: ${this.said}`)));
    });
    this.origin = new URL(this.address).origin;
  }

  async stop() {
    if (this.process && this.process.exitCode === null) {
      const ended = new Promise((take) => { this.process.once("exit", take); });
      this.process.kill("SIGINT");
      await ended;
    }
    rmSync(this.folder, { recursive: true, force: true });
  }
}

/** A browser in which every objection is an entry of `objections`. */
export class Browser {
  async start(server) {
    this.server = server;
    this.objections = [];
    this.browser = await puppeteer.launch({ executablePath: process.env.OBLIQUE_CHROMIUM, timeout: kHangs_ms, protocolTimeout: kHangs_ms,
      args: ["--disable-gpu", "--disable-dev-shm-usage", ...(process.getuid() === 0 ? ["--no-sandbox"] : [])] });
    const first = await this.#tab();
    await first.goto(server.address);  // the token becomes a cookie
    await first.close();
  }

  async #tab() {
    const page = await this.browser.newPage();
    page.setDefaultTimeout(kHangs_ms);
    return page;
  }

  /**
   * A tab at a view; `early` runs in it before all scripts of the page; where it is hurried no timer of the page takes long;
   * `expected` are lines of the console that are no objections.
   */
  async open(view, { width = 1280, scheme = "light", motion = "no-preference", is_hurried = false, expected = /^$/, early = () => {} } = {}) {
    const page = await this.#tab();
    await this.look(page, { width, scheme, motion });
    page.on("console", (line) => {
      if (["error", "warn"].includes(line.type()) && !expected.test(line.text())) this.objections.push(`${view}: console: ${line.text()}`);
    });
    page.on("pageerror", (error) => this.objections.push(`${view}: ${error.message}`));
    page.on("request", (request) => {
      const url = request.url();
      if (!url.startsWith(this.server.origin) && !/^(data|blob):/.test(url)) this.objections.push(`${view}: asks ${url}`);
    });
    await page.exposeFunction("objected", (text) => this.objections.push(`${view}: ${text}`));
    await page.evaluateOnNewDocument(() => {
      document.addEventListener("securitypolicyviolation", (event) => window.objected(`policy: ${event.violatedDirective} ${event.blockedURI}`));
      const Real = window.EventSource;
      window.open_streams = 0;
      window.EventSource = class extends Real {
        constructor(url) {
          super(url);
          ++window.open_streams;
        }
        close() {
          --window.open_streams;
          super.close();
        }
      };
    });
    if (is_hurried) {
      await page.evaluateOnNewDocument(() => {
        const real = window.setTimeout;
        window.setTimeout = (call, ms, ...given) => real(call, Math.min(ms ?? 0, 50), ...given);
      });
    }
    await page.evaluateOnNewDocument(early);
    await page.goto(`${this.server.origin}/${view}`);
    return page;
  }

  /** In what window, and by whose taste, a tab is looked at. */
  async look(page, { width, scheme, motion }) {
    await page.setViewport({ width, height: 900 });
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }, { name: "prefers-reduced-motion", value: motion }]);
  }

  /** What axe-core finds wrong with what a tab shows. */
  async faults(page) {
    if (!await page.evaluate(() => "axe" in window)) await page.evaluate(axe_source);
    return page.evaluate(async () => (await window.axe.run(document, { resultTypes: ["violations"] })).violations.map((one) =>
      `${one.id}: ${one.nodes.slice(0, 3).map((node) => node.html.slice(0, 120)).join(" | ")}`));
  }

  stop() {
    return this.browser?.close();
  }
}

/** Waits until `look` in the tab gives something, and gives that. It may fail as long as what it looks at is not there. */
export async function until(page, look, ...given) {
  let fault;
  for (const end = Date.now() + kHangs_ms; Date.now() < end; await new Promise((go_on) => setTimeout(go_on, 50))) {
    const found = await page.evaluate(look, ...given).catch((error) => { fault = error; });
    if (found) return found;
  }
  throw new Error(`it did not come to: ${look}`, { cause: fault });
}

export const text_of = (page, selector) => page.$eval(selector, (one) => one.textContent);
