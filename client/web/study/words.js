// @ts-check
// Pictures in words and numbers.
import { count, csv_line, shown, with_unit } from "/parts/format.js";
import { kMostDots } from "./pictures.js";

/** @typedef {import("./pictures.js").Picture} Picture */

const many = (/** @type {number} */ n, /** @type {string} */ what) => `${count(n)} ${what}${n === 1 ? "" : "s"}`;

/** What is shown, of how much. @param {Picture} picture @param {string} kind @param {any} study @param {(key: string) => string} unit_of */
export function facts(picture, kind, study, unit_of) {
  const parts = [];
  const blocks = study.blocks.length + study.blocks_left_out;
  if (picture.head.nx !== undefined) {
    const whole = (/** @type {any} */ side, /** @type {any} */ told) => told && !side.is_whole;
    parts.push(`${count(picture.head.nx)}${picture.y.name ? ` × ${count(picture.head.ny)}` : ""} cells, ${count(picture.head.solved)} solved${picture.head.filtered > 0 ? " that meet the condition" : ""}.`);
    for (const [side, told] of [[picture.x, picture.head.x], [picture.y, picture.head.y]]) {
      if (whole(side, told)) parts.push(`Of ${count(told.last - told.first + 1)} values of ${side.name}, ${count(side.values.length)} are shown, evenly chosen${kind === "lines" ? "" : ": zoom in for the others"}.`);
    }
    if (blocks > 1) parts.push(`Block ${picture.head.block + 1} of ${count(blocks)}; not shown: ${many(study.points - study.blocks[picture.head.block].points, "point")} of the others.`);
    for (const one of picture.head.at.filter((/** @type {any} */ a) => a.of > 1)) parts.push(`${one.key} = ${with_unit(one.value, unit_of(one.key))}.`);
  } else if (picture.dots) {
    parts.push(`${many(picture.head.points, "point")}, each drawn.`);
    if (picture.head.without > 0) parts.push(`${many(picture.head.without, "other")} without values that can be shown.`);
  } else {
    parts.push(`${many(picture.head.points, "point")} in ${many(picture.values.length, "bin")}${picture.head.outside > 0 ? `, ${count(picture.head.outside)} outside` : ""}.`);
    if (picture.y.name) parts.push(`Up to ${count(kMostDots)} points are drawn one by one, more are gathered.`);
  }
  return parts;
}

/** What a cell shows. @param {Picture} picture @param {[number, number]} cell */
export function sentence(picture, [column, row]) {
  const cell = row * picture.x.values.length + column;
  const why = picture.why_empty(cell);
  const text = why ? { missing: "not solved", failed: "failed", left_out: picture.head.counts ? "no points" : "left out", none: "no value", filtered: "does not meet the condition" }[why]
    : picture.z.is_category ? picture.dictionary[picture.values[cell]].text
      : `${shown(picture.values[cell])} ${picture.z.unit}`;
  const side = (/** @type {any} */ s, /** @type {number} */ i) => `${s.name} ${s.edges ? `${shown(s.edges[i], 4)} to ${shown(s.edges[i + 1], 4)}` : shown(s.values[i])}${s.unit && s.unit !== "1" ? ` ${s.unit}` : ""}`;
  const place = `${side(picture.x, column)}, ${side(picture.y, row)}`;
  if (picture.dots) return `${place}: ${many(picture.head.counts[cell], "point")}`;
  return `${place}: ${picture.z.name} ${text}${picture.head.counts ? `, ${many(picture.head.counts[cell], "point")}` : ""}`;
}

/** Its cells, one a line. @param {Picture} picture */
export function cells_csv(picture) {
  if (picture.dots) return dots_csv(picture, picture.dots);
  const nx = picture.x.values.length;
  const lines = [csv_line([picture.x.name, ...(picture.y.name ? [picture.y.name] : []), picture.z.name, "point"])];
  for (let cell = 0; cell < picture.values.length; ++cell) {
    const column = cell % nx;
    const row = Math.floor(cell / nx);
    const value = picture.why_empty(cell) ? "" : picture.z.is_category ? picture.dictionary[picture.values[cell]].text : picture.values[cell];
    lines.push(csv_line([picture.x.values[column], ...(picture.y.name ? [picture.y.values[row]] : []), value, picture.point(column, row) ?? ""]));
  }
  return lines.join("\r\n") + "\r\n";
}

/** @param {Picture} picture @param {import("./pictures.js").Dots} dots */
function dots_csv(picture, dots) {
  const lines = [["point", picture.x.name, picture.y.name, ...(dots.z ? [picture.z.name] : [])].join(",")];
  dots.points.forEach((point, i) => lines.push([point, dots.x[i], dots.y[i], ...(dots.z ? [dots.z[i] ?? ""] : [])].join(",")));
  return lines.join("\r\n") + "\r\n";
}
