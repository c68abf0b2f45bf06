// @ts-check
// A picture as lines over an axis, or as bars.
import { shown } from "/parts/format.js";
import { line_plot } from "/parts/lines.js";

/**
 * @param {import("../asked/picture.js").Picture} picture
 * @param {{as_bars: boolean, x_log: boolean, y_log: boolean, drag_marks: boolean, y_ends?: number[], zoomed: (part: import("/parts/lines.js").Part | null) => void, counts?: Uint32Array | null, brushed: ((part: import("/parts/lines.js").Part | null) => void)}} how
 *   with how many of each bar are marked, and what to do with a part that somebody marks
 */
export function drawn_lines(picture, { as_bars, x_log, y_log, drag_marks, y_ends, zoomed, counts, brushed }) {
  const order = Array.from(picture.x.values.keys()).sort((a, b) => picture.x.values[a] - picture.x.values[b]);
  const nx = picture.x.values.length;
  const unit = picture.y.unit && picture.y.unit !== "1" ? ` ${picture.y.unit}` : "";
  const series = Array.from(picture.y.values.keys()).map((row) => ({
    label: as_bars ? "all" : picture.y.name ? `${picture.y.name} = ${shown(picture.y.values[row])}${unit}` : picture.z.name,
    values: order.map((i) => {
      const value = as_bars ? picture.head.counts[i] : picture.values[row * nx + i];
      return Number.isFinite(value) && !(y_log && value <= 0) ? value : null;
    }) }));
  if (as_bars && counts) series.push({ label: "marked", values: order.map((i) => counts[i] ?? 0) });
  const xs = order.map((i) => picture.x.values[i]);
  const ends = picture.x.edges ? [picture.x.edges[0], picture.x.edges[picture.x.edges.length - 1]] : [xs[0], xs[xs.length - 1]];
  const plot = line_plot({ title: as_bars ? `How often values of ${picture.x.name} are met` : `${picture.z.name} over ${picture.x.name}`,
    x: { name: picture.x.name, unit: picture.x.unit, values: xs, is_log: x_log && xs[0] > 0, ends, edges: picture.x.edges },
    y: { name: as_bars ? "points" : picture.z.name, unit: as_bars ? "" : picture.z.unit, is_log: y_log && !as_bars, ends: y_ends }, series, as_bars, brushed, zoomed, drag_marks, height: 380 });
  return { ...plot,
    /** @param {import("../asked/question.js").Marks | null} marks of the picture's cells */
    mark(marks) {
      plot.mark(marks && Array.from(picture.y.values.keys()).map((row) => order.map((i) => marks.cells[row * nx + i])));
    } };
}
