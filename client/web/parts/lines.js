// @ts-check
// Lines over an axis, by uPlot: with keys to move the cursor, a spoken value, and spans shaded behind.
import { h } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { heading, shown } from "/parts/format.js";
import { scale, ticks, tick_text } from "/parts/scale.js";

// A script of its own, which modules come after (index.html): it is minified as no module.
const uPlot = /** @type {any} */ (globalThis).uPlot;

const kDashes = [[], [7, 3], [2, 3], [9, 3, 2, 3], [14, 4], [4, 2], [1, 4], [12, 3, 3, 3]];
/** Each of fewer values is drawn as a point too. */
const kFewValues = 60;
const kFills = ["bar", "line1"];
const kInks = ["line0", "line1", "line2", "line3", "line4", "line5", "line6", "line7"];

/**
 * @typedef {{label: string, values: ArrayLike<number | null>, colour?: number}} Series
 * @typedef {{from: number, to: number, ink: string, is_band?: boolean}} Span a band is a bar at the foot
 * @typedef {{x: number[], y: number[] | null}} Part where it ends; y null: all
 * @typedef {object} Lines
 * @property {string} title
 * @property {{name: string, unit: string, values: ArrayLike<number>, is_log?: boolean, ends?: number[], edges?: number[]}} x
 * @property {{name: string, unit: string, is_log?: boolean, ends?: number[]}} y
 * @property {Series[]} series
 * @property {Span[]} [spans]
 * @property {boolean} [as_bars]
 * @property {(part: Part | null, is_further?: boolean) => void} [brushed] a part is marked, by dragging or by Shift and arrows, which go on with the part that they marked last; null: nothing is
 * @property {(part: Part | null) => void} [zoomed] a part is zoomed into; null: all is shown. Without it the plot zooms by itself
 * @property {boolean} [drag_marks] dragging marks, and with Shift it zooms; else the other way round
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

/** What of lines is not their numbers, nor follows from these later. @param {Lines} of */
const look_of = (of) => JSON.stringify([of.title, of.x.name, of.x.unit, of.x.is_log, of.y, of.as_bars, of.spans, of.height, of.x.values.length < kFewValues,
  of.series.map((one) => [one.label, one.colour])]);

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
  /** Whether a drag zooms. */
  let zooms = true;
  let quiet = false;
  /** Which values of each series are marked. @type {ArrayLike<number | boolean>[] | null} */
  let marked = null;

  const read = (/** @type {number} */ i) => {
    const x = of.x.values[i];
    said.textContent = x === undefined ? "" : `${of.x.name} ${shown(x)} ${of.x.unit}: ` + of.series.map((one, k) =>
      `${of.series.length > 1 ? `${one.label} ` : ""}${shown(one.values[i])} ${of.y.unit}${marked?.[k][i] ? " (marked)" : ""}`).join(", ");
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
      cursor: { points: { size: 7 }, drag: { x: true, y: of.brushed !== undefined && !of.as_bars, uni: 24, setScale: true }, ...(of.zoomed ? { bind: { dblclick: () => () => of.zoomed?.(null) } } : {}) },
      scales: { x: { time: false, distr: of.x.is_log ? 3 : 1, range }, y: { distr: of.y.is_log ? 3 : 1, ...(of.y.ends ? { range: of.y.ends } : {}) } },
      axes: [{ ...axis, label: heading(of.x.name, of.x.unit), labelSize: 22, size: 34 },
        { ...axis, label: heading(of.y.name, of.y.unit), labelSize: 22, size: 62 }],
      series: [{}, ...of.series.map((one, i) => ({ label: one.label, stroke: ink(kInks[(one.colour ?? i) % 8]), width: 1.6,
        dash: kDashes[(one.colour ?? i) % 8], spanGaps: false, points: { show: of.x.values.length < kFewValues && !of.as_bars, size: 4 },
        ...(of.as_bars ? { paths: uPlot.paths.bars({ size: [1, Infinity] }), fill: ink(kFills[i]), dash: [], stroke: ink("weak"), width: 0.5 } : {}) }))],
      hooks: {
        setSelect: [(/** @type {any} */ u) => {
          const { left, width: wide, top, height: high } = u.select;
          if (!of.brushed || u.cursor.drag.setScale || wide < 3) return;
          u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
          const told = zooms ? of.zoomed : of.brushed;
          told?.({ x: [u.posToVal(left, "x"), u.posToVal(left + wide, "x")], y: high < u.over.clientHeight - 1 ? [u.posToVal(top + high, "y"), u.posToVal(top, "y")] : null });
        }],
        draw: [(/** @type {any} */ u) => marked?.forEach((one, k) => draw_marked(u, k, one))],
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
  /** What is marked of a line is thicker, with a disc where it is one value alone or these are few. @param {any} u @param {number} k @param {ArrayLike<number | boolean>} is */
  const draw_marked = (u, k, is) => {
    const ratio = window.devicePixelRatio || 1;
    const { values, colour = k } = of.series[k];
    const has = (/** @type {number} */ i) => Boolean(is[i]) && typeof values[i] === "number";
    const place = (/** @type {number} */ i) => [u.valToPos(of.x.values[i], "x", true), u.valToPos(values[i], "y", true)];
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    u.ctx.clip();
    u.ctx.strokeStyle = u.ctx.fillStyle = ink(kInks[colour % 8]);
    u.ctx.lineWidth = 3.2 * ratio;
    u.ctx.beginPath();
    const discs = [];
    for (let i = 0; i < values.length; ++i) {
      if (!has(i)) continue;
      if (has(i - 1)) u.ctx.lineTo(...place(i));
      else u.ctx.moveTo(...place(i));
      if (values.length < kFewValues || (!has(i - 1) && !has(i + 1))) discs.push(place(i));
    }
    u.ctx.stroke();
    u.ctx.strokeStyle = ink("text");
    u.ctx.lineWidth = 1.2 * ratio;
    for (const [x, y] of discs) {
      u.ctx.beginPath();
      u.ctx.arc(x, y, 4 * ratio, 0, 2 * Math.PI);
      u.ctx.fill();
      u.ctx.stroke();
    }
    u.ctx.restore();
  };
  const step_back = () => {
    for (const one of plot?.series.slice(1) ?? []) one.alpha = marked ? 0.4 : 1;
  };
  const move = (/** @type {number} */ i) => {
    if (!plot || of.x.values[i] === undefined) return;
    const y = of.series[0]?.values[i];
    plot.setCursor({ left: plot.valToPos(of.x.values[i], "x"), top: typeof y === "number" ? plot.valToPos(y, "y") : -1 });
  };
  place.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
    if (!plot || !of.brushed) return;
    zooms = Boolean(of.drag_marks) === event.shiftKey;
    plot.cursor.drag.setScale = zooms && !of.zoomed;
  }, true);
  place.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
    if (event.key === "Escape") of.brushed?.(null);
    const last = of.x.values.length - 1;
    if (of.zoomed && !event.ctrlKey && ["0", "-", "+", "="].includes(event.key)) {
      const [from, until] = [Math.max(at - Math.ceil(last / 4), 0), Math.min(Math.max(at, 0) + Math.ceil(last / 4), last)];
      of.zoomed(event.key === "0" || event.key === "-" ? null : { x: [of.x.edges?.[from] ?? of.x.values[from], of.x.edges?.[until + 1] ?? of.x.values[until]], y: null });
      event.preventDefault();
      return;
    }
    const step = Math.max(Math.round(last / 200), 1);
    const to = /** @type {Record<string, number>} */ ({ ArrowLeft: Math.max(at - step, 0), ArrowRight: Math.min(at + step, last), Home: 0, End: last })[event.key];
    if (to === undefined) return;
    event.preventDefault();
    const is_further = anchor >= 0;
    anchor = event.shiftKey ? (anchor < 0 ? Math.max(at, 0) : anchor) : -1;
    move(to);
    const [from, until] = [Math.min(anchor, to), Math.max(anchor, to)];
    if (anchor >= 0) of.brushed?.({ x: [of.x.edges?.[from] ?? of.x.values[from], of.x.edges?.[until + 1] ?? of.x.values[until]], y: null }, is_further);
  });
  const watch = new ResizeObserver(() => {
    const width = place.clientWidth;
    if (width < 60) return;
    if (plot) plot.setSize({ width, height: of.height ?? 240 });
    else plot = new uPlot(options(width), [of.x.values, ...of.series.map((one) => one.values)], place);
    step_back();
  });
  watch.observe(place);
  return { element,
    /** Shows other numbers in the same plot. @param {Lines} other @returns {boolean} false: it must be made anew */
    update(other) {
      if (!plot || look_of(other) !== look_of(of)) return false;
      if (other.x.values.length !== of.x.values.length) at = anchor = -1;
      of = other;
      marked = null;
      step_back();
      plot.setData([of.x.values, ...of.series.map((one) => one.values)]);
      if (said.textContent !== "") read(at);
      return true;
    },
    /** Where somebody is by keys. */
    get hands() {
      return { has_focus: element.contains(document.activeElement), at, anchor };
    },
    /** Goes on where somebody was in another plot of the same. @param {{has_focus: boolean, at: number, anchor: number}} hands */
    go_on(hands) {
      ({ at, anchor } = hands);
      if (hands.has_focus) place.focus({ preventScroll: true });
    },
    /** Puts the cursor at value `i` without telling. @param {number} i */
    point_at(i) {
      if (i === at) return;
      quiet = true;
      move(i);
      quiet = false;
    },
    /** @param {ArrayLike<number | boolean>[] | null} which values of each series; null: none */
    mark(which) {
      marked = which;
      step_back();
      plot?.redraw(false);
    },
    close() {
      watch.disconnect();
      plot?.destroy();
    } };
}
