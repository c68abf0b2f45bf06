// A map on a canvas. Each pixel shows the cell at its place, so axes may be uneven or logarithmic.
// Single points are drawn one by one. Keys move the chosen cell.
import * as colours from "../lib/colours.js";
import { h } from "../lib/dom.js";
import { heading, shownUnit } from "../lib/format.js";
import { baseOf, baseText, scale, ticks, tickText } from "../lib/scale.js";
import { emptyKinds } from "./picture.js";

const margin = { left: 64, right: 14, top: 10, bottom: 46 };
const leastDrag = 6; // pixels
const clickReach = 14;

/** Returns the cells along a picture axis: {order of the values, ascending edges, scale}. */
function cellsOf(side, wantsLog) {
  const order = [...side.values.keys()].sort((a, b) => side.values[a] - side.values[b]);
  const sorted = order.map((i) => side.values[i]);
  const isLog = wantsLog && (side.edges ?? sorted)[0] > 0;
  let { edges } = side;
  if (!edges) {
    const [inner, outer] = isLog ? [Math.log, Math.exp] : [Number, Number];
    const at = sorted.map(inner);
    const half = Math.max(Math.abs(at[0]) * 0.05, 0.05);
    const middles = at.slice(1).map((value, i) => (value + at[i]) / 2);
    const first = middles.length > 0 ? 2 * at[0] - middles[0] : at[0] - half;
    const last = middles.length > 0 ? 2 * at.at(-1) - middles.at(-1) : at[0] + half;
    edges = [first, ...middles, last].map(outer);
  }
  return { order, edges, scale: scale(edges[0], edges.at(-1), isLog) };
}

/** Returns the cell at a position from 0 to 1. */
function cellAt({ order, edges, scale: { place } }, at) {
  const next = edges.slice(1, -1).findIndex((edge) => place(edge) > at);
  return order[next < 0 ? order.length - 1 : next];
}

/** Returns the cell of each pixel along an axis. */
function cellOfPixels({ order, edges, scale: { place } }, pixels) {
  const ends = edges.map(place);
  let k = 0;
  return Int32Array.from({ length: pixels }, (_, pixel) => {
    while (k + 1 < order.length && ends[k + 1] <= (pixel + 0.5) / pixels) ++k;
    return order[k];
  });
}

/** Returns the ends of a cell as positions from 0 to 1. */
function reachOf({ order, edges, scale: { place } }, i) {
  const k = order.indexOf(i);
  return [place(edges[k]), place(edges[k + 1])];
}

/** Draws ticks below an area, with values where they fit; returns what their label must add. */
export function drawTicksBelow(context, area, of, { name, unit }, most) {
  const [, factor] = shownUnit(name, unit);
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "top";
  const base = baseOf(of.from * factor, of.to * factor);
  let right = -Infinity;
  for (const value of ticks(of, Math.max(area.w / 80, 2))) {
    const x = area.x + of.place(value) * area.w;
    const text = tickText(value * factor, base);
    const half = context.measureText(text).width / 2;
    context.fillRect(x - 0.5, area.y + area.h, 1, 5);
    const at = Math.min(Math.max(x, half), most - half);
    if (at - half < right + 6) continue;
    context.fillText(text, at, area.y + area.h + 8);
    right = at + half;
  }
  return baseText(base);
}

function drawAxes(context, area, { x, y }, cells) {
  context.strokeStyle = colours.ink("weak");
  context.fillStyle = colours.ink("text");
  context.font = "12px system-ui, sans-serif";
  context.lineWidth = 1;
  context.strokeRect(area.x - 0.5, area.y - 0.5, area.w + 1, area.h + 1);
  const foot = area.y + area.h;
  const xBase = drawTicksBelow(context, area, cells.x.scale, x, area.x + area.w + margin.right);
  const [, factor] = shownUnit(y.name, y.unit);
  context.textAlign = "right";
  context.textBaseline = "middle";
  const yBase = baseOf(cells.y.scale.from * factor, cells.y.scale.to * factor);
  for (const value of ticks(cells.y.scale, Math.max(area.h / 45, 2))) {
    const at = foot - cells.y.scale.place(value) * area.h;
    context.fillRect(area.x - 5, at - 0.5, 5, 1);
    context.fillText(tickText(value * factor, yBase), area.x - 8, at);
  }
  context.textAlign = "center";
  context.textBaseline = "bottom";
  context.font = "13px system-ui, sans-serif";
  context.fillText(heading(x.name, x.unit) + xBase, area.x + area.w / 2, foot + margin.bottom - 2);
  context.save();
  context.translate(2, area.y + area.h / 2);
  context.rotate(-Math.PI / 2);
  context.textBaseline = "top";
  context.fillText(heading(y.name, y.unit) + baseText(yBase), 0, 0);
  context.restore();
}

/** Index of a value in the scale of 256 colours. */
function colourOf({ place }, value) {
  const at = place(value);
  return Number.isNaN(at) ? 0 : Math.min(Math.max(Math.round(at * 255), 0), 255);
}

/** Returns the mean of a colour and the background. */
const pale = (pixel, dark) =>
  (((pixel >>> 1) & 0x7f7f7f) + (dark ? 0x0b0b0b : 0x7f7f7f)) | 0xff000000;

/** Returns the pixels of all cells. If some cells are selected, the others are pale. */
function cellImage(picture, look, cells, selected, width, height) {
  const image = new ImageData(width, height);
  const pixels = new Uint32Array(image.data.buffer);
  const columns = cellOfPixels(cells.x, width);
  const lines = cellOfPixels(cells.y, height).reverse();
  const dark = colours.isDark();
  const nx = picture.x.values.length;
  const of = scale(look.from, look.to, look.zLog);
  // A code for each cell: a colour, the look of a category, or, for an empty cell, -1 minus the
  // index of its kind. Computed once per cell, because a cell has many pixels.
  const codes = Int32Array.from(picture.values, (value, i) => {
    const why = picture.whyEmpty(i);
    if (why) return -1 - emptyKinds.indexOf(why);
    return picture.z.isCategory ? look.categories[value] : colourOf(of, value);
  });
  for (let py = 0; py < height; ++py) {
    for (let px = 0; px < width; ++px) {
      const cell = lines[py] * nx + columns[px];
      const code = codes[cell];
      let pixel;
      if (code < 0) pixel = colours.emptyPixel(emptyKinds[-1 - code], px, py, dark);
      else if (picture.z.isCategory) pixel = colours.categoryPixel(code, px, py);
      else pixel = colours.palette[code];
      pixels[py * width + px] = selected && !selected[cell] ? pale(pixel, dark) : pixel;
    }
  }
  return image;
}

/** Draws single points, the selected ones above the others. */
function drawDots(context, area, picture, look, cells, selected) {
  const { dots, z } = picture;
  const number = dots.points.length;
  const radius = number < 400 ? 4 : number < 4000 ? 2.6 : 1.6;
  const of = scale(look.from, look.to, look.zLog);
  const [plain, weak, text] = ["bar", "weak", "text"].map(colours.ink);
  const colour = (value) => {
    if (value === null || value === undefined) return dots.z ? weak : plain;
    return z.isCategory
      ? colours.categoryColour(look.categories[value])
      : colours.cssColour(colours.palette[colourOf(of, value)]);
  };
  context.save();
  context.beginPath();
  context.rect(area.x, area.y, area.w, area.h);
  context.clip();
  context.strokeStyle = text;
  for (const isAbove of selected ? [false, true] : [false]) {
    context.globalAlpha = selected && !isAbove ? 0.35 : 1;
    for (let i = 0; i < number; ++i) {
      if (selected && selected.has(dots.points[i]) !== isAbove) continue;
      context.fillStyle = colour(dots.z?.[i]);
      context.beginPath();
      context.arc(
        ...placeOf(area, cells, dots.x[i], dots.y[i]),
        isAbove ? radius + 1 : radius,
        0,
        7,
      );
      context.fill();
      if (isAbove) context.stroke();
    }
  }
  context.restore();
}

/** Returns the pixel at a pair of values. */
const placeOf = (area, cells, x, y) => [
  area.x + cells.x.scale.place(x) * area.w,
  area.y + (1 - cells.y.scale.place(y)) * area.h,
];

const steps = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
  Home: [-1e9, 0],
  End: [1e9, 0],
};

/**
 * Draws pictures over two axes and handles pointer and keys. Handlers: hover(cell), choose(cell,
 * point or null), open(), zoom(part), select(part).
 */
export class MapCanvas {
  picture = null;
  chosen = null; // chosen cell as [column, row]
  chosenPoint = null;
  dragSelects = false;
  #hovered = null;
  #drag = null; // dragged rectangle [x, y, to x, to y] in pixels
  #area = null;

  constructor(handlers) {
    this.handlers = handlers;
    this.base = h("canvas", { "aria-hidden": "true" });
    this.top = h("canvas", {
      tabIndex: 0,
      role: "application",
      "aria-describedby": "map-keys",
      onpointermove: (event) => this.#move(event),
      onpointerleave: () => this.#hover(null),
      onpointerdown: (event) => this.#press(event),
      onpointerup: (event) => this.#release(event),
      onpointercancel: (event) => this.#release(event),
      ondblclick: () => this.handlers.open(),
      onkeydown: (event) => this.#key(event),
    });
    const keys =
      "Arrow keys move the cell, Enter opens its point, plus and minus zoom, 0 shows all, Escape clears the selection.";
    this.element = h("div.map", this.base, this.top);
    this.element.append(h("p", { id: "map-keys", class: "unseen" }, keys));
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.element);
  }

  close() {
    this.watch.disconnect();
  }

  /**
   * Draws a picture. `look` is {from, to, zLog, xLog, yLog, categories (their looks)}; `selected`
   * is the result of askSelected.
   */
  show(picture, look, selected) {
    Object.assign(this, { picture, look, selected });
    const z = picture.dots ? "points" : picture.z.name;
    this.top.setAttribute("aria-label", `${z} over ${picture.x.name} and ${picture.y.name}`);
    this.draw();
  }

  draw() {
    const width = this.element.clientWidth;
    const { picture, look, selected } = this;
    if (!picture || width < 40) return;
    const height = Math.round(Math.min(Math.max(width * 0.52, 240), 420));
    const ratio = (this.ratio = window.devicePixelRatio || 1);
    for (const canvas of [this.base, this.top]) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      canvas.style.height = `${height}px`;
    }
    const { left, right, top, bottom } = margin;
    const area = { x: left, y: top, w: width - left - right, h: height - top - bottom };
    const cells = { x: cellsOf(picture.x, look.xLog), y: cellsOf(picture.y, look.yLog) };
    this.#area = area;
    this.cells = cells;
    const context = this.base.getContext("2d");
    if (!picture.dots) {
      const size = [area.w, area.h].map((side) => Math.max(Math.round(side * ratio), 1));
      const image = cellImage(picture, look, cells, selected?.cells, ...size);
      context.putImageData(image, Math.round(area.x * ratio), Math.round(area.y * ratio));
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawAxes(context, area, picture, cells);
    if (picture.dots) drawDots(context, area, picture, look, cells, selected?.points);
    this.#drawTop();
  }

  choose(cell, point = null) {
    this.chosen = cell;
    this.chosenPoint = point;
    this.#drawTop();
  }

  #frame([x, y, width, height], thick) {
    const context = this.top.getContext("2d");
    // The frame of a small cell is larger than the cell.
    const grow = Math.max(0, 5 - Math.min(width, height));
    const line = (colour, lineWidth) => {
      context.strokeStyle = colour;
      context.lineWidth = lineWidth;
      context.strokeRect(x - grow, y - grow, width + 2 * grow, height + 2 * grow);
    };
    line("#000", thick + 2);
    line("#fff", thick);
  }

  #frameCell([column, row], thick) {
    const area = this.#area;
    const [x0, x1] = reachOf(this.cells.x, column);
    const [y0, y1] = reachOf(this.cells.y, row);
    const corner = [area.x + x0 * area.w, area.y + (1 - y1) * area.h];
    this.#frame([...corner, (x1 - x0) * area.w, (y1 - y0) * area.h], thick);
  }

  /** Draws the layer that changes while the pointer moves. */
  #drawTop() {
    if (!this.#area) return;
    const context = this.top.getContext("2d");
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.clearRect(0, 0, this.top.width, this.top.height);
    const { dots } = this.picture;
    const isThere = (cell) =>
      cell?.[0] < this.cells.x.order.length && cell[1] < this.cells.y.order.length;
    if (isThere(this.#hovered) && !dots) this.#frameCell(this.#hovered, 1);
    const i = dots?.points.indexOf(this.chosenPoint) ?? -1;
    if (i >= 0) {
      const [x, y] = placeOf(this.#area, this.cells, dots.x[i], dots.y[i]);
      this.#frame([x - 5, y - 5, 10, 10], 2);
    } else if (isThere(this.chosen) && !dots) {
      this.#frameCell(this.chosen, 2);
    }
    if (!this.#drag) return;
    const [x, y, toX, toY] = this.#drag;
    this.#frame([Math.min(x, toX), Math.min(y, toY), Math.abs(toX - x), Math.abs(toY - y)], 1);
  }

  /** Returns the position of the pointer in the canvas. */
  #at(event) {
    const box = this.top.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  #cellAt([left, top]) {
    const area = this.#area;
    if (!area) return null;
    const [x, y] = [(left - area.x) / area.w, 1 - (top - area.y) / area.h];
    if (x < 0 || x >= 1 || y < 0 || y >= 1) return null;
    return [cellAt(this.cells.x, x), cellAt(this.cells.y, y)];
  }

  /** Returns the single point nearest to a position, or null if none is near. */
  #dotAt([left, top]) {
    const { dots } = this.picture;
    let [best, least] = [null, clickReach];
    dots?.points.forEach((point, i) => {
      const [x, y] = placeOf(this.#area, this.cells, dots.x[i], dots.y[i]);
      const distance = Math.hypot(x - left, y - top);
      if (distance < least) [best, least] = [point, distance];
    });
    return best;
  }

  #hover(cell) {
    const isOther = String(cell) !== String(this.#hovered);
    this.#hovered = cell;
    if (isOther) this.handlers.hover(cell);
    if (isOther || this.#drag) this.#drawTop();
  }

  #move(event) {
    const at = this.#at(event);
    if (this.#drag) this.#drag.splice(2, 2, ...at);
    this.#hover(this.#cellAt(at));
  }

  #press(event) {
    const at = this.#at(event);
    // A touch scrolls the page unless dragging selects.
    const mayDrag = event.pointerType === "mouse" || this.dragSelects;
    if (event.button !== 0 || !mayDrag || !this.#cellAt(at)) return;
    this.#drag = [...at, ...at];
    this.top.setPointerCapture(event.pointerId);
  }

  #release(event) {
    const drag = this.#drag;
    this.#drag = null;
    const isUp = event.type === "pointerup" && event.button === 0;
    const isWide = drag && [0, 1].every((i) => Math.abs(drag[i + 2] - drag[i]) > leastDrag);
    if (isUp && isWide) {
      const selects = this.dragSelects !== event.shiftKey;
      (selects ? this.handlers.select : this.handlers.zoom)(this.#partOf(drag));
    } else if (isUp) {
      const at = this.#at(event);
      const cell = this.#cellAt(at);
      if (cell) this.#choose(cell, this.#dotAt(at));
    }
    this.#drawTop();
  }

  #choose(cell, point) {
    this.choose(cell, point);
    this.handlers.choose(cell, point);
  }

  /** Returns the ranges of values within a rectangle of pixels. */
  #partOf([x, y, toX, toY]) {
    const area = this.#area;
    const inside = (share) => Math.min(Math.max(share, 0), 1);
    const range = (places, { scale: { value } }) =>
      places
        .map(inside)
        .sort((a, b) => a - b)
        .map(value);
    return {
      x: range([(x - area.x) / area.w, (toX - area.x) / area.w], this.cells.x),
      y: range([1 - (y - area.y) / area.h, 1 - (toY - area.y) / area.h], this.cells.y),
    };
  }

  /** Returns a range of values around a cell that contains about half of the cells along a side. */
  #around({ order, edges }, i) {
    const k = order.indexOf(i);
    const half = Math.max(Math.floor(order.length / 4), 1);
    return [edges[Math.max(k - half, 0)], edges[Math.min(k + half + 1, order.length)]];
  }

  #key(event) {
    if (!this.cells || event.ctrlKey || event.altKey || event.metaKey) return;
    const { x, y } = this.cells;
    const cell = this.chosen ?? [x.order[0], y.order[0]];
    const step = steps[event.key];
    const moved = ({ order }, i, by) =>
      order[Math.min(Math.max(order.indexOf(i) + by, 0), order.length - 1)];
    if (step) {
      this.#choose(
        this.chosen ? [moved(x, cell[0], step[0]), moved(y, cell[1], step[1])] : cell,
        null,
      );
    } else if (event.key === "Enter") {
      this.handlers.open();
    } else if (event.key === "Escape") {
      this.handlers.select(null);
    } else if (event.key === "+" || event.key === "=") {
      this.handlers.zoom({ x: this.#around(x, cell[0]), y: this.#around(y, cell[1]) });
    } else if (event.key === "-" || event.key === "0") {
      this.handlers.zoom(null);
    } else {
      return;
    }
    event.preventDefault();
  }
}
