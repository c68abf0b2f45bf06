// @ts-check
// A picture as lines over an axis, or as bars.
import { shown } from "/parts/format.js";
import { line_plot } from "/parts/lines.js";

/**
 * @typedef {{as_bars: boolean, x_log: boolean, y_log: boolean, drag_marks: boolean, y_ends?: number[], zoomed: (part: import("/parts/lines.js").Part | null) => void, counts?: ArrayLike<number> | null, brushed: ((part: import("/parts/lines.js").Part | null, is_further?: boolean) => void)}} How
 *   with how many of each bar are marked, and what to do with a part that somebody marks
 */

/** @param {import("../pictures.js").Picture} picture @param {How} how @returns {import("/parts/lines.js").Lines} */
function lines_of(picture, { as_bars, x_log, y_log, drag_marks, y_ends, zoomed, counts, brushed }) {
  const order = order_of(picture);
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
  return { title: as_bars ? `How often values of ${picture.x.name} are met` : `${picture.z.name} over ${picture.x.name}`,
    x: { name: picture.x.name, unit: picture.x.unit, values: xs, is_log: x_log && xs[0] > 0, ends, edges: picture.x.edges },
    y: { name: as_bars ? "points" : picture.z.name, unit: as_bars ? "" : picture.z.unit, is_log: y_log && !as_bars, ends: y_ends }, series, as_bars, brushed, zoomed, drag_marks, height: 380 };
}

/** @param {import("../pictures.js").Picture} picture */
const order_of = (picture) => Array.from(picture.x.values.keys()).sort((a, b) => picture.x.values[a] - picture.x.values[b]);

/** @param {import("../pictures.js").Picture} picture @param {How} how */
export function drawn_lines(picture, how) {
  const plot = line_plot(lines_of(picture, how));
  return { element: plot.element, go_on: (/** @type {typeof plot.hands} */ hands) => plot.go_on(hands), close: () => plot.close(), figure: () => plot.figure(),
    get hands() {
      return plot.hands;
    },
    /** Another picture in the same plot. @param {import("../pictures.js").Picture} other @param {How} how_ @returns {boolean} false: it must be made anew */
    update(other, how_) {
      if (!plot.update(lines_of(other, how_))) return false;
      picture = other;
      return true;
    },
    /** @param {import("../pictures.js").Marks | null} marks of the picture's cells */
    mark(marks) {
      const nx = picture.x.values.length;
      plot.mark(marks && Array.from(picture.y.values.keys()).map((row) => order_of(picture).map((i) => marks.cells[row * nx + i])));
    } };
}
