// The table of the points that the picture shows and that meet filter and selection, in pages.
import { rows, rowsPath } from "../api.js";
import { button, h, setChildren } from "../lib/dom.js";
import { count, heading, shown, shownUnit } from "../lib/format.js";
import { joined } from "./conditions.js";

const pageSize = 25;
const mostPages = 400;
const mostInFile = 100_000;

export class PointTable {
  #asked = new AbortController();
  #query = "";
  #chosen = null;

  constructor(view) {
    this.view = view;
    this.said = h("p", { role: "status", class: "weak" });
    this.table = h("table");
    this.back = button("Previous", () => this.#turn(-1));
    this.next = button("Next", () => this.#turn(1));
    this.file = h("a.button", { download: `${view.study.name}-points.csv` }, "Table as CSV");
    const settings = { class: "scroll", tabIndex: 0, role: "region", "aria-label": "Points" };
    this.element = h(
      "section.rows",
      h("h2", "Points"),
      h("div", settings, this.table),
      h("div.row", this.back, this.next, this.file),
      this.said,
    );
    this.table.addEventListener("click", (event) => {
      const row = event.target.closest("tr[data-point]");
      if (row) view.choose(Number(row.dataset.point));
    });
  }

  /** Returns the columns of the table: those that vary, those of the picture, the main outputs. */
  columns() {
    const { view } = this;
    const usual = view.study.usual_columns;
    const status = usual.indexOf("status");
    const shownNames = ["x", "y", "z"]
      .map((name) => view.field(name))
      .filter((name) => view.columnOf(name));
    const asksForErrors = /\b(error|status)\b/.test(`${view.field("where")} ${view.field("mark")}`);
    const state = asksForErrors ? ["status", "error"] : [];
    return [
      ...new Set([...usual.slice(0, status), ...state, ...shownNames, ...usual.slice(status + 1)]),
    ];
  }

  condition() {
    return joined(this.view.field("where"), this.view.field("mark"), ...this.view.shownParts());
  }

  /** Loads the page that the address gives, if the query or the results have changed. */
  async load(isRefresh = false) {
    const { view } = this;
    const page = Math.min(Math.max(Math.floor(Number(view.field("page"))) || 1, 1), mostPages);
    const first = (page - 1) * pageSize;
    const query = {
      where: this.condition(),
      order: view.field("order") || "point",
      select: this.columns().join(","),
    };
    const text = JSON.stringify([page, query]);
    if (text === this.#query && !isRefresh) return;
    if (isRefresh && this.element.contains(document.activeElement)) return;
    this.#query = text;
    this.#asked.abort();
    const { signal } = (this.#asked = new AbortController());
    this.file.href = rowsPath(view.study.id, { ...query, limit: mostInFile, format: "csv" });
    try {
      const answer = await rows(view.study.id, { ...query, limit: first + pageSize + 1 }, signal);
      this.#show(answer, first);
      const total = { where: query.where, select: "count(*)", limit: 1 };
      const counted = await rows(view.study.id, total, signal);
      if (!signal.aborted) this.#sayRange(first, Number(counted.rows[0]?.[0] ?? 0));
    } catch (error) {
      if (!signal.aborted) this.#fail(error);
    }
  }

  choose(point) {
    this.#chosen = point;
    for (const row of this.table.querySelectorAll("tr[data-point]")) {
      row.classList.toggle("chosen", Number(row.dataset.point) === point);
    }
  }

  close() {
    this.#asked.abort();
  }

  #fail(error) {
    this.#query = "";
    if (!error.isSilence) this.table.replaceChildren();
    this.said.textContent = "";
    // Leaves errors in a condition to the view of the study, which shows them beside the condition.
    const isOfCondition =
      error.status === 400 && (this.view.field("where") || this.view.field("mark"));
    if (!isOfCondition) this.view.complain(error);
  }

  #show({ columns, units, rows: found }, first) {
    const page = found.slice(first, first + pageSize);
    const isNumber = (i) => page.some((row) => typeof row[i] === "number");
    const kind = (i) => (isNumber(i) ? "number" : "");
    const order = this.view.field("order");
    const head = columns.map((name, i) => {
      const isDown = order === `${name} DESC`;
      const sorted = order === name ? "ascending" : isDown ? "descending" : "none";
      const sign = { ascending: " ▲", descending: " ▼", none: "" }[sorted];
      const sort = button(heading(name, units[i]) + sign, () => this.#sort(name), {
        class: "plain",
      });
      return h("th", { scope: "col", class: kind(i), "aria-sort": sorted }, sort);
    });
    const factors = columns.map((name, i) => shownUnit(name, units[i])[1]);
    const text = (value, i) =>
      typeof value === "number" ? shown(value * factors[i]) : (value ?? "–");
    const link = (point) => h("a", { href: this.view.pointAddress(point) }, count(point));
    const cell = (value, i) => h("td", { class: kind(i) }, i === 0 ? link(value) : text(value, i));
    const body = page.map((row) => h("tr", { "data-point": row[0], class: "" }, ...row.map(cell)));
    setChildren(this.table, h("thead", h("tr", ...head)), h("tbody", ...body));
    this.choose(this.#chosen);
    const hasMore = found.length > first + pageSize && first + pageSize < mostPages * pageSize;
    this.back.disabled = first === 0;
    this.next.disabled = !hasMore;
  }

  #sayRange(first, total) {
    const last = Math.min(first + pageSize, total);
    const range =
      total > 0 ? `${count(first + 1)} to ${count(last)} of ${count(total)} rows.` : "No rows.";
    const cut = total > mostInFile ? ` The CSV contains the first ${count(mostInFile)}.` : "";
    this.said.textContent = range + cut;
  }

  #turn(by) {
    const page = (Number(this.view.field("page")) || 1) + by;
    this.view.set({ page: page > 1 ? String(page) : "" });
    this.load();
  }
  /** Sorts by a column: ascending at the first call, then descending, then again by point. */
  #sort(name) {
    const next = { [name]: `${name} DESC`, [`${name} DESC`]: "" }[this.view.field("order")] ?? name;
    this.view.set({ order: next, page: "" });
    this.load();
    this.view.draw(); // redraws the commands, which contain the sort order
  }
}
