// @ts-check
// What uPlot and its hooks draw of lines: how each looks, ticks, ends, spans behind them, what is marked.
import { h } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { heading } from "/parts/format.js";
import { ends_of, scale, ticks, tick_text } from "/parts/scale.js";

// A script of its own, which modules come after (index.html): it is minified as no module.
export const uPlot = /** @type {any} */ (globalThis).uPlot;

const kDashes = [[], [7, 3], [2, 3], [9, 3, 2, 3], [14, 4], [4, 2], [1, 4], [12, 3, 3, 3]];
/** Each of fewer values is drawn as a point too. */
const kFewValues = 60;
const kFills = ["bar", "line1"];
const kInks = ["line0", "line1", "line2", "line3", "line4", "line5", "line6", "line7"];

const kHeight = 240;
/** Of the height of a plot: lines that nowhere lie farther apart are one to the eye. */
const kSame = 0.004;
/** Pixels that each of the lines that are one to the eye is seen, by turns. */
const kTurn = 8;

/** @typedef {import("./lines.js").Lines} Lines */

/**
 * Which lines lie on each other, and so are drawn by turns.
 * @typedef {{nth: number, of: number, on: number}} Turn so many of them are below it, of how many, and which is the first of these; of a line alone 0, 1 and itself
 * @param {Lines} lines @returns {Turn[]}
 */
export function turns_of({ series, y, as_bars }) {
  const [least, most] = y.ends ?? ends_of(series.flatMap((one) => ends_of(one.values)));
  const { place } = scale(least ?? 0, most ?? 0, y.is_log ?? false);
  const lies_on = (/** @type {ArrayLike<number | null>} */ a, /** @type {ArrayLike<number | null>} */ b) => {
    let are_there = false;
    for (let i = 0; i < a.length; ++i) {
      const [one, other] = [a[i], b[i]];
      if (one === null || other === null ? one !== other : Math.abs(place(one) - place(other)) > kSame) return false;
      are_there ||= one !== null;
    }
    return are_there;
  };
  const turns = /** @type {Turn[]} */ ([]);
  series.forEach(({ values }, i) => {
    const below = as_bars ? -1 : turns.findIndex((one, k) => one.on === k && lies_on(values, series[k].values));
    turns.push({ nth: below < 0 ? 0 : turns.filter((one) => one.on === below).length, of: 1, on: below < 0 ? i : below });
  });
  for (const turn of turns) turn.of = turns.filter((one) => one.on === turn.on).length;
  return turns;
}

/** The first of several that lie on each other is whole, the next leaves the last turns of each round to those below. @param {number} look @param {Turn} turn */
const dash_of = (look, { nth, of }) => (of === 1 ? kDashes[look] : nth === 0 ? [] : [kTurn * (of - nth), kTurn * nth]);

/** A line as it is drawn. @param {number} look @param {Turn} turn */
function sample(look, turn) {
  const canvas = h("canvas", { width: 34, height: 10, class: "sample", "aria-hidden": "true" });
  const context = canvas.getContext("2d");
  context.strokeStyle = ink(kInks[look]);
  context.lineWidth = 2.4;
  context.setLineDash(dash_of(look, turn));
  context.moveTo(0, 5);
  context.lineTo(34, 5);
  context.stroke();
  return canvas;
}

/** Which line is which, where there are several. @param {Lines} of */
export function legend_of(of) {
  const turns = turns_of(of);
  const several = of.series.length > 1 ? of.series : [];
  return h("ul", { class: "legend" }, ...several.map((one, i) => h("li", {},
    of.as_bars ? h("span", { class: `shade ink-${kFills[i]}` }) : sample((one.colour ?? i) % 8, turns[i]),
    turns[i].nth > 0 ? `${one.label} (lies on ${of.series[turns[i].on].label})` : one.label)));
}

/** What of lines is not their numbers, nor follows from these later. @param {Lines} of */
export const look_of = (of) => JSON.stringify([of.title, of.x.name, of.x.unit, of.x.is_log, of.y, of.as_bars, of.spans, of.height, of.x.values.length < kFewValues,
  of.series.map((one) => [one.label, one.colour]), turns_of(of)]);

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
  const turns = turns_of(of);
  return of.series.map((one, i) => {
    const look = (one.colour ?? i) % 8;
    const line = { label: one.label, stroke: ink(kInks[look]), width: 1.6, dash: dash_of(look, turns[i]), spanGaps: false,
      points: { show: of.x.values.length < kFewValues && !of.as_bars && turns[i].nth === 0, size: 4 } };
    return of.as_bars ? { ...line, paths: uPlot.paths.bars({ size: [1, Infinity] }), fill: ink(kFills[i]), dash: [], stroke: ink("weak"), width: 0.5 } : line;
  });
}

/** What uPlot is told. @param {() => Lines} now whose numbers may become others, and with them the ends of x @param {number} width */
export function options_of(now, width) {
  const of = now();
  const height = of.height ?? kHeight;
  return { width, height, legend: { show: false }, ms: 1,
    cursor: { points: { size: 7 }, drag: { x: true, y: of.brushed !== undefined && !of.as_bars, uni: 24, setScale: true },
      ...(of.zoomed ? { bind: { dblclick: () => () => now().zoomed?.(null) } } : {}) },
    scales: { x: { time: false, distr: of.x.is_log ? 3 : 1, range: (/** @type {any} */ _, /** @type {number} */ least, /** @type {number} */ most) => shown_ends(now().x, least, most) },
      y: { distr: of.y.is_log ? 3 : 1, ...(of.y.ends ? { range: of.y.ends } : {}) } },
    axes: axes_of(of, height), series: [{}, ...series_of(of)] };
}

/** Behind the lines; bands at their foot. @param {any} u @param {import("./lines.js").Span[]} spans */
export function draw_spans(u, spans) {
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
export function draw_marked(u, of, k, is) {
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
