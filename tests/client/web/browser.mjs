// Starts a server for a database, and a browser that records errors.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

const need = createRequire(join(process.env.OBLIQUE_NODE_MODULES, "x"));
const puppeteer = need("puppeteer-core");
const axeSource = need("axe-core").source;

/** Longest time that a test waits for an event. It only ends tests that hang. */
const hangMs = 300_000;

/** Runs `oblique view` on a database until `stop` is called. */
export class Server {
  constructor(oblique) {
    this.oblique = oblique;
    this.folder = mkdtempSync(join(tmpdir(), "oblique-page-"));
    this.database = join(this.folder, "page.db");
  }

  async start() {
    const args = ["view", this.database, "--port", "0"];
    this.process = spawn(this.oblique, args, { stdio: ["ignore", "pipe", "pipe"] });
    let said = "";
    this.process.stderr.on("data", (text) => (said += text));
    this.address = await new Promise((resolve, reject) => {
      this.process.stdout.once("data", (text) => resolve(String(text).trim().split("\n")[0]));
      this.process.once("exit", () => reject(new Error(`oblique view ended: ${said}`)));
    });
    this.origin = new URL(this.address).origin;
  }

  async stop() {
    if (this.process?.exitCode === null) {
      const ended = new Promise((resolve) => this.process.once("exit", resolve));
      this.process.kill("SIGINT");
      await ended;
    }
    rmSync(this.folder, { recursive: true, force: true });
  }
}

/** A browser that adds every error of its pages to `errors`. */
export class Browser {
  errors = [];

  async start(server) {
    this.server = server;
    const sandbox = process.getuid() === 0 ? ["--no-sandbox"] : [];
    this.browser = await puppeteer.launch({
      executablePath: process.env.OBLIQUE_CHROMIUM,
      timeout: hangMs,
      protocolTimeout: hangMs,
      args: ["--disable-gpu", "--disable-dev-shm-usage", ...sandbox],
    });
    const first = await this.#tab();
    await first.goto(server.address); // sets a cookie from the token in the address
    await first.close();
  }

  async #tab() {
    const page = await this.browser.newPage();
    page.setDefaultTimeout(hangMs);
    return page;
  }

  /**
   * Opens a tab with a view. `early` runs before the page's scripts. `isHurried` shortens timers of
   * the page. Console lines that match `expected` are not errors.
   */
  async open(view, { isHurried = false, expected = /^$/, early = () => {}, ...look } = {}) {
    const page = await this.#tab();
    await this.look(page, look);
    const addError = (text) => this.errors.push(`${view}: ${text}`);
    page.on("console", (line) => {
      const isBad = ["error", "warn"].includes(line.type()) && !expected.test(line.text());
      if (isBad) addError(`console: ${line.text()}`);
    });
    page.on("pageerror", (error) => addError(error.stack));
    page.on("request", (request) => {
      const url = request.url();
      if (!/^(data|blob):/.test(url) && !url.startsWith(this.server.origin)) addError(url);
    });
    await page.exposeFunction("reportViolation", addError);
    await page.evaluateOnNewDocument((hurried) => {
      document.addEventListener("securitypolicyviolation", ({ violatedDirective, blockedURI }) =>
        window.reportViolation(`policy: ${violatedDirective} ${blockedURI}`),
      );
      const real = window.setTimeout;
      if (!hurried) return;
      window.setTimeout = (call, ms, ...given) => real(call, Math.min(ms ?? 0, 50), ...given);
    }, isHurried);
    await page.evaluateOnNewDocument(early);
    await page.goto(`${this.server.origin}/${view}`);
    return page;
  }

  /** Sets the window size of a tab, and the reader's preferences for colour scheme and motion. */
  async look(page, { width = 1400, height = 900, scheme = "light", motion = "reduce" }) {
    await page.setViewport({ width, height });
    await page.emulateMediaFeatures([
      { name: "prefers-color-scheme", value: scheme },
      { name: "prefers-reduced-motion", value: motion },
    ]);
  }

  /** Returns the accessibility errors that axe-core finds in a tab. */
  async faults(page) {
    if (!(await page.evaluate(() => "axe" in window))) await page.evaluate(axeSource);
    return page.evaluate(async () => {
      const { violations } = await window.axe.run(document, { resultTypes: ["violations"] });
      const html = (nodes) => nodes.map((node) => node.html.slice(0, 120)).join(" | ");
      return violations.map(({ id, nodes }) => `${id}: ${html(nodes.slice(0, 3))}`);
    });
  }

  stop() {
    return this.browser?.close();
  }
}

/** Calls `look` in the tab until it returns a value, and returns the value. Ignores exceptions. */
export async function until(page, look, ...given) {
  let cause;
  for (const end = Date.now() + hangMs; Date.now() < end;) {
    const found = await page.evaluate(look, ...given).catch((error) => (cause = error) && null);
    if (found) return found;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  throw new Error(`timeout while waiting for: ${look}`, { cause });
}
