// @ts-check
// The row of a point, with units and meanings.
import { h } from "/parts/dom.js";
import { shown } from "/parts/format.js";

const kProvenance = ["status", "error", "solver_version", "integrator", "instruction_set", "elements_per_link", "tolerance", "dt_s", "steps",
  "wall_s", "closure", "worker_name", "worker_id", "attempt", "solved_at", "reused_from", "model_id"];

/** A list, which a row has as JSON. @param {string} text */
function list_of(text) {
  try {
    return JSON.parse(text);
  } catch {
    return ` ${text}`;  // an error may begin as a list does
  }
}

/** @param {any} value */
function text_of(value) {
  if (value === null || value === undefined) return "–";
  if (typeof value === "number") return shown(value, 7);
  if (typeof value === "string" && value.startsWith("[")) return text_of(list_of(value));
  if (Array.isArray(value)) return value.map((one) => (Array.isArray(one) ? `[${one.map(text_of).join(", ")}]` : text_of(one))).join(", ");
  return String(value);
}

/** Browsers break lines behind hyphens, also in numbers with an exponent and in instants. @param {string} text */
const in_one_piece = (text) => text.split(/(\S*\d(?:e-|T)\d\S*)/).map((part, i) => (i % 2 === 1 ? h("span", { class: "whole" }, part) : part));

/** @param {string} caption @param {[string, string, string, string][]} lines */
function table(caption, lines) {
  return h("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": caption }, h("table", { class: "values" },
    h("caption", {}, caption), h("thead", {}, h("tr", {}, ...["name", "value", "unit", "meaning"].map((head) => h("th", { scope: "col" }, head)))),
    h("tbody", {}, ...lines.map(([name, value, unit, meaning]) => h("tr", {}, h("th", { scope: "row" }, name),
      h("td", { class: "value" }, ...in_one_piece(value)), h("td", {}, unit), h("td", { class: "weak meaning" }, meaning))))));
}

/** @param {any} row @param {any[]} columns */
export function point_numbers(row, columns) {
  const of = (/** @type {(column: any) => boolean} */ wanted) => columns.filter((c) => c.name in row && wanted(c))
    .map((c) => /** @type {[string, string, string, string]} */ ([c.name, text_of(row[c.name]), c.unit === "1" ? "" : c.unit, c.meaning]));
  const is_origin = (/** @type {any} */ c) => kProvenance.includes(c.name);
  return h("section", {}, h("h2", {}, "Numbers"),
    table("Outputs", of((c) => c.kind === "output" && !is_origin(c) && row[c.name] !== null)),
    table("Where they come from", of(is_origin)),
    table("Inputs and model", of((c) => c.kind === "input" && !is_origin(c))));
}
