// @ts-check
// What a study's recipe says about its axes.

/**
 * @typedef {{key: string, unit: string, meaning: string, values: number, list?: number[], stride: number,
 *   range?: {from: number, to: number, count: number, spacing: string}, expression?: string, distribution?: object}} Axis
 * @typedef {{kind: string, first_point: number, points: number, where: string, axes: Axis[]}} Block
 */

/** Axes of a grid that have values of their own. @param {Block} block */
export function own_axes(block) {
  return block.kind === "grid" ? block.axes.filter((axis) => !axis.expression && !axis.distribution) : [];
}

/** Those that vary. @param {Block} block */
export const varying = (block) => own_axes(block).filter((axis) => axis.values > 1);

/** Value `i` of an axis; undefined where the server did not list it. @param {Axis} axis @param {number} i */
export function axis_value(axis, i) {
  if (axis.list) return axis.list[i];
  const range = axis.range;
  if (!range) return undefined;
  if (range.count === 1) return range.from;
  const share = i / (range.count - 1);
  if (i === range.count - 1) return range.to;
  return range.spacing === "log" ? range.from * (range.to / range.from) ** share : range.from + share * (range.to - range.from);
}

/** The block that shows most, and the axes that people look at first. @param {Block[]} blocks */
export function usual_block(blocks) {
  let best = -1;
  blocks.forEach((block, i) => {
    if (varying(block).length > 0 && (best < 0 || block.points > blocks[best].points)) best = i;
  });
  return best;
}

/** @param {Block} block @returns {[string, string]} */
export function usual_axes(block) {
  const keys = varying(block).map((axis) => axis.key);
  const x = keys.includes("mu") ? "mu" : keys.at(-1) ?? "";
  const others = keys.filter((key) => key !== x);
  return [x, others.includes("H") ? "H" : others[0] ?? ""];
}

/**
 * Between which values points are solved while one looks, as the address says it: "mu:0.1:2,H:0.3:1.1:log".
 * @typedef {Record<string, {from: number, to: number, is_log: boolean}>} Ranges of the two axes of a map
 */

/** @param {Ranges} ranges */
export const between_text = (ranges) => Object.entries(ranges).map(([key, { from, to, is_log }]) => `${key}:${from}:${to}${is_log ? ":log" : ""}`).join(",");

/** @param {string} text @returns {Ranges | null} null: it is no such text */
export function ranges_of(text) {
  const all = text.split(",").map((one) => one.split(":"));
  const is_one = (/** @type {string[]} */ [key, from, to, log]) => key && from && to && Number.isFinite(Number(from)) && Number(from) <= Number(to)
    && Number.isFinite(Number(to)) && (log === undefined || (log === "log" && Number(from) > 0));
  if (all.length !== 2 || !all.every(is_one) || all[0][0] === all[1][0]) return null;
  return Object.fromEntries(all.map(([key, from, to, log]) => [key, { from: Number(from), to: Number(to), is_log: log === "log" }]));
}

const kOfGrids = ["map", "lines"];
const kPictures = [...kOfGrids, "gathered", "histogram"];

/** Fills in what an address leaves open, and mends what does not fit the study. @param {URLSearchParams} fields @param {any} study */
export function fill_in(fields, study) {
  const is = (/** @type {string} */ name) => fields.get(name) ?? "";
  const numbers = study.columns.filter((/** @type {any} */ c) => c.picture === "numbers");
  const usual = usual_block(study.blocks);
  if (!kPictures.includes(is("pic")) || (kOfGrids.includes(is("pic")) && usual < 0)) fields.delete("pic");
  if (!is("pic")) fields.set("pic", usual >= 0 ? (varying(study.blocks[usual]).length > 1 ? "map" : "lines") : "gathered");
  if (kOfGrids.includes(is("pic"))) {
    const asked = study.blocks[Number(is("block") || usual)];
    const block = asked && varying(asked).length > 0 ? asked : study.blocks[usual];
    fields.set("block", String(study.blocks.indexOf(block)));
    const keys = varying(block).map((a) => a.key);
    const [x, y] = usual_axes(block);
    if (!keys.includes(is("x"))) fields.set("x", x);
    if (is("y") && !keys.includes(is("y"))) fields.delete("y");
    if (is("y") === is("x")) fields.delete("y");
    if (!is("y") && is("pic") === "map") {
      const other = [y, ...keys].find((key) => key && key !== is("x"));
      if (other) fields.set("y", other);
      else fields.set("pic", "lines");
    }
  } else {
    const has = (/** @type {string} */ name) => numbers.some((/** @type {any} */ c) => c.name === name);
    if (!has(is("x"))) fields.set("x", is("pic") === "histogram" ? "fn_peak_N" : "mu");
    if (is("pic") === "gathered" && !has(is("y"))) fields.set("y", "H");
  }
  const ranges = is("pic") === "map" ? ranges_of(is("between")) : null;
  if (!ranges || !ranges[is("x")] || !ranges[is("y")]) fields.delete("between");
  const is_there = study.columns.some((/** @type {any} */ c) => c.name === is("z") && c.picture !== "none");
  if (!is_there && !(is("pic") === "gathered" && fields.has("z"))) fields.set("z", "fn_peak_N");
  if (is("pic") !== "map" && study.columns.find((/** @type {any} */ c) => c.name === is("z"))?.picture === "categories") fields.set("z", "fn_peak_N");
}
