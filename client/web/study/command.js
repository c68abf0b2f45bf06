// @ts-check
// A view as the commands that make it.
import { quoted } from "/parts/format.js";

/**
 * @param {string} study @param {URLSearchParams} view @param {string[]} at KEY=VALUE of the other axes
 * @param {string[]} inside conditions of a part that is zoomed into
 */
export function plot_command(study, view, at, inside) {
  const is = (/** @type {string} */ name) => view.get(name) ?? "";
  const words = ["oblique", "plot", study];
  const kind = is("pic");
  const z = is("z");
  if (kind === "lines") words.push("--lines", z, "--x", is("x"), ...(is("y") ? ["--by", is("y")] : []));
  else if (kind === "histogram") words.push("--histogram", is("x"));
  else if (kind === "gathered") words.push("--scatter", `${is("x")},${is("y")}`, ...(z ? ["--colour", z] : []));
  else words.push("--map", z, "--x", is("x"), ...(is("y") ? ["--y", is("y")] : []));
  for (const place of kind === "map" || kind === "lines" ? at : []) words.push("--at", place);
  if (inside.length > 0) words.push("--where", inside.join(" AND "));
  if (is("xlog")) words.push("--log-x");
  if (is("ylog")) words.push("--log-y");
  if (is("zlog")) words.push("--log-colour");
  if (is("from") && is("to")) words.push("--range", `${is("from")}:${is("to")}`);
  if (is("pal")) words.push("--palette", is("pal"));
  return words.map(quoted).join(" ") + " --out picture.svg";
}

/** @param {string} study @param {string[]} columns @param {string} where @param {string} order */
export function query_command(study, columns, where, order) {
  return ["oblique", "query", study, "--select", columns.join(","), ...(where ? ["--where", where] : []),
    ...(order ? ["--order", order] : [])].map(quoted).join(" ");
}
