// @ts-check
// A map on a canvas: each pixel shows the cell that it lies in, so that axes may be uneven or logarithmic. Where
// points are few they are drawn themselves, and the cells are what keys move over.
import { h } from "/parts/dom.js";
import { listen_to_hands } from "./brush.js";
import { cell_image, draw_dots, nearest_dot } from "./cells.js";
import { cell_at, cells_of, draw_axes, kMargin, reach } from "./frame.js";

/**
 * @typedef {import("./cells.js").Look} Look
 * @typedef {object} Told what a map says
 * @property {(cell: [number, number] | null) => void} hover
 * @property {(cell: [number, number], point: number | null) => void} choose the point where it is known
 * @property {(cell: [number, number]) => void} open
 * @property {(part: import("./brush.js").Rectangle | null) => void} zoom null: all
 * @property {(part: import("./brush.js").Rectangle | null, is_further?: boolean) => void} mark null: nothing; keys go on with the rectangle that they marked last
 */

/** Whether cells of the same numbers are the same. @param {import("../asked/picture.js").Picture} a @param {import("../asked/picture.js").Picture} b */
export function have_same_cells(a, b) {
  return [[a.x, b.x], [a.y, b.y]].every(([one, other]) => one.name === other.name && one.values.length === other.values.length
    && one.values.every((value, i) => value === other.values[i]));
}

export class MapCanvas {
  /** @param {Told} on */
  constructor(on) {
    this.on = on;
    this.base = h("canvas", { "aria-hidden": "true" });
    this.top = h("canvas", { tabIndex: 0, role: "application", "aria-roledescription": "map", "aria-describedby": "map-keys" });
    this.element = h("div", { class: "map" }, this.base, this.top,
      h("p", { id: "map-keys", class: "unseen" }, "Arrow keys move the cell, with Shift they mark, Escape marks none, Enter opens the cell's point, plus and minus zoom, 0 shows all."));
    /** What dragging does; with Shift the other one. @type {"zoom" | "mark"} */
    this.drags = "zoom";
    /** @type {import("../asked/picture.js").Picture | null} */
    this.picture = null;
    /** @type {Look | null} */
    this.look = null;
    /** The cells as they are drawn. @type {ImageData | null} */
    this.image = null;
    /** @type {import("../asked/question.js").Marks | null} */
    this.marks = null;
    /** @type {[number, number] | null} */
    this.chosen = null;
    /** @type {number | null} */
    this.chosen_point = null;
    /** @type {[number, number] | null} */
    this.hovered = null;
    /** Where a rectangle began that keys mark. @type {[number, number] | null} */
    this.anchor = null;
    /** @type {{x: number, y: number, to_x: number, to_y: number} | null} */
    this.drag = null;
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.element);
    listen_to_hands(this);
  }

  close() {
    this.watch.disconnect();
  }

  /** @param {"zoom" | "mark"} what */
  let_drag(what) {
    this.drags = what;
    this.top.classList.toggle("marks-by-touch", what === "mark");
  }

  /** @param {import("../asked/picture.js").Picture} picture @param {Look} look @param {import("../asked/question.js").Marks | null} marks */
  show(picture, look, marks) {
    if (!this.picture || !have_same_cells(picture, this.picture)) this.chosen = this.hovered = this.anchor = null;
    this.picture = picture;
    this.look = look;
    this.marks = marks;
    this.top.setAttribute("aria-label", picture.dots ? `points over ${picture.x.name} and ${picture.y.name}` : `${picture.z.name} over ${picture.x.name} and ${picture.y.name}`);
    this.draw();
  }

  /** @param {import("../asked/question.js").Marks | null} marks */
  mark(marks) {
    if (marks === this.marks) return;
    this.marks = marks;
    this.draw();
  }

  draw() {
    const width = this.element.clientWidth;
    const { picture, look, marks } = this;
    if (!picture || !look || width < 40) return;
    const height = Math.round(Math.min(Math.max(width * 0.62, 240), 560));
    const ratio = this.ratio = window.devicePixelRatio || 1;
    const size_px = [Math.round(width * ratio), Math.round(height * ratio)];
    for (const canvas of [this.base, this.top]) {
      if (canvas.width === size_px[0] && canvas.height === size_px[1]) continue;  // a new size is a new canvas, which costs
      [canvas.width, canvas.height] = size_px;
      canvas.style.height = `${height}px`;
    }
    const area = this.area = { x: kMargin.left, y: kMargin.top, w: width - kMargin.left - kMargin.right, h: height - kMargin.top - kMargin.bottom };
    this.x = cells_of(picture.x, look.x_log);
    this.y = cells_of(picture.y, look.y_log);
    const context = this.base.getContext("2d");
    context.clearRect(0, 0, this.base.width, this.base.height);
    if (!picture.dots) {
      const size = [area.w, area.h].map((side) => Math.max(Math.round(side * ratio), 1));
      this.image = cell_image(picture, look, this.x, this.y, marks?.cells ?? null, size[0], size[1], this.image);
      context.putImageData(this.image, Math.round(area.x * ratio), Math.round(area.y * ratio));
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    draw_axes(context, area, picture, this.x, this.y);
    if (picture.dots) draw_dots(context, area, picture, look, this.x, this.y, marks?.points ?? null);
    context.setTransform(1, 0, 0, 1, 0, 0);
    this.draw_top();
  }

  /** The rectangle of a cell. @param {[number, number]} cell */
  #box([column, row]) {
    const { x, y, area } = /** @type {any} */ (this);
    const [x0, x1] = reach(x, column);
    const [y0, y1] = reach(y, row);
    return [area.x + x0 * area.w, area.y + (1 - y1) * area.h, (x1 - x0) * area.w, (y1 - y0) * area.h];
  }

  /** What changes while somebody points. */
  draw_top() {
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
    const dots = this.picture?.dots;
    if (this.hovered && !dots) frame(this.#box(this.hovered), 1);
    const i = dots && this.chosen_point !== null ? dots.points.indexOf(this.chosen_point) : -1;
    if (dots && i >= 0 && this.x && this.y) {
      const { area } = this;
      frame([area.x + this.x.scale.place(dots.x[i]) * area.w - 5, area.y + (1 - this.y.scale.place(dots.y[i])) * area.h - 5, 10, 10], 2);
    } else if (this.chosen) {
      frame(this.#box(this.chosen), 2);
    }
    if (this.drag) {
      const { x, y, to_x, to_y } = this.drag;
      frame([Math.min(x, to_x), Math.min(y, to_y), Math.abs(to_x - x), Math.abs(to_y - y)], 1);
    }
  }

  /** @param {[number, number] | null} cell @param {number | null} [point] */
  choose(cell, point = null) {
    const is_there = cell && this.picture && cell[0] >= 0 && cell[1] >= 0 &&
      cell[0] < this.picture.x.values.length && cell[1] < this.picture.y.values.length;
    this.chosen = is_there ? cell : null;
    this.chosen_point = point;
    this.draw_top();
  }

  /** @param {number} left @param {number} top pixels */
  choose_at(left, top) {
    const cell = this.cell_at(left, top);
    if (!cell || !this.x || !this.y) return;
    const dots = this.picture?.dots;
    const i = dots ? nearest_dot(dots, this.x, this.y, left, top, /** @type {any} */ (this.area)) : -1;
    const point = dots && i >= 0 ? dots.points[i] : null;
    this.choose(cell, point);
    this.on.choose(cell, point);
  }

  /** @param {[number, number] | null} cell */
  hover(cell) {
    const is_other = String(cell) !== String(this.hovered);
    if (is_other) {
      this.hovered = cell;
      this.on.hover(cell);
    }
    if (is_other || this.drag) this.draw_top();
  }

  /** @param {number} left @param {number} top @returns {[number, number] | null} */
  cell_at(left, top) {
    const { x, y, area } = /** @type {any} */ (this);
    if (!area) return null;
    const px = (left - area.x) / area.w;
    const py = 1 - (top - area.y) / area.h;
    return px < 0 || px >= 1 || py < 0 || py >= 1 ? null : [cell_at(x, px), cell_at(y, py)];
  }
}
