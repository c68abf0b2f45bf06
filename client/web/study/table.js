// @ts-check
// Rows of a study, a page at a time.
import { h, keep_focus, tick } from "/parts/dom.js";
import { count, heading, shown } from "/parts/format.js";
import { rows, rows_path, Silence } from "/server.js";
import { joined } from "./conditions.js";

const kPage = 25;
/** Pages are cut from what is asked for in order; beyond that a file is the better way. */
const kDeepest = 10_000;
const kMostInFile = 100_000;

/**
 * @typedef {{study: number, points: number, columns: () => string[], where: () => string, marked: () => string, all: () => boolean, keep_all: (all: boolean) => void, wrong: (error: any) => void,
 *   chosen: (point: number) => void, order: () => string, keep_order: (order: string) => void, page: () => number, keep_page: (page: number) => void}} Of pages count from 0
 */

/** @param {Of} of */
export const row_table = (of) => new RowTable(of);

/** Names of columns, which sort. @param {any} answer @param {string} order @param {(column: string) => void} sort */
function head_of(answer, order, sort) {
  return h("thead", {}, h("tr", {}, ...answer.columns.map((/** @type {string} */ name, /** @type {number} */ i) => {
    const sign = order === name ? " ▲" : order === `${name} DESC` ? " ▼" : "";
    return h("th", { scope: "col", class: answer.rows.some((/** @type {any} */ row) => typeof row[i] === "number") ? "number" : "",
      "aria-sort": order === name ? "ascending" : order === `${name} DESC` ? "descending" : "none" },
    h("button", { type: "button", class: "plain", onclick: () => sort(name) }, heading(name, answer.units[i]) + sign));
  })));
}

/** Rows that begin with their point. @param {Of} of @param {any[][]} rows */
function body_of({ study, chosen }, rows) {
  const text = (/** @type {any} */ value) => (typeof value === "number" ? shown(value) : value ?? "–");
  return h("tbody", {}, ...rows.map((row) => h("tr", { "data-point": row[0], onclick: () => chosen(row[0]) },
    ...row.map((value, i) => h("td", { class: typeof value === "number" ? "number" : "" },
      i === 0 ? h("a", { href: `#/study/${study}/point/${value}` }, count(value)) : text(value))))));
}

/** Which rows are shown, of how many. @param {number} first @param {number} some @param {boolean} are_out_of_reach the rows behind them @param {number | null} total null: not known */
function range_text(first, some, are_out_of_reach, total) {
  const range = some > 0 ? `${count(first + 1)} to ${count(first + some)}` : "None";
  const tail = are_out_of_reach ? " Further rows are in the CSV or asked for by a narrower filter." : "";
  if (total === null) return `${range}.${tail}`;
  const cut = total > kMostInFile ? ` The CSV has the first ${count(kMostInFile)}; oblique query gives all.` : "";
  return `${range} of ${count(total)} rows.${tail}${cut}`;
}

/** @param {HTMLButtonElement} button */
function focus_on(button) {
  button.disabled = false;
  button.focus({ preventScroll: true });
}

class RowTable {
  /** @type {AbortController | null} */
  #asked = null;
  /** How many meet the filter; null: not known. @type {number | null} */
  #total = null;
  /** The filter that it is of. */
  #counted = "\0";
  /** Other points have results since. */
  #is_old = false;
  #chosen = -1;
  /** @type {number[]} */
  #points_here = [];

  /** @param {Of} of */
  constructor(of) {
    this.of = of;
    this.said = h("p", { role: "status", class: "weak" });
    this.table = h("table", {}, h("caption", { class: "unseen" }, "Points of the study"));
    this.back = h("button", { type: "button", onclick: () => this.#turn(-1) }, "Previous");
    this.next = h("button", { type: "button", onclick: () => this.#turn(1) }, "Next");
    this.file = h("a", { class: "button", download: "rows.csv" }, "Table as CSV");
    this.only = h("div", { class: "only" }, tick("marked points only", true, (is) => {
      of.keep_all(!is);
      this.begin();
    }));
    this.element = h("section", { class: "rows" }, h("h2", {}, "Points"), this.only,
      h("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": "Points" }, this.table),
      h("div", { class: "row" }, this.back, this.next, this.file), this.said);
  }

  /** Which points are shown. */
  condition() {
    return joined(this.of.where(), this.of.all() ? "" : this.of.marked());
  }
  /** From the first page. */
  begin() {
    if (this.of.page() > 0) this.of.keep_page(0);
    this.load();
  }
  /** Other points have results now. */
  async again() {
    this.#is_old = true;
    if (!this.element.contains(document.activeElement)) await this.load();
  }
  /** Marks the row of a point. @param {number} point */
  choose(point) {
    this.#chosen = point;
    this.#show_chosen();
  }
  close() {
    this.#asked?.abort();
  }

  async load() {
    this.#asked?.abort();
    const { signal } = this.#asked = new AbortController();
    const first = Math.min(this.of.page(), kDeepest / kPage - 1) * kPage;
    const asked = { where: this.condition(), order: this.of.order() || "point", select: this.of.columns().join(",") };
    if (this.#counted !== asked.where) this.#forget_total();
    this.only.hidden = this.of.marked() === "";
    this.only.querySelector("input").checked = !this.of.all();
    this.file.href = rows_path(this.of.study, { ...asked, limit: kMostInFile, format: "csv" });
    try {
      await this.#show(await rows(this.of.study, { ...asked, limit: first + kPage + 1 }, signal), first, signal);
    } catch (error) {
      if (signal.aborted) return;
      if (!(error instanceof Silence)) {
        this.table.replaceChildren(this.table.caption ?? "");
        this.said.textContent = "";
      }
      this.of.wrong(error);
    }
  }

  /** What was answered; how many rows there are and which of these are marked comes later. @param {any} answer @param {number} first row of the page @param {AbortSignal} signal */
  async #show(answer, first, signal) {
    const some = answer.rows.slice(first, first + kPage);
    const has_more = answer.rows.length > first + kPage;
    const is_deepest = first + 2 * kPage > kDeepest;
    const head = head_of(answer, this.of.order(), (column) => this.#sort(column));
    const body = body_of(this.of, some);
    keep_focus(this.table, () => this.table.replaceChildren(this.table.caption ?? "", head, body));
    this.#points_here = some.map((/** @type {any[]} */ row) => row[0]);
    this.#show_chosen();
    const marked = this.#show_marked(signal).catch(() => {});
    this.#let_turn(first === 0, !has_more || is_deepest);
    const say = () => {
      this.said.textContent = range_text(first, some.length, has_more && is_deepest, this.#total);
    };
    say();
    await this.#count(signal);
    say();
    await marked;
  }
  /** What is pressed and leads nowhere leaves the focus to the other one. @param {boolean} at_begin @param {boolean} at_end */
  #let_turn(at_begin, at_end) {
    if (document.activeElement === this.back && at_begin) focus_on(this.next);
    if (document.activeElement === this.next && at_end) focus_on(this.back);
    this.back.disabled = at_begin;
    this.next.disabled = at_end;
  }
  #turn(/** @type {number} */ by) {
    this.of.keep_page(Math.max(this.of.page() + by, 0));
    this.load();
  }
  /** Sorts by a column, then the other way round, then by number again. @param {string} column */
  #sort(column) {
    const order = this.of.order();
    this.of.keep_order(order === column ? `${column} DESC` : order === `${column} DESC` ? "" : column);
    this.begin();
  }

  /** Counting may be given up. */
  #forget_total() {
    this.#total = null;
    this.#counted = "\0";
  }
  async #count(/** @type {AbortSignal} */ signal) {
    const where = this.condition();
    if (this.#counted === where && !this.#is_old) return;
    const answer = await rows(this.of.study, { where, select: "count(*)", limit: 1 }, signal);
    this.#total = Number(answer.rows[0]?.[0] ?? 0);
    this.#counted = where;
    this.#is_old = false;
  }

  /** @param {string} look @param {(point: number) => boolean} is */
  #look(look, is) {
    for (const row of this.table.querySelectorAll("tr[data-point]")) row.classList.toggle(look, is(Number(row.dataset.point)));
  }
  #show_chosen() {
    this.#look("chosen", (point) => point === this.#chosen);
  }
  /** Which of the rows that are shown are marked. @param {AbortSignal} signal */
  async #show_marked(signal) {
    const marked = this.of.marked();
    if (marked === "" || this.#points_here.length === 0) return;
    const all = !this.of.all() ? this.#points_here
      : (await rows(this.of.study, { select: "point", where: joined(`point IN (${this.#points_here.join(",")})`, marked), limit: kPage }, signal))
        .rows.map((/** @type {number[]} */ row) => row[0]);
    this.#look("marked", (point) => all.includes(point));
  }
}
