// Turns parts of a picture into conditions of the query language.
import { columnOfAxis } from "./fields.js";

/** Joins conditions with AND; omits empty ones. */
export function joined(...conditions) {
  const given = conditions.filter(Boolean);
  if (given.length < 2) return given[0] ?? "";
  return given.map((one) => (/\bor\b/i.test(one) ? `(${one})` : one)).join(" AND ");
}

/** Returns the condition for a range of a column; a missing or "" end is open. */
export const within = (column, from = "", to = "") =>
  joined(from === "" ? "" : `${column} >= ${from}`, to === "" ? "" : `${column} <= ${to}`);

/** Returns the condition for one value of a column; a worker's value may differ in the last bits. */
const equals = (column, value, margin = 1e-12 * Math.abs(value)) =>
  `${column} BETWEEN ${value - margin} AND ${value + margin}`;

/** Returns a number between a and b with as few digits as possible. */
function shortBetween(a, b) {
  const [least, most] = [Math.min(a, b), Math.max(a, b)];
  for (let digits = 1; digits < 17; ++digits) {
    const tried = Number(((least + most) / 2).toPrecision(digits));
    if (Math.abs(2 * tried - least - most) < 0.9 * (most - least)) return tried;
  }
  return (least + most) / 2;
}

/**
 * Rounds an end of a range to about 1/500 of the range; near the lower end of a logarithmic scale
 * to about 1/500 of the number itself.
 */
export function rounded(value, width) {
  if (!(width > 0)) return value;
  const wide = Math.min(width, Math.abs(value) * 2 || width);
  const step = 10 ** Math.floor(Math.log10(wide / 500));
  return Number((Math.round(value / step) * step).toPrecision(12));
}

/**
 * Returns the values of a picture axis within a range, ascending. If there are none, returns the
 * value nearest to the middle of the range.
 */
function valuesIn({ values }, [from, to]) {
  const sorted = Array.from(values).sort((a, b) => a - b);
  const inside = sorted.filter((value) => value >= from && value <= to);
  if (inside.length > 0) return inside;
  const distance = (value) => Math.abs(2 * value - from - to);
  return [sorted.reduce((best, value) => (distance(value) < distance(best) ? value : best))];
}

/**
 * Returns a range of a picture axis as the address of the page gives it: ends of bins, or indices
 * of values on the axis.
 */
export function addressOf(side, range) {
  const width = range[1] - range[0];
  if (side.edges) return range.map((end) => String(rounded(end, width)));
  const numbers = valuesIn(side, range).map((value) => side.numbers[side.values.indexOf(value)]);
  return [Math.min(...numbers), Math.max(...numbers)].map(String);
}

/** Returns the condition for a range of a picture axis. */
function partOf(side, range) {
  const column = columnOfAxis(side.name);
  if (side.edges) {
    const width = side.edges.at(-1) - side.edges[0];
    return within(column, ...range.map((end) => rounded(end, width)));
  }
  const sorted = Array.from(side.values).sort((a, b) => a - b);
  if (sorted.length < 2) return side.isWhole ? "" : equals(column, sorted[0]);
  const inside = valuesIn(side, range);
  if (inside.length === sorted.length && side.isWhole) return "";
  const [first, last] = [sorted.indexOf(inside[0]), sorted.indexOf(inside.at(-1))];
  const before = sorted[first - 1] ?? (3 * sorted[0] - sorted[1]) / 2;
  const after = sorted[last + 1] ?? (3 * sorted[last] - sorted[last - 1]) / 2;
  return within(column, shortBetween(before, sorted[first]), shortBetween(sorted[last], after));
}

/** Returns the condition for the shown values of a picture axis, or "" if it shows all values. */
export function shownPart(side, isZoomed) {
  if (!isZoomed || !side.name) return "";
  return partOf(
    { ...side, isWhole: false },
    side.edges ? [side.edges[0], side.edges.at(-1)] : [-Infinity, Infinity],
  );
}

/** Returns the conditions that hold for the whole picture: values of other axes, and its block. */
function heldPart(blocks, { head }) {
  const varied = (head.at ?? []).filter((one) => one.of > 1);
  const held = varied.map((one) => equals(columnOfAxis(one.key), one.value));
  const { first_point: first, points } = blocks[head.block] ?? {};
  const isOfBlock = points && blocks.length > 1;
  return joined(...held, isOfBlock ? `point >= ${first} AND point < ${first + points}` : "");
}

/** Returns the condition for the shown lines and, if given, a range of their output. */
function linesPart({ y, z, least, most }, range) {
  const isSome = y.name && !y.isWhole;
  const line = (value) => equals(columnOfAxis(y.name), value);
  const lines = isSome ? Array.from(y.values, line).join(" OR ") : "";
  const width = (most ?? 1) - (least ?? 0);
  return joined(lines, range ? within(z.name, ...range.map((end) => rounded(end, width))) : "");
}

/**
 * Returns the condition for a part of a picture: {x: [from, to], y: [from, to]}. In a picture of
 * lines, y is a range of the output, or null.
 */
export function conditionOf(blocks, picture, { x, y }, isMap) {
  const upwards = isMap ? partOf(picture.y, y) : linesPart(picture, y);
  const all = joined(partOf(picture.x, x), upwards, heldPart(blocks, picture));
  return all || `${columnOfAxis(picture.x.name)} IS NOT NULL`;
}
