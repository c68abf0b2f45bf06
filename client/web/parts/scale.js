// @ts-check
// From values to places and back, linear or logarithmic, and where ticks stand.

/**
 * @typedef {{from: number, to: number, is_log: boolean, place: (v: number) => number, value: (p: number) => number}} Scale
 */

/** Places run from 0 at `from` to 1 at `to`. @param {number} from @param {number} to @param {boolean} is_log @returns {Scale} */
export function scale(from, to, is_log) {
  const inner = is_log ? Math.log : (/** @type {number} */ v) => v;
  const outer = is_log ? Math.exp : (/** @type {number} */ v) => v;
  const a = inner(from);
  const width = inner(to) - a || 1;
  return { from, to, is_log, place: (v) => (inner(v) - a) / width, value: (p) => outer(a + p * width) };
}

/** The least and the most; null: there is none. Columns may be longer than a call has arguments. @param {ArrayLike<number | null>} values @returns {[number | null, number | null]} */
export function ends_of(values) {
  let least = /** @type {number | null} */ (null);
  let most = /** @type {number | null} */ (null);
  for (let i = 0; i < values.length; ++i) {
    const value = values[i];
    if (value === null || Number.isNaN(value)) continue;
    least = least === null ? value : Math.min(least, value);
    most = most === null ? value : Math.max(most, value);
  }
  return [least, most];
}

/** The nearest of 1, 2, 5 times a power of ten. @param {number} rough */
function nice(rough) {
  const power = 10 ** Math.floor(Math.log10(rough));
  const first = rough / power;
  return (first < 1.5 ? 1 : first < 3.5 ? 2 : first < 7.5 ? 5 : 10) * power;
}

/** About `wanted` round values. @param {Scale} of @param {number} wanted @returns {number[]} */
export function ticks(of, wanted) {
  const least = Math.min(of.from, of.to);
  const most = Math.max(of.from, of.to);
  const wide = most - least;
  // Steps of a range of a few ulps would not move on.
  if (!(wide < Infinity && wide > 1e-12 * Math.max(Math.abs(least), Math.abs(most)))) return [least];
  if (of.is_log && most / least >= 8) {
    const decades = Math.log10(most / least);
    const each = decades > wanted ? [1] : decades > wanted / 3 ? [1, 3] : [1, 2, 5];
    const step = Math.max(1, Math.round(decades / wanted));
    const found = [];
    for (let power = Math.floor(Math.log10(least)); power <= Math.log10(most); power += step) {
      for (const digit of each) {
        const value = Number((digit * 10 ** power).toPrecision(12));
        if (value >= least * (1 - 1e-9) && value <= most * (1 + 1e-9)) found.push(value);
      }
    }
    return found;
  }
  const step = nice(wide / Math.max(wanted, 1));
  const found = [];
  // Counted, for sums with the largest numbers are infinite.
  const last = Math.floor(most / step + 1e-9);
  for (let i = Math.ceil(least / step - 1e-9); i <= last; ++i) {
    found.push(Number((i * step).toPrecision(12)));
  }
  return found;
}

/** A tick's text. @param {number} value */
export function tick_text(value) {
  const size = Math.abs(value);
  if (value !== 0 && (size >= 1e5 || size < 1e-3)) return value.toExponential().replace("e+", "e").replace("-", "\u2212");
  return String(value).replace("-", "\u2212");
}
