// Draws lines or bars over an axis with uPlot. Keys move the cursor; a text shows its values.
import { ink } from "./colours.js";
import { h } from "./dom.js";
import { shown } from "./format.js";
import { baseOf, baseText, countAsOne, scale, ticks, tickText } from "./scale.js";

/**
 * A chart of lines or bars. Its contents, in shown units: title; x {label, name, unit, values,
 * isLog, ends}; y {label, unit, isLog, ends}; series [{label, values, look, isThick}]; isBars;
 * spans [{from, to, ink, isBand}] behind the lines (a band is a strip at the bottom). Callbacks:
 * zoom(part) and select(part), where part is {x: [from, to], y: [from, to] or null}, or null to
 * show everything or select nothing; moved(i) when the cursor moves to value i. Dragging zooms, and
 * Shift with dragging selects; dragSelects exchanges the two.
 */

// uPlot comes from a classic script, which runs before modules (index.html).
const { uPlot } = globalThis;

const dashes = [[], [7, 3], [2, 3], [9, 3, 2, 3], [14, 4], [4, 2], [1, 4], [12, 3, 3, 3]];
const fills = ["bar", "line1"];
/** A line with fewer values also shows its points. */
const fewValues = 60;
const usualHeight = 220;

const lookOf = ({ look }, i) => (look ?? i) % dashes.length;

function signOf(look, isBar) {
  const canvas = h("canvas.sample", { width: 34, height: 10, "aria-hidden": "true" });
  const context = canvas.getContext("2d");
  context.strokeStyle = ink(isBar ? fills[look] : `line${look}`);
  context.lineWidth = isBar ? 10 : 2.4;
  context.setLineDash(isBar ? [] : dashes[look]);
  context.moveTo(0, 5);
  context.lineTo(34, 5);
  context.stroke();
  return canvas;
}

function legendOf({ series, isBars }) {
  const lines = series.filter((one) => !one.isThick);
  const entries = lines.length > 1 ? lines : [];
  const entry = (one, i) => h("li", signOf(lookOf(one, i), isBars), one.label);
  return h("ul.legend", ...entries.map(entry));
}

/** Properties that require a new chart when they change. */
const formOf = ({ title, x, y, series, isBars, spans }) =>
  JSON.stringify([
    [title, isBars, spans, x.label, x.isLog, y],
    x.values.length < fewValues,
    series.map((one) => [one.label, one.look]),
  ]);

/** Ends of the axis. On logarithmic axes uPlot rounds them to powers of ten. */
function endsOfAxis({ values, ends }, least, most) {
  const isAll = least === values[0] && most === values[values.length - 1];
  const [from, to] = isAll && ends ? ends : [least, most];
  if (!countAsOne(from, to)) return [from, to];
  const room = Math.abs(from) * 0.05 || 0.5;
  return [from - room, to + room];
}

function axesOf({ x, y }, height) {
  const baseIn = ({ scales }, i) => baseOf(scales["xy"[i]].min, scales["xy"[i]].max);
  const axis = {
    stroke: ink("text"),
    grid: { stroke: ink("grid"), width: 1 },
    ticks: { stroke: ink("weak"), width: 1 },
    font: "12px system-ui, sans-serif",
    labelFont: "13px system-ui, sans-serif",
    labelSize: 22,
    filter: (_, splits) => splits,
    values: (plot, splits, i) => splits.map((one) => tickText(one, baseIn(plot, i))),
    label: (plot, i) => [x, y][i].label + baseText(baseIn(plot, i)),
  };
  const across = (plot) => plot.bbox.width / (window.devicePixelRatio || 1) / 80;
  return [
    {
      ...axis,
      size: 34,
      splits: (plot, _, least, most) =>
        ticks(scale(least, most, x.isLog), Math.max(across(plot), 2)),
    },
    {
      ...axis,
      size: 62,
      splits: (_, __, least, most) => ticks(scale(least, most, y.isLog), Math.max(height / 50, 2)),
    },
  ];
}

function seriesOf({ series, x, isBars }) {
  return series.map((one, i) => {
    const look = lookOf(one, i);
    if (isBars) {
      const paths = uPlot.paths.bars({ size: [1, Infinity] });
      return {
        paths,
        fill: ink(fills[i]),
        stroke: ink("weak"),
        width: 0.5,
        points: { show: false },
      };
    }
    return {
      stroke: ink(`line${look}`),
      width: one.isThick ? 4 : 1.6,
      dash: one.isThick ? [] : dashes[look],
      points: { show: one.isThick || x.values.length < fewValues, size: one.isThick ? 7 : 4 },
    };
  });
}

function drawSpans({ ctx, bbox, valToPos }, spans) {
  for (const span of spans) {
    const from = Math.max(valToPos(span.from, "x", true), bbox.left);
    const to = Math.min(valToPos(span.to, "x", true), bbox.left + bbox.width);
    if (to <= from) continue;
    ctx.fillStyle = ink(span.ink);
    const height = span.isBand ? 10 * (window.devicePixelRatio || 1) : bbox.height;
    ctx.fillRect(from, bbox.top + bbox.height - height, to - from, height);
  }
}

export class Chart {
  /** Index of the value at the cursor; -1 if there is none. */
  #at = -1;
  #isQuiet = false;
  #dragZooms = true;
  /** Created when the element gets a width. */
  #plot = null;

  constructor(lines) {
    this.lines = lines;
    this.reading = h("p.reading", { "aria-live": "polite" });
    this.place = h("div", {
      class: "plot",
      tabIndex: 0,
      role: "application",
      "aria-label": `${lines.title}; arrow keys move the cursor`,
      onkeydown: (event) => this.#press(event),
    });
    this.place.addEventListener("pointerdown", (event) => this.#beginDrag(event), true);
    this.legend = legendOf(lines);
    const caption = h("figcaption", lines.title);
    this.element = h("figure.lines", caption, this.legend, this.place, this.reading);
    this.watch = new ResizeObserver(() => this.#fit());
    this.watch.observe(this.place);
  }

  /** Shows new contents in the same chart. Returns false if they need a new chart. */
  update(lines) {
    if (!this.#plot || formOf(lines) !== formOf(this.lines)) return false;
    this.lines = lines;
    this.#plot.setData(this.#data());
    if (this.reading.textContent) this.#read();
    return true;
  }

  /** Moves the cursor to a value; does not call `moved`. */
  pointAt(i) {
    this.#isQuiet = true;
    this.#move(i);
    this.#isQuiet = false;
    this.#at = i;
  }

  /** Returns the chart as a figure for pngOf. */
  figure() {
    return { title: this.lines.title, canvas: this.#plot.ctx.canvas, legend: this.legend };
  }

  close() {
    this.watch.disconnect();
    this.#plot?.destroy();
  }

  #data() {
    return [this.lines.x.values, ...this.lines.series.map((one) => one.values)];
  }

  #fit() {
    const width = this.place.clientWidth;
    if (width < 60) return;
    if (this.#plot) this.#plot.setSize({ width, height: this.#plot.height });
    else this.#plot = new uPlot(this.#options(width), this.#data(), this.place);
  }

  #options(width) {
    const { x, y, height = usualHeight, zoom, select, isBars, spans = [] } = this.lines;
    const range = isBars ? (_, __, most) => [0, Math.max(most, 1) * 1.05] : y.ends;
    const bind = zoom ? { dblclick: () => () => this.lines.zoom(null) } : {};
    return {
      width,
      height,
      ms: 1,
      legend: { show: false },
      cursor: {
        points: { size: 7 },
        drag: { x: true, y: select && !isBars, uni: 24, setScale: true },
        bind,
      },
      scales: {
        x: {
          time: false,
          distr: x.isLog ? 3 : 1,
          range: (_, least, most) => endsOfAxis(this.lines.x, least, most),
        },
        y: { distr: y.isLog ? 3 : 1, ...(range ? { range } : {}) },
      },
      axes: axesOf(this.lines, height),
      series: [{}, ...seriesOf(this.lines)],
      hooks: {
        setSelect: [(plot) => this.#endDrag(plot)],
        setCursor: [(plot) => this.#lookAt(plot.cursor.idx)],
        drawClear: [(plot) => drawSpans(plot, spans)],
      },
    };
  }

  #read() {
    const { x, y, series } = this.lines;
    const values = series.map(({ label, values }, k) => {
      const name = series.length > 1 ? `${label} ` : "";
      return `${name}${shown(values[this.#at])} ${y.unit}`;
    });
    const at = x.values[this.#at];
    this.reading.textContent =
      at === undefined ? "" : `${x.name} ${shown(at)} ${x.unit}: ${values.join(", ")}`;
  }

  #lookAt(i) {
    if (i === null || i === undefined || i === this.#at || this.#isQuiet) return;
    this.#at = i;
    this.#read();
    this.lines.moved?.(i);
  }

  #move(i) {
    const x = this.lines.x.values[i];
    if (!this.#plot || x === undefined) return;
    const y = this.lines.series[0]?.values[i];
    const top = typeof y === "number" ? this.#plot.valToPos(y, "y") : -1;
    this.#plot.setCursor({ left: this.#plot.valToPos(x, "x"), top });
  }

  #beginDrag(event) {
    const { select, zoom, dragSelects } = this.lines;
    if (!this.#plot || !select) return;
    this.#dragZooms = Boolean(dragSelects) === event.shiftKey;
    this.#plot.cursor.drag.setScale = this.#dragZooms && !zoom;
  }

  #endDrag(plot) {
    const { left, width, top, height } = plot.select;
    if (!this.lines.select || plot.cursor.drag.setScale || width < 3) return;
    plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    const x = [left, left + width].map((at) => plot.posToVal(at, "x"));
    const isPart = height < plot.over.clientHeight - 1;
    const y = isPart ? [top + height, top].map((at) => plot.posToVal(at, "y")) : null;
    (this.#dragZooms ? this.lines.zoom : this.lines.select)({ x, y });
  }

  #press(event) {
    const { x, select, zoom } = this.lines;
    if (event.key === "Escape") select?.(null);
    if (event.key === "0") zoom?.(null);
    const last = x.values.length - 1;
    const step = Math.max(Math.round(last / 200), 1);
    const to = {
      ArrowLeft: Math.max(this.#at - step, 0),
      ArrowRight: Math.min(this.#at + step, last),
      Home: 0,
      End: last,
    }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    this.#move(to);
  }
}
