// @ts-check
// Slices, bins and single points of the server in one form for the map, the lines and the bars; what is asked for, as the
// address says it, and which of it is marked.
import { ends_of } from "/parts/scale.js";
import { numbers, rows } from "/server.js";
import { own_axes } from "./axes.js";
import { joined, within } from "./conditions.js";

/**
 * @typedef {import("./study.js").StudyView} View
 *
 * @typedef {object} Side
 * @property {string} name
 * @property {string} unit
 * @property {Float64Array} values one a column or row, in the server's order
 * @property {number[]} [edges] of bins, one more than values
 * @property {number[]} [numbers] which values of the axis these are
 * @property {boolean} is_whole all values between the ends are shown
 *
 * @typedef {object} Picture
 * @property {Side} x
 * @property {Side} y
 * @property {{name: string, unit: string, is_category: boolean}} z
 * @property {Float32Array | Uint16Array} values row by row
 * @property {{text: string, cells: number}[]} dictionary
 * @property {number | null} least
 * @property {number | null} most
 * @property {any} head
 * @property {(column: number, row: number) => number | null} point
 * @property {(cell: number) => Empty} why_empty
 * @property {Dots} [dots] the points themselves, where they are few; the cells say how many lie where
 *
 * @typedef {"" | "missing" | "failed" | "left_out" | "none" | "filtered"} Empty
 * @typedef {{points: number[], x: number[], y: number[], z: (number | null)[] | null}} Dots
 */

/** By the bits of a cell without a value. */
export const kEmpty = /** @type {const} */ (["missing", "failed", "left_out", "none", "filtered"]);
const kFirstMark = 0x10000 - kEmpty.length;

/** The number of the values that are shown, as the server chooses them. @param {any} side @param {number} shown */
function numbers_of(side, shown) {
  const there = side.last - side.first + 1;
  const steps = Math.max(shown - 1, 1);
  return Array.from({ length: shown }, (_, i) => side.first + Math.floor((2 * i * (there - 1) + steps) / (2 * steps)));
}

/**
 * One output over one or two axes of a grid.
 * @param {number} study @param {Record<string, string | number>} asked @param {AbortSignal} signal
 * @param {(key: string) => string} unit_of @returns {Promise<Picture>}
 */
async function slice(study, asked, signal, unit_of) {
  const { head, bytes, begin } = /** @type {any} */ (await numbers(`/api/studies/${study}/slice?${new URLSearchParams(/** @type {any} */ (asked))}`, signal));
  const { nx, ny } = head;
  const ys_at = begin + 8 * nx;
  const cells_at = ys_at + (head.y ? 8 * ny : 0);  // a line has no values upwards
  const is_category = head.z.kind === "categories";
  const values = is_category ? new Uint16Array(bytes, cells_at, nx * ny) : new Float32Array(bytes, cells_at, nx * ny);
  const bits = is_category ? null : new Uint32Array(bytes, cells_at, nx * ny);
  const [least, most] = is_category ? [null, null] : ends_of(values);
  const side = (/** @type {any} */ told, /** @type {Float64Array} */ all) => ({ name: told?.key ?? "", unit: told ? unit_of(told.key) : "",
    values: all, numbers: told ? numbers_of(told, all.length) : [0], is_whole: told?.all_lines ?? true });
  const x = side(head.x, new Float64Array(bytes, begin, nx));
  const y = side(head.y, head.y ? new Float64Array(bytes, ys_at, ny) : new Float64Array(1));
  const x_stride = head.x.stride;
  const y_stride = head.y?.stride ?? 0;
  return {
    x, y, values, head, dictionary: head.dictionary ?? [], least, most,
    z: { name: head.z.name, unit: head.z.unit, is_category },
    point: (column, row) => head.first_point + x.numbers[column] * x_stride + y.numbers[row] * y_stride,
    why_empty(cell) {
      if (bits) return Number.isNaN(values[cell]) ? kEmpty[bits[cell] & 7] : "";
      const code = values[cell];
      return code < kFirstMark ? "" : kEmpty[0xffff - code];
    },
  };
}

/**
 * Equal steps from the least to the most, or one around a value that all have.
 * @param {string} name @param {string} unit @param {number} least @param {number} most @param {number} bins @param {boolean} is_log
 * @returns {Side}
 */
function steps(name, unit, least, most, bins, is_log) {
  if (!(most > least)) {
    const half = Math.abs(least) * 0.05 || 0.5;
    return { name, unit, values: Float64Array.of(least), edges: [least - half, least + half], is_whole: true };
  }
  const inner = is_log ? Math.log : (/** @type {number} */ v) => v;
  const outer = is_log ? Math.exp : (/** @type {number} */ v) => v;
  const from = inner(least);
  const width = inner(most) - from;
  const at = (/** @type {number} */ i) => outer(from + (width * i) / bins);
  const edges = Array.from({ length: bins + 1 }, (_, i) => (i === 0 ? least : i === bins ? most : at(i)));
  return { name, unit, values: Float64Array.from({ length: bins }, (_, i) => at(i + 0.5)), edges, is_whole: true };
}

/**
 * How many points lie in cells over one or two columns, or the mean of a third there.
 * @param {number} study @param {Record<string, string | number>} asked @param {AbortSignal} signal
 * @param {(key: string) => string} unit_of @returns {Promise<Picture>}
 */
async function bins(study, asked, signal, unit_of) {
  const { head, bytes, begin } = /** @type {any} */ (await numbers(`/api/studies/${study}/bins?${new URLSearchParams(/** @type {any} */ (asked))}`, signal));
  const side = (/** @type {any} */ of) => steps(of.column, of.unit, of.least, of.most, of.bins, of.log);
  const x = side(head.x);
  const y = head.y ? side(head.y) : { name: "", unit: "", values: new Float64Array(1), is_whole: true };
  const cells = head.x.bins * (head.y?.bins ?? 1);
  const counts = new Uint32Array(bytes, begin, cells);
  const means = head.z ? new Float32Array(bytes, begin + 4 * cells, cells) : null;
  const values = means ?? Float32Array.from(counts, (n) => (n > 0 ? n : NaN));
  const [least, most] = ends_of(values);
  return { x, y, values, head: { ...head, counts }, dictionary: [], least, most,
    z: { name: head.z ? `mean of ${head.z}` : "points", unit: head.z ? unit_of(head.z) : "", is_category: false },
    point: () => null, why_empty: (cell) => (Number.isNaN(values[cell]) ? "left_out" : "") };
}

/** More points than that are gathered in bins. */
export const kMostDots = 20_000;
const kCells = 24; // a side: what keys move over

/**
 * @param {number} study
 * @param {{x: string, y: string, z: string, where: string, xlog: boolean, ylog: boolean, ends: Record<string, string>}} asked
 * @param {AbortSignal} signal @param {(key: string) => string} unit_of
 * @returns {Promise<Picture | null>} null: there are more than kMostDots
 */
async function dots(study, { x, y, z, where, xlog, ylog, ends }, signal, unit_of) {
  const condition = joined(where, within(x, ends.x0, ends.x1), within(y, ends.y0, ends.y1));
  const answer = await rows(study, { select: ["point", x, y, ...(z ? [z] : [])].join(","), where: condition, limit: kMostDots + 1 }, signal);
  if (answer.rows.length > kMostDots) return null;
  const is_shown = (/** @type {any[]} */ row) => typeof row[1] === "number" && typeof row[2] === "number" && (!xlog || row[1] > 0) && (!ylog || row[2] > 0);
  const told = answer.rows.filter(is_shown);
  const column = (/** @type {number} */ i) => told.map((/** @type {any[]} */ row) => row[i]);
  const of = { points: column(0), x: column(1), y: column(2), z: z ? column(3) : null };
  const side = (/** @type {string} */ name, /** @type {number[]} */ values, /** @type {string} */ from, /** @type {string} */ to, /** @type {boolean} */ is_log) => {
    const [least, most] = ends_of(values);
    return steps(name, unit_of(name), from ? Number(from) : least ?? 0, to ? Number(to) : most ?? 0, kCells, is_log);
  };
  const sides = [side(x, of.x, ends.x0, ends.x1, xlog), side(y, of.y, ends.y0, ends.y1, ylog)];
  const [across, upwards] = sides;
  const nx = across.values.length;
  const counts = new Uint32Array(nx * upwards.values.length);
  /** The first point of each cell. @type {Map<number, number>} */
  const first = new Map();
  of.points.forEach((/** @type {number} */ point, /** @type {number} */ i) => {
    const cell = step_of(upwards, of.y[i], ylog) * nx + step_of(across, of.x[i], xlog);
    ++counts[cell];
    if (!first.has(cell)) first.set(cell, point);
  });
  const [least, most] = ends_of(of.z ?? []);
  return { x: across, y: upwards, values: Float32Array.from(counts), dictionary: [], least, most, dots: of,
    head: { counts, points: told.length, without: answer.rows.length - told.length, outside: 0 },
    z: { name: z || "points", unit: z ? unit_of(z) : "", is_category: false },
    point: (i, j) => first.get(j * nx + i) ?? null, why_empty: (cell) => (counts[cell] > 0 ? "" : "left_out") };
}

/** In which step a value lies. @param {Side} side @param {number} value @param {boolean} is_log */
export function step_of(side, value, is_log) {
  const edges = side.edges ?? [0, 1];
  const inner = is_log ? Math.log : (/** @type {number} */ v) => v;
  const from = inner(edges[0]);
  const share = (inner(value) - from) / (inner(edges[edges.length - 1]) - from);
  return Math.min(Math.max(Math.floor(share * side.values.length), 0), side.values.length - 1);
}

/** Cells along a side of a picture, at most. */
const kMostCells = 256;
/** The server looks up each cell, so a coarse picture comes first. */
const kFirstCells = 96;
const kMostBins = 96;
const kMostLines = 8;

const is_slice = (/** @type {string} */ kind) => kind === "map" || kind === "lines";

const part_ends = (/** @type {View} */ view) =>
  Object.fromEntries(["x0", "x1", "y0", "y1"].filter((name) => view.is(name)).map((name) => [name, view.is(name)]));

/** Whether the picture has so many cells that a part of them is there far sooner. @param {View} view */
function has_many_cells(view) {
  const cells = own_axes(view.block).filter((a) => a.key === view.is("x") || a.key === view.is("y")).reduce((all, a) => all * Math.min(a.values, kMostCells), 1);
  return cells > 4 * kFirstCells ** 2;
}

/** How many cells a side are asked for, one picture after the other. @param {View} view */
export function steps_to(view) {
  if (!is_slice(view.is("pic"))) return [kMostCells];
  // A refresh does not make the picture coarser.
  return view.is("pic") === "map" && !view.is_refreshing && has_many_cells(view) ? [kFirstCells, kMostCells] : [kMostCells];
}

/** @param {View} view @param {number} cells a side, at most @returns {Record<string, string | number>} */
function slice_fields(view, cells) {
  const kind = view.is("pic");
  const keys = own_axes(view.block).map((a) => a.key);
  const at = [...view.places()].filter(([key]) => keys.includes(key) && key !== view.is("x") && key !== view.is("y"))
    .map(([key, n]) => `${key}@${n}`).join(",");
  return { z: view.is("z"), x: view.is("x"), ...(view.is("y") ? { y: view.is("y") } : {}), ...(at ? { at } : {}), block: view.is("block"),
    nx: cells, ny: kind === "lines" ? kMostLines : cells, ...part_ends(view) };
}

/** @param {View} view @returns {Record<string, string | number>} */
function bins_fields(view) {
  const kind = view.is("pic");
  // A few points a bin.
  const a_side = Math.round(Math.min(Math.max(Math.sqrt(view.study.points / 3), 6), kMostBins));
  return { x: view.is("x"), nx: kind === "histogram" ? Math.min(a_side * 2, 64) : a_side, ...(view.is("xlog") ? { xlog: 1 } : {}), ...part_ends(view),
    ...(kind === "gathered" ? { y: view.is("y"), ny: a_side, ...(view.is("ylog") ? { ylog: 1 } : {}), ...(view.is("z") ? { z: view.is("z") } : {}) } : {}) };
}

/** The points themselves where they are few, else bins of them. @param {View} view @param {AbortSignal} signal */
async function scatter(view, signal) {
  const single = () => dots(view.study.id, { x: view.is("x"), y: view.is("y"), z: view.is("z"), where: view.is("where"), xlog: view.is("xlog") !== "",
    ylog: view.is("ylog") !== "", ends: part_ends(view) }, signal, view.unit_of);
  if (view.study.points <= kMostDots) {
    const all = await single();
    if (all) return all;
  }
  const gathered = await bins(view.study.id, { ...bins_fields(view), ...filter_of(view) }, signal, view.unit_of);
  const few = gathered.head.points <= kMostDots ? await single() : null;
  return few ?? gathered;
}

const filter_of = (/** @type {View} */ view) => (view.is("where") ? { where: view.is("where") } : {});

/** The picture of a view. @param {View} view @param {number} cells a side of a map, at most @param {AbortSignal} signal */
export function ask(view, cells, signal) {
  const kind = view.is("pic");
  if (kind === "gathered") return scatter(view, signal);
  return is_slice(kind) ? slice(view.study.id, { ...slice_fields(view, cells), ...filter_of(view) }, signal, view.unit_of)
    : bins(view.study.id, { ...bins_fields(view), ...filter_of(view) }, signal, view.unit_of);
}

/**
 * Which cells of a picture have points that meet a condition too, or which of its points do.
 * @typedef {{cells: Uint8Array, counts: Uint32Array | null, points: Set<number> | null}} Marks
 * @param {View} view @param {Picture} picture @param {string} condition @param {AbortSignal} signal
 * @returns {Promise<Marks>}
 */
export async function ask_marks(view, picture, condition, signal) {
  const where = joined(view.is("where"), condition);
  const size = picture.values.length;
  if (picture.dots) {
    // As few as the picture's own: those of the part that is zoomed into.
    const { x0, x1, y0, y1 } = part_ends(view);
    const there = joined(where, within(view.is("x"), x0, x1), within(view.is("y"), y0, y1));
    const answer = await rows(view.study.id, { select: "point", where: there, limit: kMostDots + 1 }, signal);
    const points = new Set(answer.rows.map((/** @type {number[]} */ row) => row[0]));
    return { cells: new Uint8Array(size), counts: null, points };
  }
  if (picture.head.counts) {
    const ends = Object.fromEntries(["x", "y"].filter((name) => picture.head[name])
      .flatMap((name) => [[`${name}0`, picture.head[name].least], [`${name}1`, picture.head[name].most]]));
    const told = await bins(view.study.id, { ...bins_fields(view), ...ends, where }, signal, view.unit_of);
    return { cells: Uint8Array.from(told.head.counts, (n) => (n > 0 ? 1 : 0)), counts: told.head.counts, points: null };
  }
  const told = await slice(view.study.id, { ...slice_fields(view, Math.max(picture.x.values.length, picture.y.values.length)), where }, signal, view.unit_of);
  const cells = Uint8Array.from({ length: size }, (_, cell) => (["missing", "left_out", "filtered"].includes(told.why_empty(cell)) ? 0 : 1));
  return { cells, counts: null, points: null };
}
