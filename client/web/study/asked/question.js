// @ts-check
// What the server is asked for a picture, as the address says it.
import { own_axes } from "../axes.js";
import { joined, within } from "../conditions.js";
import { dots, kMostDots } from "./dots.js";
import { bins, rows, slice } from "./picture.js";

/** Cells along a side of a picture, at most. */
const kMostCells = 256;
/** The server looks up each cell, so a coarse picture comes first. */
const kFirstCells = 96;
const kMostBins = 96;
const kMostLines = 8;

/** @typedef {import("../study.js").StudyView} View */

export const is_slice = (/** @type {string} */ kind) => kind === "map" || kind === "lines";

const ends_of = (/** @type {View} */ view) =>
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
    nx: cells, ny: kind === "lines" ? kMostLines : cells, ...ends_of(view) };
}

/** @param {View} view @returns {Record<string, string | number>} */
function bins_fields(view) {
  const kind = view.is("pic");
  // A few points a bin.
  const a_side = Math.round(Math.min(Math.max(Math.sqrt(view.study.points / 3), 6), kMostBins));
  return { x: view.is("x"), nx: kind === "histogram" ? Math.min(a_side * 2, 64) : a_side, ...(view.is("xlog") ? { xlog: 1 } : {}), ...ends_of(view),
    ...(kind === "gathered" ? { y: view.is("y"), ny: a_side, ...(view.is("ylog") ? { ylog: 1 } : {}), ...(view.is("z") ? { z: view.is("z") } : {}) } : {}) };
}

/** The points themselves where they are few, else bins of them. @param {View} view @param {AbortSignal} signal */
async function scatter(view, signal) {
  const single = () => dots(view.study.id, { x: view.is("x"), y: view.is("y"), z: view.is("z"), where: view.is("where"), xlog: view.is("xlog") !== "",
    ylog: view.is("ylog") !== "", ends: ends_of(view) }, signal, view.unit_of);
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
 * @param {View} view @param {import("./picture.js").Picture} picture @param {string} condition @param {AbortSignal} signal
 * @returns {Promise<Marks>}
 */
export async function ask_marks(view, picture, condition, signal) {
  const where = joined(view.is("where"), condition);
  const size = picture.values.length;
  if (picture.dots) {
    // As few as the picture's own: those of the part that is zoomed into.
    const { x0, x1, y0, y1 } = ends_of(view);
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
