// Formats numbers, units and command lines as text.

/** Formats an integer with separated thousands. */
export const count = (value) => Math.round(value).toLocaleString("en").replaceAll(",", "\u202f");

/** Formats a count with its noun: "1 point", "12 points". */
export const counted = (value, noun) => `${count(value)} ${noun}${value === 1 ? "" : "s"}`;

/** Formats a measured value with `digits` digits. */
export function shown(value, digits = 5) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  if (size >= 1e6 || (size < 1e-4 && size > 0)) {
    return value
      .toExponential(digits - 1)
      .replace(/\.?0+e/, "e")
      .replace("e+", "e");
  }
  return String(Number(value.toPrecision(digits)));
}

/**
 * Returns the unit in which a column is shown (the same as in tables of `oblique query`) and the
 * factor from the SI unit.
 */
export function shownUnit(name, unit) {
  const column = name.replace(/^mean of /, "");
  if (/^(duration_s|stick_total_s|dt_s|major_peak_\d_t_s)$/.test(column)) return ["µs", 1e6];
  if (column === "slide_m") return ["mm", 1e3];
  if (column === "wall_s") return ["ms", 1e3];
  return [unit === "1" ? "" : (unit ?? ""), 1];
}

/** Returns the name of a column or axis with its shown unit, unless the name ends with the unit. */
export function heading(name, unit) {
  const [text, factor] = shownUnit(name, unit);
  const suffix = `_${text.replace("/", "_").replaceAll(" ", "")}`;
  return !text || (factor === 1 && name.endsWith(suffix)) ? name : `${name} [${text}]`;
}

/** Formats a value, given in SI units, in the shown unit of its column. */
export function withUnit(value, name, unit, digits = 5) {
  const [text, factor] = shownUnit(name, unit);
  return typeof value === "number"
    ? `${shown(value * factor, digits)} ${text}`.trim()
    : (value ?? "–");
}

/** Formats the remaining time, given in seconds; null means unknown. */
export function timeLeft(seconds) {
  if (seconds === null) return "";
  if (seconds < 90) return `${Math.ceil(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return seconds < 172800
    ? `${(seconds / 3600).toFixed(1)} h`
    : `${Math.round(seconds / 86400)} days`;
}

/** Quotes an argument of a command line. */
export const quoted = (text) =>
  /^[A-Za-z0-9_.,:=/@%+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;

/** Returns " --db FILE" for commands that read `file`, or "" for commands that use a server. */
export const dbFlag = (file) => (file ? ` --db ${quoted(file)}` : "");

const csvField = (value) =>
  /[",\r\n]/.test(String(value)) ? `"${String(value).replaceAll('"', '""')}"` : String(value ?? "");

/** Formats rows of values as a CSV file. Readers skip empty lines, so an empty row is `""`. */
export const csv = (rows) =>
  rows.map((row) => `${row.map(csvField).join(",") || '""'}\r\n`).join("");
