// @ts-check
// Lines over an axis, by uPlot: with keys to move the cursor, a spoken value, and spans shaded behind.
import { h } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { heading, shown } from "/parts/format.js";
import { scale, ticks, tick_text } from "/parts/scale.js";

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

// A script of its own, which modules come after (index.html): it is minified as no module.
const uPlot = /** @type {any} */ (globalThis).uPlot;

const kDashes = [[], [7, 3], [2, 3], [9, 3, 2, 3], [14, 4], [4, 2], [1, 4], [12, 3, 3, 3]];
/** Each of fewer values is drawn as a point too. */
const kFewValues = 60;
const kFills = ["bar", "line1"];
const kInks = ["line0", "line1", "line2", "line3", "line4", "line5", "line6", "line7"];

const kHeight = 240;

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

/** Which line is which, where there are several. @param {Lines} of */
function legend_of(of) {
  const several = of.series.length > 1 ? of.series : [];
  return h("ul", { class: "legend" }, ...several.map((one, i) => h("li", {},
    of.as_bars ? h("span", { class: `shade ink-${kFills[i]}` }) : sample((one.colour ?? i) % 8), one.label)));
}

/** What of lines is not their numbers, nor follows from these later. @param {Lines} of */
const look_of = (of) => JSON.stringify([of.title, of.x.name, of.x.unit, of.x.is_log, of.y, of.as_bars, of.spans, of.height, of.x.values.length < kFewValues,
  of.series.map((one) => [one.label, one.colour])]);

/** What is shown unless somebody zooms: uPlot would round logarithmic ends to powers of ten. @param {Lines["x"]} x @param {number} least @param {number} most */
function shown_ends({ values, ends }, least, most) {
  const is_all = least === values[0] && most === values[values.length - 1];
  const [from, to] = is_all && ends ? ends : [least, most];
  return to > from ? [from, to] : [from - (Math.abs(from) * 0.05 || 0.5), to + (Math.abs(to) * 0.05 || 0.5)];
}

/** Both axes. @param {Lines} of @param {number} height */
function axes_of(of, height) {
  const axis = { stroke: ink("text"), grid: { stroke: ink("grid"), width: 1 }, ticks: { stroke: ink("weak"), width: 1 },
    font: "12px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif",
    // Ticks as those of maps: uPlot's own of logarithmic axes want ends that are powers of ten.
    splits: (/** @type {any} */ u, /** @type {number} */ i, /** @type {number} */ least, /** @type {number} */ most) => (i === 0
      ? ticks(scale(least, most, of.x.is_log ?? false), Math.max(u.bbox.width / (window.devicePixelRatio || 1) / 80, 2))
      : ticks(scale(least, most, of.y.is_log ?? false), Math.max(height / 50, 2))),
    filter: (/** @type {any} */ _, /** @type {number[]} */ splits) => splits,
    values: (/** @type {any} */ _, /** @type {number[]} */ splits) => splits.map(tick_text) };
  return [{ ...axis, label: heading(of.x.name, of.x.unit), labelSize: 22, size: 34 },
    { ...axis, label: heading(of.y.name, of.y.unit), labelSize: 22, size: 62 }];
}

/** Lines or bars. @param {Lines} of */
function series_of(of) {
  return of.series.map((one, i) => {
    const look = (one.colour ?? i) % 8;
    const line = { label: one.label, stroke: ink(kInks[look]), width: 1.6, dash: kDashes[look], spanGaps: false,
      points: { show: of.x.values.length < kFewValues && !of.as_bars, size: 4 } };
    return of.as_bars ? { ...line, paths: uPlot.paths.bars({ size: [1, Infinity] }), fill: ink(kFills[i]), dash: [], stroke: ink("weak"), width: 0.5 } : line;
  });
}

/** What uPlot is told. @param {() => Lines} now whose numbers may become others, and with them the ends of x @param {number} width */
function options_of(now, width) {
  const of = now();
  const height = of.height ?? kHeight;
  return { width, height, legend: { show: false }, ms: 1,
    cursor: { points: { size: 7 }, drag: { x: true, y: of.brushed !== undefined && !of.as_bars, uni: 24, setScale: true },
      ...(of.zoomed ? { bind: { dblclick: () => () => now().zoomed?.(null) } } : {}) },
    scales: { x: { time: false, distr: of.x.is_log ? 3 : 1, range: (/** @type {any} */ _, /** @type {number} */ least, /** @type {number} */ most) => shown_ends(now().x, least, most) },
      y: { distr: of.y.is_log ? 3 : 1, ...(of.y.ends ? { range: of.y.ends } : {}) } },
    axes: axes_of(of, height), series: [{}, ...series_of(of)] };
}

/** Behind the lines; bands at their foot. @param {any} u @param {Span[]} spans */
function draw_spans(u, spans) {
  for (const span of spans) {
    const from = Math.max(u.valToPos(span.from, "x", true), u.bbox.left);
    const to = Math.min(u.valToPos(span.to, "x", true), u.bbox.left + u.bbox.width);
    if (to <= from) continue;
    u.ctx.fillStyle = ink(span.ink);
    const high = span.is_band ? 10 * (window.devicePixelRatio || 1) : u.bbox.height;
    u.ctx.fillRect(from, u.bbox.top + u.bbox.height - high, to - from, high);
  }
}

/** What is marked of a line is thicker, with a disc where it is one value alone or these are few. @param {any} u @param {Lines} of @param {number} k which line @param {ArrayLike<number | boolean>} is */
function draw_marked(u, of, k, is) {
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
}

/** A plot of lines or bars, with its legend and what is spoken of it. @param {Lines} of */
export const line_plot = (of) => new LinePlot(of);

class LinePlot {
  /** The cursor is over that value; -1: over none. */
  #at = -1;
  /** Where a span of keys began; -1: nowhere. */
  #anchor = -1;
  /** Whether a drag zooms. */
  #zooms = true;
  /** The cursor is moved without telling. */
  #is_quiet = false;
  /** Which values of each series are marked. @type {ArrayLike<number | boolean>[] | null} */
  #marked = null;
  /** There as soon as it has room. @type {any} */
  #plot = null;

  /** @param {Lines} of */
  constructor(of) {
    this.of = of;
    this.said = h("p", { class: "reading", "aria-live": "polite" });
    this.place = h("div", { class: "plot", tabIndex: 0, role: "application", "aria-roledescription": "plot",
      "aria-label": `${of.title}; arrow keys move the cursor` });
    this.element = h("figure", { class: "lines" }, h("figcaption", {}, of.title), legend_of(of), this.place, this.said);
    this.place.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => this.#take_hold(event), true);
    this.place.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => this.#press(event));
    this.watch = new ResizeObserver(() => this.#fit());
    this.watch.observe(this.place);
  }

  /** Shows other numbers in the same plot. @param {Lines} other @returns {boolean} false: it must be made anew */
  update(other) {
    if (!this.#plot || look_of(other) !== look_of(this.of)) return false;
    if (other.x.values.length !== this.of.x.values.length) this.#at = this.#anchor = -1;
    this.of = other;
    this.#marked = null;
    this.#step_back();
    this.#plot.setData(this.#data());
    if (this.said.textContent !== "") this.#read(this.#at);
    return true;
  }
  /** Where somebody is by keys. */
  get hands() {
    return { has_focus: this.element.contains(document.activeElement), at: this.#at, anchor: this.#anchor };
  }
  /** Goes on where somebody was in another plot of the same. @param {{has_focus: boolean, at: number, anchor: number}} hands */
  go_on({ has_focus, at, anchor }) {
    this.#at = at;
    this.#anchor = anchor;
    if (has_focus) this.place.focus({ preventScroll: true });
  }
  /** Puts the cursor at value `i` without telling. @param {number} i */
  point_at(i) {
    if (i === this.#at) return;
    this.#is_quiet = true;
    this.#move(i);
    this.#is_quiet = false;
  }
  /** @param {ArrayLike<number | boolean>[] | null} which values of each series; null: none */
  mark(which) {
    this.#marked = which;
    this.#step_back();
    this.#plot?.redraw(false);
  }
  /** As it is drawn. @returns {import("/parts/png.js").Figure} */
  figure() {
    return { title: this.of.title, canvas: this.#plot.ctx.canvas, legend: this.element.querySelector(".legend") };
  }
  close() {
    this.watch.disconnect();
    this.#plot?.destroy();
  }

  #data() {
    return [this.of.x.values, ...this.of.series.map((one) => one.values)];
  }
  /** To the room that there is. */
  #fit() {
    const width = this.place.clientWidth;
    if (width < 60) return;
    if (this.#plot) this.#plot.setSize({ width, height: this.#plot.height });
    else this.#plot = new uPlot({ ...options_of(() => this.of, width), hooks: this.#hooks() }, this.#data(), this.place);
    this.#step_back();
  }
  #hooks() {
    return {
      setSelect: [(/** @type {any} */ u) => this.#let_go(u)],
      draw: [(/** @type {any} */ u) => this.#marked?.forEach((one, k) => draw_marked(u, this.of, k, one))],
      drawClear: [(/** @type {any} */ u) => draw_spans(u, this.of.spans ?? [])],
      setCursor: [(/** @type {any} */ u) => this.#look_at(u.cursor.idx)],
    };
  }
  /** What is not marked steps back behind what is. */
  #step_back() {
    for (const one of this.#plot?.series.slice(1) ?? []) one.alpha = this.#marked ? 0.4 : 1;
  }

  /** @param {number} i */
  #read(i) {
    const { x, y, series } = this.of;
    const values = series.map((one, k) => `${series.length > 1 ? `${one.label} ` : ""}${shown(one.values[i])} ${y.unit}${this.#marked?.[k][i] ? " (marked)" : ""}`);
    this.said.textContent = x.values[i] === undefined ? "" : `${x.name} ${shown(x.values[i])} ${x.unit}: ${values.join(", ")}`;
  }
  /** @param {number | null | undefined} i where the cursor is */
  #look_at(i) {
    if (i === null || i === undefined || i === this.#at) return;
    this.#at = i;
    if (this.#is_quiet) return;
    this.#read(i);
    this.of.moved?.(i);
  }
  /** @param {number} i */
  #move(i) {
    const plot = this.#plot;
    const x = this.of.x.values[i];
    if (!plot || x === undefined) return;
    const y = this.of.series[0]?.values[i];
    plot.setCursor({ left: plot.valToPos(x, "x"), top: typeof y === "number" ? plot.valToPos(y, "y") : -1 });
  }

  /** A drag begins. @param {PointerEvent} event */
  #take_hold(event) {
    if (!this.#plot || !this.of.brushed) return;
    this.#zooms = Boolean(this.of.drag_marks) === event.shiftKey;
    this.#plot.cursor.drag.setScale = this.#zooms && !this.of.zoomed;
  }
  /** A drag ends. @param {any} u */
  #let_go(u) {
    const { left, width, top, height } = u.select;
    if (!this.of.brushed || u.cursor.drag.setScale || width < 3) return;
    u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    const told = this.#zooms ? this.of.zoomed : this.of.brushed;
    told?.({ x: [u.posToVal(left, "x"), u.posToVal(left + width, "x")],
      y: height < u.over.clientHeight - 1 ? [u.posToVal(top + height, "y"), u.posToVal(top, "y")] : null });
  }

  /** @param {KeyboardEvent} event */
  #press(event) {
    if (event.key === "Escape") this.of.brushed?.(null);
    if (this.of.zoomed && !event.ctrlKey && ["0", "-", "+", "="].includes(event.key)) {
      this.#zoom_by_key(event.key);
      event.preventDefault();
      return;
    }
    const last = this.of.x.values.length - 1;
    const step = Math.max(Math.round(last / 200), 1);
    const to = /** @type {Record<string, number>} */ ({ ArrowLeft: Math.max(this.#at - step, 0), ArrowRight: Math.min(this.#at + step, last), Home: 0, End: last })[event.key];
    if (to === undefined) return;
    event.preventDefault();
    const is_further = this.#anchor >= 0;
    this.#anchor = event.shiftKey ? (is_further ? this.#anchor : Math.max(this.#at, 0)) : -1;
    if (this.#plot) this.#move(to);
    else this.#at = to;  // it is made anew, and goes on from there
    if (this.#anchor >= 0) this.of.brushed?.(this.#part(Math.min(this.#anchor, to), Math.max(this.#anchor, to)), is_further);
  }
  /** In to half of what is there, around the cursor, or out to all. @param {string} key */
  #zoom_by_key(key) {
    const last = this.of.x.values.length - 1;
    const quarter = Math.ceil(last / 4);
    this.of.zoomed?.(key === "0" || key === "-" ? null : this.#part(Math.max(this.#at - quarter, 0), Math.min(Math.max(this.#at, 0) + quarter, last)));
  }
  /** From a value through another one, with the whole of bars. @param {number} from @param {number} until @returns {Part} */
  #part(from, until) {
    const { values, edges } = this.of.x;
    return { x: [edges?.[from] ?? values[from], edges?.[until + 1] ?? values[until]], y: null };
  }
}
