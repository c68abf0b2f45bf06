// @ts-check
// A map on a canvas: each pixel shows the cell that it lies in, so that axes may be uneven or logarithmic.
import { h } from "/parts/dom.js";
import { category_pixel, empty_pixel, ink, is_dark } from "/parts/colours.js";
import { heading } from "/parts/format.js";
import { scale, ticks, tick_text } from "/parts/scale.js";

const kMargin = { left: 64, right: 14, top: 10, bottom: 46 };
const kDrag = 6; // pixels

/** @typedef {{colours: Uint32Array, from: number, to: number, z_log: boolean, x_log: boolean, y_log: boolean}} Look */

/** Where the cells of a side begin and end, rising. @param {import("./picture.js").Side} side @param {boolean} wants_log */
function cells_of(side, wants_log) {
  const order = Array.from(side.values.keys()).sort((a, b) => side.values[a] - side.values[b]);
  const sorted = order.map((i) => side.values[i]);
  const is_log = wants_log && sorted[0] > 0;
  const inner = is_log ? Math.log : (/** @type {number} */ v) => v;
  const outer = is_log ? Math.exp : (/** @type {number} */ v) => v;
  let edges = side.edges;
  if (!edges) {
    const at = sorted.map(inner);
    const n = at.length;
    const half = n > 1 ? 0 : Math.max(Math.abs(at[0]) * 0.05, 0.05);
    edges = [n > 1 ? at[0] - (at[1] - at[0]) / 2 : at[0] - half];
    for (let i = 1; i < n; ++i) edges.push((at[i - 1] + at[i]) / 2);
    edges.push(n > 1 ? at[n - 1] + (at[n - 1] - at[n - 2]) / 2 : at[0] + half);
    edges = edges.map(outer);
  }
  return { order, edges, scale: scale(edges[0], edges[edges.length - 1], is_log) };
}

/** For each pixel the cell that it lies in. @param {ReturnType<typeof cells_of>} cells @param {number} pixels */
function cell_of_pixels(cells, pixels) {
  const found = new Int32Array(pixels);
  const ends = cells.edges.map((edge) => cells.scale.place(edge));
  for (let p = 0, k = 0; p < pixels; ++p) {
    while (k + 1 < cells.order.length && ends[k + 1] <= (p + 0.5) / pixels) ++k;
    found[p] = cells.order[k];
  }
  return found;
}

export class MapCanvas {
  /**
   * @param {{hover: (cell: [number, number] | null) => void, choose: (cell: [number, number]) => void,
   *   open: (cell: [number, number]) => void, zoom: (from: [number, number] | null, to?: [number, number]) => void}} on
   */
  constructor(on) {
    this.on = on;
    this.base = h("canvas", { "aria-hidden": "true" });
    this.top = h("canvas", { tabIndex: 0, role: "application", "aria-roledescription": "map", "aria-describedby": "map-keys" });
    this.element = h("div", { class: "map" }, this.base, this.top,
      h("p", { id: "map-keys", class: "unseen" }, "Arrow keys move the cell, Enter opens its point, plus and minus zoom, 0 shows all."));
    /** @type {import("./picture.js").Picture | null} */
    this.picture = null;
    /** @type {Look | null} */
    this.look = null;
    /** @type {[number, number] | null} */
    this.chosen = null;
    /** @type {[number, number] | null} */
    this.hovered = null;
    /** @type {{x: number, y: number, to_x: number, to_y: number} | null} */
    this.drag = null;
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.element);
    this.#listen();
  }

  close() {
    this.watch.disconnect();
  }

  /** @param {import("./picture.js").Picture} picture @param {Look} look */
  show(picture, look) {
    this.picture = picture;
    this.look = look;
    this.top.setAttribute("aria-label", `${picture.z.name} over ${picture.x.name} and ${picture.y.name}`);
    this.draw();
  }

  draw() {
    const width = this.element.clientWidth;
    if (!this.picture || !this.look || width < 40) return;
    const height = Math.round(Math.min(Math.max(width * 0.62, 240), 560));
    this.ratio = window.devicePixelRatio || 1;
    for (const canvas of [this.base, this.top]) {
      canvas.width = Math.round(width * this.ratio);
      canvas.height = Math.round(height * this.ratio);
      canvas.style.height = `${height}px`;
    }
    this.area = { x: kMargin.left, y: kMargin.top, w: width - kMargin.left - kMargin.right, h: height - kMargin.top - kMargin.bottom };
    this.x = cells_of(this.picture.x, this.look.x_log);
    this.y = cells_of(this.picture.y, this.look.y_log);
    this.#paint();
    this.#axes();
    this.#overlay();
  }

  #paint() {
    const { area, ratio, picture, look } = /** @type {any} */ (this);
    const context = this.base.getContext("2d");
    const w = Math.max(Math.round(area.w * ratio), 1);
    const rows = Math.max(Math.round(area.h * ratio), 1);
    const image = context.createImageData(w, rows);
    const pixels = new Uint32Array(image.data.buffer);
    const columns = cell_of_pixels(/** @type {any} */ (this.x), w);
    const lines = cell_of_pixels(/** @type {any} */ (this.y), rows);
    const dark = is_dark();
    const nx = picture.x.values.length;
    const of_z = scale(look.from, look.to, look.z_log);
    // A value's colour is looked up once a cell, not once a pixel.
    const cells = new Int32Array(picture.values.length);
    for (let i = 0; i < cells.length; ++i) {
      const why = picture.why_empty(i);
      if (why) cells[i] = -1 - ["missing", "failed", "left_out", "none"].indexOf(why);
      else if (picture.z.is_category) cells[i] = picture.values[i];
      else {
        const place = of_z.place(picture.values[i]);
        cells[i] = Number.isNaN(place) ? 0 : Math.min(Math.max(Math.round(place * 255), 0), 255);
      }
    }
    for (let py = 0; py < rows; ++py) {
      const row = lines[rows - 1 - py] * nx;
      for (let px = 0; px < w; ++px) {
        const cell = cells[row + columns[px]];
        pixels[py * w + px] = cell < 0
          ? empty_pixel(/** @type {any} */ (["missing", "failed", "left_out", "none"])[-1 - cell], px, py, dark)
          : picture.z.is_category ? category_pixel(cell, px, py) : look.colours[cell];
      }
    }
    context.putImageData(image, Math.round(area.x * ratio), Math.round(area.y * ratio));
  }

  #axes() {
    const { area, ratio, picture } = /** @type {any} */ (this);
    const context = this.base.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const colour = ink("text");
    context.strokeStyle = ink("weak");
    context.fillStyle = colour;
    context.font = "12px system-ui, sans-serif";
    context.lineWidth = 1;
    context.strokeRect(area.x - 0.5, area.y - 0.5, area.w + 1, area.h + 1);
    context.textAlign = "center";
    context.textBaseline = "top";
    const x = /** @type {any} */ (this.x).scale;
    const y = /** @type {any} */ (this.y).scale;
    let right = -Infinity;
    for (const value of ticks(x, Math.max(area.w / 80, 2))) {
      const at = area.x + x.place(value) * area.w;
      const text = tick_text(value);
      const half = context.measureText(text).width / 2;
      context.beginPath();
      context.moveTo(at, area.y + area.h + 1);
      context.lineTo(at, area.y + area.h + 5);
      context.stroke();
      if (at - half < right + 6) continue;
      context.fillText(text, Math.min(at, area.x + area.w + kMargin.right - half), area.y + area.h + 8);
      right = at + half;
    }
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const value of picture.y.name ? ticks(y, Math.max(area.h / 45, 2)) : []) {
      const at = area.y + (1 - y.place(value)) * area.h;
      context.beginPath();
      context.moveTo(area.x - 1, at);
      context.lineTo(area.x - 5, at);
      context.stroke();
      context.fillText(tick_text(value), area.x - 8, at);
    }
    context.textAlign = "center";
    context.textBaseline = "bottom";
    context.font = "13px system-ui, sans-serif";
    context.fillText(heading(picture.x.name, picture.x.unit), area.x + area.w / 2, area.y + area.h + kMargin.bottom - 2);
    context.translate(2, area.y + area.h / 2);
    context.rotate(-Math.PI / 2);
    context.textBaseline = "top";
    context.fillText(heading(picture.y.name, picture.y.unit), 0, 0);
    context.setTransform(1, 0, 0, 1, 0, 0);
  }

  /** The rectangle of a cell. @param {[number, number]} cell */
  #box([column, row]) {
    const { x, y, area } = /** @type {any} */ (this);
    const place = (/** @type {any} */ side, /** @type {number} */ i) => {
      const k = side.order.indexOf(i);
      return [side.scale.place(side.edges[k]), side.scale.place(side.edges[k + 1])];
    };
    const [x0, x1] = place(x, column);
    const [y0, y1] = place(y, row);
    return [area.x + x0 * area.w, area.y + (1 - y1) * area.h, (x1 - x0) * area.w, (y1 - y0) * area.h];
  }

  #overlay() {
    if (!this.area) return;
    const context = this.top.getContext("2d");
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.clearRect(0, 0, this.top.width, this.top.height);
    const frame = (/** @type {number[]} */ [x, y, w, h_], /** @type {number} */ thick) => {
      // Cells smaller than a few pixels are framed with some room.
      const grow = Math.max(0, 5 - Math.min(w, h_));
      for (const [colour, line] of /** @type {[string, number][]} */ ([["#000", thick + 2], ["#fff", thick]])) {
        context.strokeStyle = colour;
        context.lineWidth = line;
        context.strokeRect(x - grow, y - grow, w + 2 * grow, h_ + 2 * grow);
      }
    };
    if (this.hovered) frame(this.#box(this.hovered), 1);
    if (this.chosen) frame(this.#box(this.chosen), 2);
    if (this.drag) {
      const { x, y, to_x, to_y } = this.drag;
      frame([Math.min(x, to_x), Math.min(y, to_y), Math.abs(to_x - x), Math.abs(to_y - y)], 1);
    }
  }

  /** @param {[number, number] | null} cell */
  choose(cell) {
    const is_there = cell && this.picture && cell[0] >= 0 && cell[1] >= 0 &&
      cell[0] < this.picture.x.values.length && cell[1] < this.picture.y.values.length;
    this.chosen = is_there ? cell : null;
    this.#overlay();
  }

  /** @param {number} left @param {number} top @returns {[number, number] | null} */
  #cell_at(left, top) {
    const { x, y, area } = /** @type {any} */ (this);
    if (!area) return null;
    const px = (left - area.x) / area.w;
    const py = 1 - (top - area.y) / area.h;
    if (px < 0 || px >= 1 || py < 0 || py >= 1) return null;
    const find = (/** @type {any} */ side, /** @type {number} */ place) => {
      let k = 0;
      while (k + 1 < side.order.length && side.scale.place(side.edges[k + 1]) <= place) ++k;
      return side.order[k];
    };
    return [find(x, px), find(y, py)];
  }

  #listen() {
    const at = (/** @type {PointerEvent} */ event) => {
      const box = this.top.getBoundingClientRect();
      return /** @type {[number, number]} */ ([event.clientX - box.left, event.clientY - box.top]);
    };
    this.top.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
      const [x, y] = at(event);
      if (this.drag) {
        this.drag.to_x = x;
        this.drag.to_y = y;
      }
      const cell = this.#cell_at(x, y);
      if (String(cell) !== String(this.hovered)) {
        this.hovered = cell;
        this.on.hover(cell);
      }
      this.#overlay();
    });
    this.top.addEventListener("pointerleave", () => {
      this.hovered = null;
      this.on.hover(null);
      this.#overlay();
    });
    this.top.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
      const [x, y] = at(event);
      if (event.button === 0 && event.pointerType === "mouse" && this.#cell_at(x, y)) {
        this.drag = { x, y, to_x: x, to_y: y };
        this.top.setPointerCapture(event.pointerId);
      }
    });
    const end = (/** @type {PointerEvent} */ event) => {
      const drag = this.drag;
      this.drag = null;
      if (drag && Math.abs(drag.to_x - drag.x) > kDrag && Math.abs(drag.to_y - drag.y) > kDrag && event.type === "pointerup") {
        const { area } = /** @type {any} */ (this);
        const inside = (/** @type {number} */ x, /** @type {number} */ y) => this.#cell_at(
          Math.min(Math.max(x, area.x), area.x + area.w - 0.01), Math.min(Math.max(y, area.y + 0.01), area.y + area.h));
        const from = inside(drag.x, drag.y);
        const to = inside(drag.to_x, drag.to_y);
        if (from && to) this.on.zoom(from, to);
      } else if (event.type === "pointerup" && event.button === 0) {
        const cell = this.#cell_at(...at(event));
        if (cell) {
          this.choose(cell);
          this.on.choose(cell);
        }
      }
      this.#overlay();
    };
    this.top.addEventListener("pointerup", end);
    this.top.addEventListener("pointercancel", end);
    this.top.addEventListener("dblclick", (/** @type {PointerEvent} */ event) => {
      const cell = this.#cell_at(...at(event));
      if (cell) this.on.open(cell);
    });
    this.top.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => this.#key(event));
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (!this.x || !this.y || event.ctrlKey || event.altKey || event.metaKey) return;
    const steps = /** @type {Record<string, [number, number]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1],
      ArrowDown: [0, -1], PageUp: [0, 10], PageDown: [0, -10], Home: [-1e9, 0], End: [1e9, 0] })[event.key];
    const place = this.chosen ?? [this.x.order[0], this.y.order[0]];
    if (steps) {
      const move = (/** @type {any} */ side, /** @type {number} */ i, /** @type {number} */ by) =>
        side.order[Math.min(Math.max(side.order.indexOf(i) + by, 0), side.order.length - 1)];
      const cell = /** @type {[number, number]} */ (this.chosen
        ? [move(this.x, place[0], steps[0]), move(this.y, place[1], steps[1])] : place);
      this.choose(cell);
      this.on.choose(cell);
    } else if (event.key === "Enter" && this.chosen) {
      this.on.open(this.chosen);
    } else if (event.key === "+" || event.key === "=") {
      const about = (/** @type {any} */ side, /** @type {number} */ i) => {
        const k = side.order.indexOf(i);
        const half = Math.max(Math.floor(side.order.length / 4), 1);
        return [side.order[Math.max(k - half, 0)], side.order[Math.min(k + half, side.order.length - 1)]];
      };
      const [x0, x1] = about(this.x, place[0]);
      const [y0, y1] = about(this.y, place[1]);
      this.on.zoom([x0, y0], [x1, y1]);
    } else if (event.key === "-" || event.key === "0") {
      this.on.zoom(null);
    } else {
      return;
    }
    event.preventDefault();
  }
}
