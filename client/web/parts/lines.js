// @ts-check
// Lines over an axis, by uPlot: with keys to move the cursor, a spoken value, and spans shaded behind.
import uPlot from "/vendor/uPlot.esm.js";
import { h } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { heading, shown } from "/parts/format.js";
import { scale, ticks, tick_text } from "/parts/scale.js";

const kDashes = [[], [7, 3], [2, 3], [9, 3, 2, 3], [14, 4], [4, 2], [1, 4], [12, 3, 3, 3]];
const kFills = ["bar", "line1"];
const kInks = ["line0", "line1", "line2", "line3", "line4", "line5", "line6", "line7"];

/**
 * @typedef {{label: string, values: ArrayLike<number | null>, colour?: number}} Series
 * @typedef {{from: number, to: number, ink: string, is_band?: boolean}} Span a band is a bar at the foot
 * @typedef {object} Lines
 * @property {string} title
 * @property {{name: string, unit: string, values: ArrayLike<number>, is_log?: boolean, ends?: number[], edges?: number[]}} x
 * @property {{name: string, unit: string, is_log?: boolean}} y
 * @property {Series[]} series
 * @property {Span[]} [spans]
 * @property {boolean} [as_bars]
 * @property {(from: number, to: number) => void} [brushed] a span was dragged over, or chosen by Shift and arrows; without it dragging zooms
 * @property {number} [height]
 * @property {(i: number) => void} [moved] the cursor is over value `i`
 */

/** A line as it is drawn. @param {number} look */
function sample(look) {
  const canvas = h("canvas", { width: 34, height: 10, class: "sample", "aria-hidden": "true" });
  const context = canvas.getContext("2d");
  context.strokeStyle = ink(kInks[look]);
  context.lineWidth = 2.4;
  context.setLineDash(kDashes[look]);
  context.moveTo(0, 5);
  context.lineTo(34, 5);
  context.stroke();
  return canvas;
}

/** @param {Lines} of */
export function line_plot(of) {
  const said = h("p", { class: "reading", "aria-live": "polite" });
  const place = h("div", { class: "plot", tabIndex: 0, role: "application", "aria-roledescription": "plot",
    "aria-label": `${of.title}; arrow keys move the cursor` });
  const legend = h("ul", { class: "legend" }, ...(of.series.length > 1 ? of.series : []).map((one, i) => h("li", {},
    of.as_bars ? h("span", { class: `shade ink-${kFills[i]}` }) : sample((one.colour ?? i) % 8), one.label)));
  const element = h("figure", { class: "lines" }, h("figcaption", {}, of.title), legend, place, said);
  /** @type {any} */
  let plot = null;
  let at = -1;
  /** Where a span of keys began; -1: nowhere. */
  let anchor = -1;
  let quiet = false;

  const read = (/** @type {number} */ i) => {
    const x = of.x.values[i];
    said.textContent = x === undefined ? "" : `${of.x.name} ${shown(x)} ${of.x.unit}: ` + of.series.map((one) =>
      `${of.series.length > 1 ? `${one.label} ` : ""}${shown(one.values[i])} ${of.y.unit}`).join(", ");
  };
  /** What is shown unless somebody zooms: uPlot would round logarithmic ends to powers of ten. @param {any} _ @param {number} least @param {number} most */
  const range = (_, least, most) => {
    const all = of.x.values;
    const is_all = least === all[0] && most === all[all.length - 1];
    const [from, to] = is_all && of.x.ends ? of.x.ends : [least, most];
    return to > from ? [from, to] : [from - (Math.abs(from) * 0.05 || 0.5), to + (Math.abs(to) * 0.05 || 0.5)];
  };
  const options = (/** @type {number} */ width) => {
    const axis = { stroke: ink("text"), grid: { stroke: ink("grid"), width: 1 }, ticks: { stroke: ink("weak"), width: 1 },
      font: "12px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif",
      // Ticks as those of maps: uPlot's own of logarithmic axes want ends that are powers of ten.
      splits: (/** @type {any} */ u, /** @type {number} */ i, /** @type {number} */ least, /** @type {number} */ most) => (i === 0
        ? ticks(scale(least, most, of.x.is_log ?? false), Math.max(u.bbox.width / (window.devicePixelRatio || 1) / 80, 2))
        : ticks(scale(least, most, of.y.is_log ?? false), Math.max((of.height ?? 240) / 50, 2))),
      filter: (/** @type {any} */ _, /** @type {number[]} */ splits) => splits,
      values: (/** @type {any} */ _, /** @type {number[]} */ splits) => splits.map(tick_text) };
    return { width, height: of.height ?? 240, legend: { show: false }, ms: 1,
      cursor: { points: { size: 7 }, drag: { x: true, y: false, setScale: !of.brushed } },
      scales: { x: { time: false, distr: of.x.is_log ? 3 : 1, range }, y: { distr: of.y.is_log ? 3 : 1 } },
      axes: [{ ...axis, label: heading(of.x.name, of.x.unit), labelSize: 22, size: 34 },
        { ...axis, label: heading(of.y.name, of.y.unit), labelSize: 22, size: 62 }],
      series: [{}, ...of.series.map((one, i) => ({ label: one.label, stroke: ink(kInks[(one.colour ?? i) % 8]), width: 1.6,
        dash: kDashes[(one.colour ?? i) % 8], spanGaps: false, points: { show: of.x.values.length < 60 && !of.as_bars, size: 4 },
        ...(of.as_bars ? { paths: uPlot.paths.bars({ size: [1, Infinity] }), fill: ink(kFills[i]), dash: [], stroke: ink("weak"), width: 0.5 } : {}) }))],
      hooks: {
        setSelect: [(/** @type {any} */ u) => {
          const { left, width: wide } = u.select;
          if (!of.brushed || wide < 3) return;
          u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
          of.brushed(u.posToVal(left, "x"), u.posToVal(left + wide, "x"));
        }],
        drawClear: [(/** @type {any} */ u) => {
          for (const span of of.spans ?? []) {
            const from = Math.max(u.valToPos(span.from, "x", true), u.bbox.left);
            const to = Math.min(u.valToPos(span.to, "x", true), u.bbox.left + u.bbox.width);
            if (to <= from) continue;
            u.ctx.fillStyle = ink(span.ink);
            const high = span.is_band ? 10 * (window.devicePixelRatio || 1) : u.bbox.height;
            u.ctx.fillRect(from, u.bbox.top + u.bbox.height - high, to - from, high);
          }
        }],
        setCursor: [(/** @type {any} */ u) => {
          const i = u.cursor.idx;
          if (i === null || i === undefined || i === at) return;
          at = i;
          if (quiet) return;
          read(i);
          of.moved?.(i);
        }],
      } };
  };
  const move = (/** @type {number} */ i) => {
    if (!plot || of.x.values[i] === undefined) return;
    const y = of.series[0]?.values[i];
    plot.setCursor({ left: plot.valToPos(of.x.values[i], "x"), top: typeof y === "number" ? plot.valToPos(y, "y") : -1 });
  };
  place.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
    const last = of.x.values.length - 1;
    const step = Math.max(Math.round(last / 200), 1);
    const to = /** @type {Record<string, number>} */ ({ ArrowLeft: Math.max(at - step, 0), ArrowRight: Math.min(at + step, last), Home: 0, End: last })[event.key];
    if (to === undefined) return;
    event.preventDefault();
    anchor = event.shiftKey ? (anchor < 0 ? Math.max(at, 0) : anchor) : -1;
    move(to);
    const [from, until] = [Math.min(anchor, to), Math.max(anchor, to)];
    if (anchor >= 0) of.brushed?.(of.x.edges?.[from] ?? of.x.values[from], of.x.edges?.[until + 1] ?? of.x.values[until]);
  });
  const watch = new ResizeObserver(() => {
    const width = place.clientWidth;
    if (width < 60) return;
    if (plot) plot.setSize({ width, height: of.height ?? 240 });
    else plot = new uPlot(options(width), [of.x.values, ...of.series.map((one) => one.values)], place);
  });
  watch.observe(place);
  return { element,
    /** Puts the cursor at value `i` without telling. @param {number} i */
    point_at(i) {
      if (i === at) return;
      quiet = true;
      move(i);
      quiet = false;
    },
    close() {
      watch.disconnect();
      plot?.destroy();
    } };
}
