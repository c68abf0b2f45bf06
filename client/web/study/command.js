// @ts-check
// A view as the server's picture of it, and as the commands that make it.
import { quoted } from "/parts/format.js";
import { column_of, joined, within } from "./conditions.js";

/**
 * @typedef {import("./study.js").StudyView} View
 * @typedef {Record<string, string>} Fields of `picture`, as server/web/page has them; empty ones are left out
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

/** @param {View} view @returns {Fields} */
export function picture_fields(view) {
  const is = (/** @type {string} */ name) => view.is(name);
  const kind = is("pic") === "gathered" ? "scatter" : is("pic");
  const [on_grid, has_map] = [kind === "map" || kind === "lines", view.has_map];
  const held = on_grid ? view.picture?.head.at ?? [] : [];
  const at = held.filter((/** @type {any} */ one) => one.of > 1);
  // Of several blocks each may hold a key at another value, and --at takes one of the first that has it.
  const has_blocks = view.study.blocks.length > 1;
  const of_block = has_blocks ? held.map((/** @type {any} */ one) => `${column_of(one.key)} = ${one.value}`) : [];
  const has_range = has_map && is("from") !== "" && is("to") !== "";
  return { kind, z: kind === "histogram" ? "" : is("z"), x: is("x"), y: has_map ? is("y") : "", by: kind === "lines" ? is("y") : "",
    at: has_blocks ? "" : at.map((/** @type {any} */ one) => `${one.key}:${one.value}`).join(","),
    where: joined(is("where"), ...of_block, ...zoomed(view)),
    xlog: is("xlog"), ylog: kind === "histogram" ? "" : is("ylog"), zlog: has_map ? is("zlog") : "",
    from: has_range ? is("from") : "", to: has_range ? is("to") : "", palette: has_map ? is("pal") : "" };
}

/** The same as flags of oblique plot. @param {Fields} of @returns {[string, string][]} */
function flags(of) {
  const found = /** @type {[string, string][]} */ (of.kind === "scatter" ? [["scatter", `${of.x},${of.y}`], ["colour", of.z]]
    : of.kind === "histogram" ? [["histogram", of.x]] : [[of.kind, of.z], ["x", of.x], ["y", of.y], ["by", of.by]]);
  for (const one of of.at.split(",")) found.push(["at", one.replace(":", "=")]);
  found.push(["where", of.where], ["range", of.from && `${of.from}:${of.to}`], ["palette", of.palette]);
  return found.filter(([, value]) => value !== "");
}

/** @param {View} view */
export function plot_command(view) {
  const of = picture_fields(view);
  const ticks = [["xlog", "--log-x"], ["ylog", "--log-y"], ["zlog", "--log-colour"]].filter(([name]) => of[name]).map(([, flag]) => flag);
  return ["oblique plot", quoted(view.study.name), ...flags(of).map(([flag, value]) => `--${flag} ${quoted(value)}`), ...ticks, "--out picture.svg"].join(" ");
}

/** @param {View} view */
export function query_command(view) {
  const where = view.table.condition();
  return ["oblique query", quoted(view.study.name), "--select", view.row_columns().join(","), ...(where ? ["--where", quoted(where)] : []),
    ...(view.is("order") ? ["--order", quoted(view.is("order"))] : [])].join(" ");
}
