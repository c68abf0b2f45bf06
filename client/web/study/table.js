// @ts-check
// Rows of a study, a page at a time.
import { h, keep_focus, tick } from "/parts/dom.js";
import { file_link, file_sayer } from "/parts/file_link.js";
import { count, heading, shown } from "/parts/format.js";
import { Silence } from "/server.js";
import { rows, rows_path } from "./asked/picture.js";
import { joined } from "./conditions.js";

const kPage = 25;
/** Pages are cut from what is asked for in order; beyond that a file is the better way. */
const kDeepest = 10_000;
const kMostInFile = 100_000;

/**
 * @param {{study: number, points: number, columns: () => string[], where: () => string, marked: () => string, all: () => boolean, keep_all: (all: boolean) => void, wrong: (error: any) => void,
 *   chosen: (point: number) => void, order: () => string, keep_order: (order: string) => void, page: () => number, keep_page: (page: number) => void}} of pages count from 0
 */
export function row_table(of) {
  const said = h("p", { role: "status", class: "weak" });
  const table = h("table", {}, h("caption", { class: "unseen" }, "Points of the study"));
  const back = h("button", { type: "button", onclick: () => turn(-1) }, "Previous");
  const next = h("button", { type: "button", onclick: () => turn(1) }, "Next");
  const { said: said_of_file, say: say_of_file } = file_sayer();
  const file = file_link("Table as CSV", "rows.csv", "", say_of_file);
  const only = h("div", { class: "only" }, tick("marked points only", true, (is) => {
    of.keep_all(!is);
    begin();
  }));
  const only_box = /** @type {HTMLInputElement} */ (only.querySelector("input"));
  const element = h("section", { class: "rows" }, h("h2", {}, "Points"), only,
    h("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": "Points" }, table),
    h("div", { class: "row" }, back, next, file, said_of_file), said);
  /** @type {AbortController | null} */
  let asked = null;
  /** How many meet the filter; null: not known. @type {number | null} */
  let total = null;
  /** The filter that it is of. */
  let counted = "\0";
  /** Other points have results since. */
  let is_old = false;
  let chosen = -1;
  /** @type {number[]} */
  let points_here = [];

  function focus_on(/** @type {HTMLButtonElement} */ button) {
    button.disabled = false;
    button.focus({ preventScroll: true });
  }
  function begin() {
    if (of.page() > 0) of.keep_page(0);
    load();
  }
  /** Which points are shown. */
  const condition = () => joined(of.where(), of.all() ? "" : of.marked());
  function turn(/** @type {number} */ by) {
    of.keep_page(Math.max(of.page() + by, 0));
    load();
  }
  /** Sorts by a column, then the other way round, then by number again. @param {string} column */
  function sort(column) {
    const now = of.order();
    of.keep_order(now === column ? `${column} DESC` : now === `${column} DESC` ? "" : column);
    begin();
  }

  async function count_rows(/** @type {AbortSignal} */ signal) {
    const where = condition();
    if (counted === where && !is_old) return;
    const answer = await rows(of.study, { where, select: "count(*)", limit: 1 }, signal);
    total = Number(answer.rows[0]?.[0] ?? 0);
    counted = where;
    is_old = false;
  }

  function head(/** @type {any} */ answer) {
    const now = of.order();
    return h("thead", {}, h("tr", {}, ...answer.columns.map((/** @type {string} */ name, /** @type {number} */ i) => {
      const sign = now === name ? " ▲" : now === `${name} DESC` ? " ▼" : "";
      return h("th", { scope: "col", class: answer.rows.some((/** @type {any} */ r) => typeof r[i] === "number") ? "number" : "",
        "aria-sort": now === name ? "ascending" : now === `${name} DESC` ? "descending" : "none" },
      h("button", { type: "button", class: "plain", onclick: () => sort(name) }, heading(name, answer.units[i]) + sign));
    })));
  }

  async function load() {
    asked?.abort();
    const mine = asked = new AbortController();
    const columns = of.columns();
    const page = Math.min(of.page(), kDeepest / kPage - 1);
    const where = condition();
    if (counted !== where) {
      total = null;
      counted = "\0"; // counting may be given up
    }
    only.hidden = of.marked() === "";
    only_box.checked = !of.all();
    file.href = rows_path(of.study, { where, order: of.order() || "point", select: columns.join(","), limit: kMostInFile, format: "csv" });
    try {
      const first = page * kPage;
      const answer = await rows(of.study, { where, order: of.order() || "point", select: columns.join(","), limit: first + kPage + 1 }, mine.signal);
      const some = answer.rows.slice(first, first + kPage);
      const has_more = answer.rows.length > first + kPage;
      const body = h("tbody", {}, ...some.map((/** @type {any[]} */ row) => {
        const made = h("tr", { "data-point": row[0], "aria-selected": undefined, onclick: () => of.chosen(row[0]) },
          ...row.map((value, i) => h("td", { class: typeof value === "number" ? "number" : "" },
            i === 0 ? h("a", { href: `#/study/${of.study}/point/${value}` }, count(value))
              : typeof value === "number" ? shown(value) : value ?? "–")));
        return made;
      }));
      keep_focus(table, () => table.replaceChildren(table.caption ?? "", head(answer), body));
      points_here = some.map((/** @type {any[]} */ row) => row[0]);
      mark();
      const marked = mark_rows(mine.signal).catch(() => {});
      const at_end = !has_more || first + 2 * kPage > kDeepest;
      // What is pressed and leads nowhere leaves the focus to the other one.
      if (document.activeElement === back && page === 0) focus_on(next);
      if (document.activeElement === next && at_end) focus_on(back);
      back.disabled = page === 0;
      next.disabled = at_end;
      const range = some.length > 0 ? `${count(first + 1)} to ${count(first + some.length)}` : "None";
      const tail = has_more && first + 2 * kPage > kDeepest ? " Further rows are in the CSV or asked for by a narrower filter." : "";
      said.className = "weak";
      const say = () => {
        const of_all = total === null ? "" : ` of ${count(total)} rows`;
        const cut = total !== null && total > kMostInFile ? ` The CSV has the first ${count(kMostInFile)}; oblique query gives all.` : "";
        said.textContent = `${range}${of_all}.${tail}${cut}`;
      };
      say();
      await count_rows(mine.signal);
      say();
      await marked;
    } catch (error) {
      if (mine.signal.aborted) return;
      if (!(error instanceof Silence)) {
        table.replaceChildren(table.caption ?? "");
        said.textContent = "";
      }
      of.wrong(error);
    }
  }

  /** Which of the rows that are shown are marked. @param {AbortSignal} signal */
  async function mark_rows(signal) {
    const condition_ = of.marked();
    if (condition_ === "" || points_here.length === 0) return;
    const all = !of.all() ? points_here : (await rows(of.study, { select: "point", where: joined(`point IN (${points_here.join(",")})`, condition_), limit: kPage }, signal))
      .rows.map((/** @type {number[]} */ row) => row[0]);
    for (const row of table.querySelectorAll("tr[data-point]")) row.classList.toggle("marked", all.includes(Number(/** @type {HTMLElement} */ (row).dataset.point)));
  }

  function mark() {
    for (const row of table.querySelectorAll("tr[data-point]")) {
      row.classList.toggle("chosen", Number(/** @type {HTMLElement} */ (row).dataset.point) === chosen);
    }
  }

  return { element, load, begin, condition,
    /** Other points have results now. */
    async again() {
      is_old = true;
      if (!element.contains(document.activeElement)) await load();
    },
    /** Marks the row of a point. @param {number} point */
    choose(point) {
      chosen = point;
      mark();
    },
    close: () => asked?.abort() };
}
