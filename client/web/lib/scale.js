// Linear and logarithmic scales, and round values for ticks.

const identity = (value) => value;

/** Creates a scale that maps `from` to 0 and `to` to 1. */
export function scale(from, to, isLog) {
  const [inner, outer] = isLog ? [Math.log, Math.exp] : [identity, identity];
  const start = inner(from);
  const width = inner(to) - start || 1;
  return {
    from,
    to,
    isLog,
    place: (value) => (inner(value) - start) / width,
    value: (place) => outer(start + place * width),
  };
}

/** Returns the smallest and largest finite number, or null if there is none. */
export function endsOf(values) {
  let [least, most] = [Infinity, -Infinity];
  for (const value of values) {
    if (typeof value !== "number" || Number.isNaN(value)) continue;
    if (value < least) least = value;
    if (value > most) most = value;
  }
  return least <= most ? [least, most] : [null, null];
}

/** Whether all values in a range count as one, because they differ by rounding at most. */
export const countAsOne = (from, to) =>
  !(to - from > Math.max(1e-12 * Math.max(Math.abs(from), Math.abs(to)), 1e-300));

/**
 * Returns the round number that is subtracted from the ticks of a range; 0 unless the ticks would
 * need more than about six digits.
 */
export function baseOf(from, to) {
  const [size, width] = [Math.max(Math.abs(from), Math.abs(to)), to - from];
  if (countAsOne(from, to) || width > 1e-4 * size) return 0;
  const digits = Math.floor(Math.log10(size)) - Math.floor(Math.log10(1.01 * width));
  return Number(((from + to) / 2).toPrecision(digits));
}

/** Formats the number of baseOf for the label of an axis. */
export const baseText = (base) =>
  base === 0 ? "" : ` ${base > 0 ? "\u2212" : "+"} ${tickText(Math.abs(base))}`;

/** Returns about `wanted` round values within a range. */
export function ticks({ from, to, isLog }, wanted) {
  const [least, most] = [Math.min(from, to), Math.max(from, to)];
  const width = most - least;
  // In a range of a few ulps, adding a step would not change the value and the loop would not end.
  if (!(width < Infinity) || countAsOne(least, most)) return [least];
  if (isLog && most / least >= 8) return logTicks(least, most, wanted);
  const rough = width / Math.max(wanted, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((digit) => digit * power >= rough * 0.67) * power;
  const first = Math.ceil(least / step - 1e-9);
  const number = Math.floor(most / step + 1e-9) - first + 1;
  return Array.from({ length: number }, (_, i) => Number(((first + i) * step).toPrecision(15)));
}

function logTicks(least, most, wanted) {
  const decades = Math.log10(most) - Math.log10(least);
  const digits = decades > wanted ? [1] : decades > wanted / 3 ? [1, 3] : [1, 2, 5];
  const step = Math.max(1, Math.round(decades / wanted));
  const found = [];
  for (let power = Math.floor(Math.log10(least)); power <= Math.log10(most); power += step) {
    found.push(...digits.map((digit) => Number((digit * 10 ** power).toPrecision(12))));
  }
  return found.filter((value) => value >= least * (1 - 1e-9) && value <= most * (1 + 1e-9));
}

/** Formats the difference of a value from the number of baseOf. */
export function tickText(value, base = 0) {
  const shown = Number((value - base).toPrecision(base === 0 ? 7 : 3));
  const size = Math.abs(shown);
  const isLong = shown !== 0 && (size >= 1e5 || size < 1e-3);
  const text = isLong ? shown.toExponential().replace("e+", "e") : String(shown);
  return text.replaceAll("-", "\u2212");
}

/** Returns the quantile `share` (0 to 1) of ascending numbers. */
export function quantile(sorted, share) {
  const at = (sorted.length - 1) * share;
  const low = Math.floor(at);
  return sorted[low] + (at - low) * ((sorted[low + 1] ?? sorted[low]) - sorted[low]);
}
