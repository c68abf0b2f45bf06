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
function usual_block(blocks) {
  let best = -1;
  blocks.forEach((block, i) => {
    if (varying(block).length > 0 && (best < 0 || block.points > blocks[best].points)) best = i;
  });
  return best;
}

/** @param {Block} block @returns {[string, string]} */
function usual_axes(block) {
  const keys = varying(block).map((axis) => axis.key);
  const x = keys.includes("mu") ? "mu" : keys.at(-1) ?? "";
  const others = keys.filter((key) => key !== x);
  return [x, others.includes("H") ? "H" : others[0] ?? ""];
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

/** Fills in what an address leaves open, and mends what does not fit the study. @param {URLSearchParams} fields @param {any} study */
export function fill_in(fields, study) {
  const is = (/** @type {string} */ name) => fields.get(name) ?? "";
  const numbers = study.columns.filter((/** @type {any} */ c) => c.picture === "numbers");
  const usual = usual_block(study.blocks);
  if (!kPictures.includes(is("pic")) || (kOfGrids.includes(is("pic")) && usual < 0)) fields.delete("pic");
  if (!is("pic")) choose_picture(fields, study.blocks[usual]);
  if (kOfGrids.includes(is("pic"))) {
    fill_in_axes(fields, study);
  } else {
    const has = (/** @type {string} */ name) => numbers.some((/** @type {any} */ c) => c.name === name);
    if (!has(is("x"))) fields.set("x", is("pic") === "gathered" ? "mu" : has(is("z")) ? is("z") : "fn_peak_N");
    if (is("pic") === "gathered" && !has(is("y"))) fields.set("y", "H");
  }
  const is_there = study.columns.some((/** @type {any} */ c) => c.name === is("z") && c.picture !== "none");
  if (!is_there && !(is("pic") === "gathered" && fields.has("z"))) fields.set("z", "fn_peak_N");
  if (is("pic") !== "map" && study.columns.find((/** @type {any} */ c) => c.name === is("z"))?.picture === "categories") fields.set("z", "fn_peak_N");
}

/** Of which block, over which axes. @param {URLSearchParams} fields @param {any} study */
function fill_in_axes(fields, study) {
  const is = (/** @type {string} */ name) => fields.get(name) ?? "";
  const usual = usual_block(study.blocks);
  const asked = study.blocks[Number(is("block") || usual)];
  const block = asked && varying(asked).length > 0 ? asked : study.blocks[usual];
  fields.set("block", String(study.blocks.indexOf(block)));
  const keys = varying(block).map((axis) => axis.key);
  const [x, y] = usual_axes(block);
  if (!keys.includes(is("x"))) fields.set("x", x);
  if (!keys.includes(is("y")) || is("y") === is("x")) fields.delete("y");
  if (is("y") || is("pic") !== "map") return;
  const other = [y, ...keys].find((key) => key && key !== is("x"));
  if (other) fields.set("y", other);
  else fields.set("pic", "lines");
}
