// @ts-check
// Numbers as people read them.

/** A whole number, its thousands apart. @param {number} value */
export function count(value) {
  return Math.round(value).toLocaleString("en").replaceAll(",", "\u202f");
}

/**
 * A measured value, to that many digits.
 * @param {number | null | undefined} value @param {number} [digits]
 */
export function shown(value, digits = 5) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e");
  return String(Number(value.toPrecision(digits)));
}

/** @param {number | null | undefined} value @param {string} unit */
export function with_unit(value, unit) {
  return unit && unit !== "1" ? `${shown(value)} ${unit}` : shown(value);
}

/** Inputs whose names outputs would have without their units: dt is the step that is asked for, dt_s the one that was taken. */
const kTaken = ["dt"];

/** What an axis or a column is called: its name and unit. @param {string} name @param {string} unit */
export function heading(name, unit) {
  if (!unit || unit === "1") return name;
  const suffix = `_${unit.replace("/", "_").replaceAll(" ", "")}`;
  const short = name.endsWith(suffix) ? name.slice(0, -suffix.length) : name;
  return `${kTaken.includes(short) ? name : short} [${unit}]`;
}

/** A time that is left. @param {number | null} seconds */
export function time_left(seconds) {
  if (seconds === null) return "";
  if (seconds < 90) return `${Math.ceil(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return seconds < 172800 ? `${(seconds / 3600).toFixed(1)} h` : `${Math.round(seconds / 86400)} days`;
}

/** For a command line. @param {string} text */
export function quoted(text) {
  return /^[A-Za-z0-9_.,:=/@%+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;
}

/** What tells a command the file that it is to read; empty: it asks the server. @param {string} file */
export const of_file = (file) => (file ? ` --db ${quoted(file)}` : "");

/** A line of a CSV file, without its end. @param {any[]} values */
export const csv_line = (values) => values.map((value) => (/[",\r\n]/.test(String(value)) ? `"${String(value).replaceAll('"', '""')}"` : value)).join(",");
