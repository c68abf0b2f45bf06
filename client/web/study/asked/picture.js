// @ts-check
// Pictures as the server gives them, in one form for the map, the lines and the bars.
import { ends_of } from "/parts/scale.js";
import { json, numbers } from "/server.js";

/**
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
export async function slice(study, asked, signal, unit_of) {
  const { head, bytes, begin } = /** @type {any} */ (await numbers(`/api/studies/${study}/slice?${new URLSearchParams(/** @type {any} */ (asked))}`, signal));
  const { nx, ny } = head;
  const ys_at = begin + 8 * nx;
  const cells_at = ys_at + (head.y ? 8 * ny : 0);  // a line has no values upwards
  const is_category = head.z.kind === "categories";
  const values = is_category ? new Uint16Array(bytes, cells_at, nx * ny) : new Float32Array(bytes, cells_at, nx * ny);
  const bits = is_category ? null : new Uint32Array(bytes, cells_at, nx * ny);
  const side = (/** @type {any} */ told, /** @type {Float64Array} */ all) => ({ name: told?.key ?? "", unit: told ? unit_of(told.key) : "",
    values: all, numbers: told ? numbers_of(told, all.length) : [0], is_whole: told?.all_lines ?? true });
  const x = side(head.x, new Float64Array(bytes, begin, nx));
  const y = side(head.y, head.y ? new Float64Array(bytes, ys_at, ny) : new Float64Array(1));
  const x_stride = head.x.stride;
  const y_stride = head.y?.stride ?? 0;
  return {
    x, y, values, head, dictionary: head.dictionary ?? [], least: head.least ?? null, most: head.most ?? null,
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
export function steps(name, unit, least, most, bins, is_log) {
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
export async function bins(study, asked, signal, unit_of) {
  const { head, bytes, begin } = /** @type {any} */ (await numbers(`/api/studies/${study}/bins?${new URLSearchParams(/** @type {any} */ (asked))}`, signal));
  const side = (/** @type {any} */ of) => steps(of.column, of.unit, of.least, of.most, of.bins, of.log);
  const x = side(head.x);
  const y = head.y ? side(head.y) : { name: "", unit: "", values: new Float64Array(1), is_whole: true };
  const told = head.x.bins * (head.y?.bins ?? 1);
  const [nx, ny] = [x.values.length, y.values.length];
  let counts = new Uint32Array(bytes, begin, told);
  let means = head.z ? new Float32Array(bytes, begin + 4 * told, told) : null;
  if (nx * ny < told) {  // a column of one value: one of its bins has all
    const all = counts;
    const old = means;
    counts = new Uint32Array(nx * ny);
    means = old && new Float32Array(nx * ny).fill(NaN);
    for (let i = 0; i < told; ++i) {
      const cell = Math.min(Math.floor(i / head.x.bins), ny - 1) * nx + Math.min(i % head.x.bins, nx - 1);
      counts[cell] += all[i];
      if (old && means && all[i] > 0) means[cell] = old[i];
    }
  }
  const values = means ?? Float32Array.from(counts, (n) => (n > 0 ? n : NaN));
  const [least, most] = ends_of(values);
  return { x, y, values, head: { ...head, counts }, dictionary: [], least, most,
    z: { name: head.z ? `mean of ${head.z}` : "points", unit: head.z ? unit_of(head.z) : "", is_category: false },
    point: () => null, why_empty: (cell) => (Number.isNaN(values[cell]) ? "left_out" : "") };
}

/** Rows of a table. @param {number} study @param {Record<string, string | number>} asked @param {AbortSignal} [signal] */
export function rows(study, asked, signal) {
  return json(rows_path(study, asked), signal);
}

/** @param {number} study @param {Record<string, string | number>} asked */
export function rows_path(study, asked) {
  return `/api/studies/${study}/rows?${new URLSearchParams(/** @type {any} */ (asked))}`;
}
