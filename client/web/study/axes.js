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
  const is_one = (/** @type {string[]} */ [key, from, to, log]) => key && from && to && Number.isFinite(Number(from)) && Number(from) < Number(to)
    && Number.isFinite(Number(to)) && (log === undefined || (log === "log" && Number(from) > 0));
  if (all.length !== 2 || !all.every(is_one) || all[0][0] === all[1][0]) return null;
  return Object.fromEntries(all.map(([key, from, to, log]) => [key, { from: Number(from), to: Number(to), is_log: log === "log" }]));
}

/** Whole numbers, words and lists are no axes of a map; of the rest of these only the accuracy depends. */
const kNotAsked = ["links", "elements_per_link", "integrator", "lengths", "spectral_radius", "dt", "dt_fall", "tolerance"];

/**
 * Keys that a block does not vary, with the value at which it holds them: what lies along them can be solved all the same.
 * @param {any} study @param {Block | undefined} block @returns {{key: string, unit: string, meaning: string, value: number}[]}
 */
export function unvaried(study, block) {
  if (block?.kind !== "grid") return [];
  const single = own_axes(block).filter((axis) => axis.values === 1).map((axis) => ({ ...axis, value: axis_value(axis, 0) }));
  const has_one_length = new Set(study.model.find((/** @type {any} */ one) => one.key === "lengths")?.value ?? []).size < 2;
  const model = study.model.filter((/** @type {any} */ one) => !block.axes.some((axis) => axis.key === one.key) && (one.key !== "length" || has_one_length));
  return [...single, ...model].filter((one) => typeof one.value === "number" && !kNotAsked.includes(one.key));
}

/** Of the chain's length: a tip with its links stretched drops hardly more. */
const kReach = 0.975;

/** Where a key that a study does not vary is looked at first: around the value at which it is held. @param {any} study @param {string} key @param {number} value */
export function ends_around(study, key, value) {
  const of_model = (/** @type {string} */ name) => study.model.find((/** @type {any} */ one) => one.key === name)?.value;
  const chain_m = of_model("lengths").reduce((/** @type {number} */ all, /** @type {number} */ one) => all + one, 0);
  const short = (/** @type {number} */ v) => Number(v.toPrecision(3));
  const [from, to] = key === "H" ? [value / 2, Math.max(Math.min(1.2 * value, kReach * chain_m), value)]
    : key === "e" ? [value / 2, 1]
      : key === "length" ? [value, 1.5 * value]  // shorter links may not reach the ground
        : key === "tip_mass" && value === 0 ? [0, 0.1 * of_model("rho") * of_model("A") * chain_m]
          : value === 0 ? [0, 1] : [value / 2, 1.5 * value];
  return { from: Math.min(short(from), value), to: Math.max(short(to), value), is_log: false };
}

/** From the least to the most value of an axis; undefined where the server did not list them. @param {Axis} axis */
function whole_range({ list, range }) {
  const ends = list ?? (range ? [range.from, range.to] : []);
  return ends.length > 1 ? { from: Math.min(...ends), to: Math.max(...ends), is_log: range?.spacing === "log" } : undefined;
}

/**
 * What is solved for a map of which the study lacks an axis: that around its value, and all of an axis that it has.
 * @param {any} study @param {Block} block @param {string[]} keys of the two axes @param {Ranges | null} before what is said of them already
 * @returns {Ranges | null} null: these are no such axes
 */
export function asked_ranges(study, block, keys, before) {
  const others = unvaried(study, block);
  const ranges = keys.map((key) => {
    const axis = varying(block).find((one) => one.key === key);
    const other = others.find((one) => one.key === key);
    return before?.[key] ?? (axis ? whole_range(axis) : other && ends_around(study, key, other.value));
  });
  return ranges.every((one) => one !== undefined) ? Object.fromEntries(keys.map((key, i) => [key, ranges[i]])) : null;
}

/**
 * The axis of whose values each is a line where lines say more than a map: cells as tall as the distance of few values
 * would reach to what an axis cannot have. As `oblique plot` has it. @param {Block} block
 */
function lines_of_few(block) {
  const axes = varying(block);
  if (block.kind !== "grid" || axes.length !== 2) return "";
  const few = axes[0].values < axes[1].values ? axes[0] : axes[1];
  return few.values <= kFewLines ? few.key : "";
}

/** What a study is shown as unless somebody chooses. @param {URLSearchParams} fields @param {Block | undefined} block */
function choose_picture(fields, block) {
  const few = block && !["x", "y", "z"].some((name) => fields.get(name)) ? lines_of_few(block) : "";
  if (few) {
    fields.set("x", varying(/** @type {Block} */ (block)).map((axis) => axis.key).find((key) => key !== few) ?? "");
    fields.set("y", few);
  }
  fields.set("pic", !block ? "gathered" : few || varying(block).length < 2 ? "lines" : "map");
}

const kFewLines = 3;
const kOfGrids = ["map", "lines"];
const kPictures = [...kOfGrids, "gathered", "histogram"];

/**
 * Fills in what an address leaves open, and mends what does not fit the study.
 * @param {URLSearchParams} fields @param {any} study @param {boolean} may_solve whether axes may be asked for that the study lacks
 */
export function fill_in(fields, study, may_solve) {
  const is = (/** @type {string} */ name) => fields.get(name) ?? "";
  const numbers = study.columns.filter((/** @type {any} */ c) => c.picture === "numbers");
  const usual = usual_block(study.blocks);
  const has_grid = may_solve && study.blocks.some((/** @type {Block} */ one) => one.kind === "grid");
  if (!kPictures.includes(is("pic")) || (kOfGrids.includes(is("pic")) && usual < 0 && !(has_grid && is("pic") === "map"))) fields.delete("pic");
  if (!is("pic")) choose_picture(fields, study.blocks[usual]);
  if (kOfGrids.includes(is("pic"))) {
    fill_in_axes(fields, study, may_solve && is("pic") === "map");
  } else {
    const has = (/** @type {string} */ name) => numbers.some((/** @type {any} */ c) => c.name === name);
    if (!has(is("x"))) fields.set("x", is("pic") === "gathered" ? "mu" : has(is("z")) ? is("z") : "fn_peak_N");
    if (is("pic") === "gathered" && !has(is("y"))) fields.set("y", "H");
  }
  const ranges = is("pic") === "map" ? ranges_of(is("between")) : null;
  if (!ranges || !ranges[is("x")] || !ranges[is("y")]) fields.delete("between");
  const is_there = study.columns.some((/** @type {any} */ c) => c.name === is("z") && c.picture !== "none");
  if (!is_there && !(is("pic") === "gathered" && fields.has("z"))) fields.set("z", "fn_peak_N");
  if (is("pic") !== "map" && study.columns.find((/** @type {any} */ c) => c.name === is("z"))?.picture === "categories") fields.set("z", "fn_peak_N");
}

/** Of which block, over which axes. @param {URLSearchParams} fields @param {any} study @param {boolean} may_solve */
function fill_in_axes(fields, study, may_solve) {
  const is = (/** @type {string} */ name) => fields.get(name) ?? "";
  const usual = usual_block(study.blocks);
  const asked = study.blocks[Number(is("block") || usual)];
  const block = asked && varying(asked).length > 0 ? asked : study.blocks[usual] ?? study.blocks.find((/** @type {Block} */ one) => one.kind === "grid");
  fields.set("block", String(study.blocks.indexOf(block)));
  const own = varying(block).map((axis) => axis.key);
  const keys = [...own, ...(may_solve ? unvaried(study, block).map((one) => one.key) : [])];
  const [x, y] = usual_axes(block);
  if (!keys.includes(is("x"))) fields.set("x", x || (keys.includes("mu") ? "mu" : keys[0]));
  if (is("y") && !keys.includes(is("y"))) fields.delete("y");
  if (is("y") === is("x")) fields.delete("y");
  if (!is("y") && is("pic") === "map") {
    const other = [y, ...own, ...["H", "mu"].filter((key) => keys.includes(key))].find((key) => key && key !== is("x"));
    if (other) fields.set("y", other);
    else fields.set("pic", "lines");
  }
  if (own.includes(is("x")) && (is("y") === "" || own.includes(is("y")))) return;
  const ranges = asked_ranges(study, block, [is("x"), is("y")], ranges_of(is("between")));
  if (ranges) fields.set("between", between_text(ranges));
  else [x, y].forEach((key, i) => fields.set(["x", "y"][i], key));
}
