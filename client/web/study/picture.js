// @ts-check
// Pictures as the server gives them, in one form for the map, the lines and the bars.
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
 * @property {(cell: number) => "" | "missing" | "failed" | "left_out" | "none"} why_empty
 */

const kMarks = /** @type {const} */ (["missing", "failed", "left_out", "none"]);

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
  const answer = await numbers(`/api/studies/${study}/slice?${new URLSearchParams(/** @type {any} */ (asked))}`, signal);
  if (!answer) throw new Error("the server is not ready: ask again");
  const { head, bytes, begin } = answer;
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
      if (bits) return Number.isNaN(values[cell]) ? kMarks[bits[cell] & 3] : "";
      const code = values[cell];
      return code < 0xfffc ? "" : kMarks[0xffff - code];
    },
  };
}

/** @param {any} side */
function bin_side(side) {
  const inner = side.log ? Math.log : (/** @type {number} */ v) => v;
  const outer = side.log ? Math.exp : (/** @type {number} */ v) => v;
  const from = inner(side.least);
  // A column of one value has one bin with some width.
  const width = (inner(side.most) - from) || 1e-9;
  const edges = Array.from({ length: side.bins + 1 }, (_, i) => outer(from + (width * i) / side.bins));
  const values = Float64Array.from({ length: side.bins }, (_, i) => outer(from + (width * (i + 0.5)) / side.bins));
  return { name: side.column, unit: side.unit, values, edges, is_whole: true };
}

/**
 * How many points lie in cells over one or two columns, or the mean of a third there.
 * @param {number} study @param {Record<string, string | number>} asked @param {AbortSignal} signal
 * @param {(key: string) => string} unit_of @returns {Promise<Picture>}
 */
export async function bins(study, asked, signal, unit_of) {
  const answer = await numbers(`/api/studies/${study}/bins?${new URLSearchParams(/** @type {any} */ (asked))}`, signal);
  if (!answer) throw new Error("the server is not ready: ask again");
  const { head, bytes, begin } = answer;
  const x = bin_side(head.x);
  const y = head.y ? bin_side(head.y) : { name: "", unit: "", values: new Float64Array(1), is_whole: true };
  const cells = x.values.length * y.values.length;
  const counts = new Uint32Array(bytes, begin, cells);
  const values = head.z ? new Float32Array(bytes, begin + 4 * cells, cells) : Float32Array.from(counts, (n) => (n > 0 ? n : NaN));
  let least = null;
  let most = null;
  for (const value of values) {
    if (Number.isNaN(value)) continue;
    least = least === null ? value : Math.min(least, value);
    most = most === null ? value : Math.max(most, value);
  }
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
