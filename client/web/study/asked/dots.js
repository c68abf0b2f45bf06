// @ts-check
// Single points over two columns, where they are few.
import { ends_of } from "/parts/scale.js";
import { joined, within } from "../conditions.js";
import { rows, steps } from "./picture.js";

/** More points than that are gathered in bins. */
export const kMostDots = 20_000;
const kCells = 24; // a side: what keys move over

/**
 * @param {number} study
 * @param {{x: string, y: string, z: string, where: string, xlog: boolean, ylog: boolean, ends: Record<string, string>}} asked
 * @param {AbortSignal} signal @param {(key: string) => string} unit_of
 * @returns {Promise<import("./picture.js").Picture | null>} null: there are more than kMostDots
 */
export async function dots(study, { x, y, z, where, xlog, ylog, ends }, signal, unit_of) {
  const condition = joined(where, within(x, ends.x0, ends.x1), within(y, ends.y0, ends.y1));
  const answer = await rows(study, { select: ["point", x, y, ...(z ? [z] : [])].join(","), where: condition, limit: kMostDots + 1 }, signal);
  if (answer.rows.length > kMostDots || answer.truncated) return null;
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

/** In which step a value lies. @param {import("./picture.js").Side} side @param {number} value @param {boolean} is_log */
export function step_of(side, value, is_log) {
  const edges = side.edges ?? [0, 1];
  const inner = is_log ? Math.log : (/** @type {number} */ v) => v;
  const from = inner(edges[0]);
  const share = (inner(value) - from) / (inner(edges[edges.length - 1]) - from);
  return Math.min(Math.max(Math.floor(share * side.values.length), 0), side.values.length - 1);
}
