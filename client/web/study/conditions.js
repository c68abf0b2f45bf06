// @ts-check
// Conditions of the query language: which points are looked at, and which are marked. Both stand in the address.
import { h, named } from "/parts/dom.js";
import { count } from "/parts/format.js";
import { rows, Silence } from "/server.js";

/** All of them. @param {...string} conditions those that are empty say nothing */
export function joined(...conditions) {
  const said = conditions.filter((one) => one !== "");
  return said.length > 1 ? said.map((one) => (/\bor\b/i.test(one) ? `(${one})` : one)).join(" AND ") : said[0] ?? "";
}

/** @param {string} column @param {string | number} [from] @param {string | number} [to] empty: no end */
export function within(column, from = "", to = "") {
  return joined(from === "" ? "" : `${column} >= ${from}`, to === "" ? "" : `${column} <= ${to}`);
}

/** The column of queries that an axis is. @param {string} key */
export function column_of(key) {
  const link = /^length([1-9]\d*)$/.exec(key);
  return key === "E" ? "E_Pa" : link ? `lengths_m[${Number(link[1]) - 1}]` : key;
}

/** The number with the fewest digits between two. @param {number} a @param {number} b */
function short_between(a, b) {
  const [least, most] = [Math.min(a, b), Math.max(a, b)];
  for (let digits = 1; digits < 17; ++digits) {
    const tried = Number(((least + most) / 2).toPrecision(digits));
    if (tried > least && tried < most) return tried;
  }
  return (least + most) / 2;
}

/** A value as a part of what is shown is cut off: 500 steps are fine enough, of itself where logarithmic scales are finer at their foot. @param {number} value @param {number} width */
export function rounded(value, width) {
  if (!(width > 0)) return value;
  const step = 10 ** Math.floor(Math.log10(Math.min(width, Math.abs(value) * 2 || width) / 500));
  return Number((Math.round(value / step) * step).toPrecision(12));
}

/**
 * The part of a side that a rectangle spans, as a condition.
 * @param {import("./pictures.js").Side} side @param {number[]} cells first and last, any way round
 * @param {number[]} values where the rectangle ends
 */
export function part_of(side, cells, values) {
  const column = column_of(side.name);
  if (side.edges) {
    const width = side.edges[side.edges.length - 1] - side.edges[0];
    return within(column, rounded(Math.min(...values), width), rounded(Math.max(...values), width));
  }
  const sorted = Array.from(side.values).sort((a, b) => a - b);
  if (sorted.length < 2) return "";
  const places = cells.map((i) => sorted.indexOf(side.values[i]));
  const [first, last] = [Math.min(...places), Math.max(...places)];
  if (first === 0 && last === sorted.length - 1 && side.is_whole) return "";
  const before = first > 0 ? sorted[first - 1] : sorted[0] - (sorted[1] - sorted[0]);
  const after = last + 1 < sorted.length ? sorted[last + 1] : 2 * sorted[last] - sorted[last - 1];
  return within(column, short_between(before, sorted[first]), short_between(sorted[last], after));
}

/**
 * Fields for both, how many points meet them, and what the language objects to.
 * @param {import("./study.js").StudyView} view
 */
export function condition_fields(view) {
  const field = (/** @type {"where" | "mark"} */ name, /** @type {string} */ title, /** @type {string} */ hint) => {
    const said = h("p", { role: "status", class: "weak said", id: `said-${name}` });
    const input = h("input", { type: "search", value: view.is(name), placeholder: hint, spellcheck: false, autocomplete: "off", "aria-describedby": said.id,
      onchange: () => take(), onkeydown: (/** @type {KeyboardEvent} */ event) => { if (event.key === "Enter") take(); } });
    const take = () => { if (input.value.trim() !== view.is(name)) view.marking.change({ [name]: input.value.trim() }); };
    return { said, input, label: named(title, input), counted: "\0" };
  };
  const where = field("where", "only points where (as with --where)", "mu > 0.5 AND fn_peak_N > 20");
  const mark = field("mark", "marked points", "drag over the picture, or write a condition");
  const keep = h("button", { type: "button", onclick: () => view.marking.keep() }, "Keep only these");
  const clear = h("button", { type: "button", onclick: () => view.marking.change({ mark: "" }) }, "Mark none");
  const marks = h("div", { class: "marks" }, h("div", { class: "row" }, mark.label, keep, clear), mark.said);
  /** @type {AbortController | null} */
  let asked = null;

  /** @param {typeof where} of @param {string} condition @param {(n: number) => string} tell @param {AbortSignal} signal */
  async function count_points(of, condition, tell, signal) {
    of.input.setAttribute("aria-invalid", "false");
    of.said.className = "weak said";
    if (condition === "") {
      of.said.textContent = "";
      return;
    }
    try {
      const answer = await rows(view.study.id, { where: condition, select: "count(*)", limit: 1 }, signal);
      of.said.textContent = tell(Number(answer.rows[0]?.[0] ?? 0));
    } catch (error) {
      if (/** @type {any} */ (error).status === 503) of.said.textContent = "Counting the points that meet it takes too long.";
      else if (!signal.aborted) wrong(of, String(/** @type {Error} */ (error).message));
    }
  }
  let last_told = Promise.resolve();
  const wrong = (/** @type {typeof where} */ of, /** @type {string} */ sentence) => {
    of.input.setAttribute("aria-invalid", "true");
    of.said.className = "bad said";
    of.said.textContent = sentence;
  };
  /** Shows what the address says. @param {boolean} [is_again] results came in between */
  const tell = (is_again = false) => (last_told = tell_both(is_again));
  async function tell_both(/** @type {boolean} */ is_again) {
    for (const [name, one] of /** @type {["where" | "mark", typeof where][]} */ ([["where", where], ["mark", mark]])) {
      if (document.activeElement !== one.input || !is_again) one.input.value = view.is(name);
    }
    const has_mark = view.is("mark") !== "";
    keep.hidden = clear.hidden = !has_mark;
    const wanted = JSON.stringify([view.is("where"), view.is("mark")]);
    if (wanted === where.counted && !is_again) return;
    where.counted = wanted;
    asked?.abort();
    const { signal } = asked = new AbortController();
    await count_points(where, view.is("where"), (n) => `${count(n)} ${n === 1 ? "point that has a result meets" : "points that have a result meet"} it.`, signal);
    const both = has_mark ? joined(view.is("where"), view.is("mark")) : "";
    if (!signal.aborted) await count_points(mark, both, (n) => `${count(n)} ${n === 1 ? "point is" : "points are"} marked.`, signal);
  }
  return { element: h("div", { class: "conditions" }, h("div", {}, where.label, where.said), marks), tell,
    /** Whether one of them is refused, and its field says why. */
    async is_wrong() {
      await last_told;
      return [where, mark].some((one) => one.input.getAttribute("aria-invalid") === "true");
    },
    close: () => asked?.abort() };
}
