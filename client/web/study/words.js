// @ts-check
// Pictures in words and numbers.
import { count, shown } from "/parts/format.js";

/** @typedef {import("./picture.js").Picture} Picture */

/** What is shown, of how much. @param {Picture} picture @param {string} kind */
export function facts(picture, kind) {
  const parts = [];
  if (picture.head.nx !== undefined) {
    const whole = (/** @type {any} */ side, /** @type {any} */ told) => told && !side.is_whole;
    parts.push(`${count(picture.head.nx)}${picture.y.name ? ` × ${count(picture.head.ny)}` : ""} cells, ${count(picture.head.solved)} solved.`);
    for (const [side, told] of [[picture.x, picture.head.x], [picture.y, picture.head.y]]) {
      if (whole(side, told)) parts.push(`Of ${count(told.last - told.first + 1)} values of ${side.name}, ${count(side.values.length)} are shown, evenly chosen${kind === "lines" ? "" : ": zoom in for the others"}.`);
    }
    for (const one of picture.head.at.filter((/** @type {any} */ a) => a.of > 1)) parts.push(`${one.key} = ${shown(one.value)}.`);
  } else {
    parts.push(`${count(picture.head.points)} points in ${count(picture.values.length)} bins${picture.head.outside > 0 ? `, ${count(picture.head.outside)} outside` : ""}.`);
  }
  return parts;
}

/** What a cell shows. @param {Picture} picture @param {[number, number]} cell */
export function sentence(picture, [column, row]) {
  const cell = row * picture.x.values.length + column;
  const why = picture.why_empty(cell);
  const text = why ? { missing: "not solved", failed: "failed", left_out: picture.head.counts ? "no points" : "left out", none: "no value" }[why]
    : picture.z.is_category ? picture.dictionary[picture.values[cell]].text
      : `${shown(picture.values[cell])} ${picture.z.unit}`;
  const side = (/** @type {any} */ s, /** @type {number} */ i) => `${s.name} ${shown(s.values[i])}${s.unit && s.unit !== "1" ? ` ${s.unit}` : ""}`;
  const many = picture.head.counts ? `, ${count(picture.head.counts[cell])} points` : "";
  return `${side(picture.x, column)}, ${side(picture.y, row)}: ${picture.z.name} ${text}${many}`;
}

/** Its cells, one a line. @param {Picture} picture */
export function cells_csv(picture) {
  const nx = picture.x.values.length;
  const lines = [[picture.x.name, ...(picture.y.name ? [picture.y.name] : []), picture.z.name, "point"].join(",")];
  for (let cell = 0; cell < picture.values.length; ++cell) {
    const column = cell % nx;
    const row = Math.floor(cell / nx);
    const value = picture.why_empty(cell) ? "" : picture.z.is_category ? picture.dictionary[picture.values[cell]].text : picture.values[cell];
    lines.push([picture.x.values[column], ...(picture.y.name ? [picture.y.values[row]] : []), value, picture.point(column, row) ?? ""].join(","));
  }
  return lines.join("\r\n") + "\r\n";
}
