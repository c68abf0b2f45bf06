// @ts-check
// What people take with them: the picture as files, the view as a link, and the commands that make both.
import { copied, h, keep_focus, save, save_file } from "/parts/dom.js";
import { of_file, quoted } from "/parts/format.js";
import { png_of } from "/parts/png.js";
import { column_of, joined, within } from "./conditions.js";
import { cells_csv } from "./words.js";

/**
 * @typedef {import("./study.js").StudyView} View
 * @typedef {Record<string, string>} Fields what `oblique plot` is told; empty ones are left out
 */

/** The part that is zoomed into, as conditions. @param {View} view */
function zoomed(view) {
  const { picture } = view;
  if (!picture) return [];
  return [picture.x, picture.y].map((side, i) => {
    if (view.is(i === 0 ? "x0" : "y0") === "") return "";
    const ends = side.edges ? [side.edges[0], side.edges[side.edges.length - 1]] : [Math.min(...side.values), Math.max(...side.values)];
    return within(column_of(side.name), ends[0], ends[1]);
  });
}

const number_of = (/** @type {View} */ view, /** @type {string} */ name) => (view.is(name) !== "" && Number.isFinite(Number(view.is(name))) ? Number(view.is(name)) : null);

/** Whether the address says what colours span, or the vertical axis of lines. @param {View} view */
export const has_span = (view) => number_of(view, "from") !== null || number_of(view, "to") !== null;

/** What they span: an end that the address does not say is that of the picture. @param {View} view @param {import("./pictures.js").Picture} picture @returns {number[]} */
export function span_of(view, picture) {
  const [from, to] = [number_of(view, "from"), number_of(view, "to")];
  // Values are of single precision.
  const [least, most] = [picture.least ?? 0, picture.most ?? 1].map((one) => (from === to ? one : Number(one.toPrecision(7))));
  const width = most - least || Math.abs(from ?? to ?? 0) * 0.05 || 1;
  const first = from ?? (to === null || least < to ? least : to - width);
  const last = to ?? (from === null || most > from ? most : from + width);
  return first <= last ? [first, last] : [last, first];
}

/** @param {View} view @returns {Fields} */
function picture_fields(view) {
  const is = (/** @type {string} */ name) => view.is(name);
  const kind = is("pic") === "gathered" ? "scatter" : is("pic");
  const [on_grid, has_map] = [kind === "map" || kind === "lines", view.has_map];
  const at = (on_grid ? view.picture?.head.at ?? [] : []).filter((/** @type {any} */ one) => one.of > 1);
  const [from, to] = kind === "histogram" ? [is("x0"), is("x1")] : is("z") && has_span(view) && view.picture ? span_of(view, view.picture).map(String) : ["", ""];
  return { kind, z: kind === "histogram" ? "" : is("z"), x: is("x"), y: has_map ? is("y") : "", by: kind === "lines" ? is("y") : "",
    block: on_grid && view.study.blocks.length > 1 ? view.is("block") : "", at: at.map((/** @type {any} */ one) => `${one.key}:${one.value}`).join(","),
    where: joined(is("where"), ...(kind === "histogram" ? [] : zoomed(view))),
    xlog: is("xlog"), ylog: kind === "histogram" ? "" : is("ylog"), zlog: has_map ? is("zlog") : "",
    from, to };
}

/** The same as flags of oblique plot. @param {Fields} of @returns {[string, string][]} */
function flags(of) {
  const found = /** @type {[string, string][]} */ (of.kind === "scatter" ? [["scatter", `${of.x},${of.y}`], ["colour", of.z]]
    : of.kind === "histogram" ? [["histogram", of.x]] : [[of.kind, of.z], ["x", of.x], ["y", of.y], ["by", of.by]]);
  // Its number from 1 to people.
  found.push(["block", of.block && String(Number(of.block) + 1)], ...of.at.split(",").map((one) => /** @type {[string, string]} */ (["at", one.replace(":", "=")])));
  found.push(["where", of.where], ["range", of.from && `${of.from}:${of.to}`]);
  return found.filter(([, value]) => value !== "");
}

/** @param {View} view */
function plot_command(view) {
  const of = picture_fields(view);
  const ticks = [["xlog", "--log-x"], ["ylog", "--log-y"], ["zlog", "--log-colour"]].filter(([name]) => of[name]).map(([, flag]) => flag);
  return ["oblique plot", quoted(view.study.name), ...flags(of).map(([flag, value]) => `--${flag} ${quoted(value)}`), ...ticks, "--out picture.svg"].join(" ") + of_file(view.place.file);
}

/** @param {View} view */
function query_command(view) {
  const where = view.table.condition();
  return ["oblique query", quoted(view.study.name), "--select", view.row_columns().join(","), ...(where ? ["--where", quoted(where)] : []),
    ...(view.is("order") ? ["--order", quoted(view.is("order"))] : [])].join(" ") + of_file(view.place.file);
}

/** What was made for an element, before somebody copied of it. @type {WeakMap<HTMLElement, string>} */
const made_for = new WeakMap();

/**
 * Buttons stay under the finger that presses one while a study runs, and what they said, as long as they mean the same.
 * @param {HTMLElement} element @param {...HTMLElement} parts
 */
function show_parts(element, ...parts) {
  const made = parts.map((part) => part.outerHTML).join("");
  if (made_for.get(element) === made) return;
  made_for.set(element, made);
  keep_focus(element, () => element.replaceChildren(...parts));
}

/** @param {View} view */
export function show_takeaways(view) {
  if (!view.picture) return;
  show_parts(view.commands, h("p", {}, "The picture as it is shown:"), files(view),
    h("p", {}, "The same picture, as oblique plot draws it:"), copied("the command of the picture", plot_command(view)),
    h("p", {}, "The rows of the table:"), copied("the command of the rows", query_command(view)),
    h("p", { class: "weak" }, view.place.file ? "The address of this view is a link to it, as long as oblique view goes on."
      : "Add --db FILE or --server ADDRESS where the database is not oblique.db. The address of this view is a link to it."),
    link_row());
}

function link_row() {
  const said = h("span", { role: "status", class: "weak" });
  return h("div", { class: "row" }, h("button", { type: "button", onclick: async () => {
    try {
      await navigator.clipboard.writeText(location.href);
      said.textContent = "copied";
    } catch {
      said.textContent = "copy it from the address of this page";
    }
  } }, "Copy the link"), said);
}

/** What is shown, as files. @param {View} view */
function files(view) {
  const { name } = view.study;
  const png = async () => {
    const figure = view.drawing.figure();
    if (figure) save_file(`${name}.png`, await png_of([figure]));
  };
  return h("div", { class: "row files" },
    h("button", { type: "button", onclick: () => png().catch((error) => view.complain(error)) }, "PNG"),
    h("button", { type: "button", onclick: () => { if (view.picture) save(`${name}.csv`, "text/csv", cells_csv(view.picture)); } }, "CSV"));
}
