// @ts-check
// A map on a canvas: each pixel shows the cell that it lies in, so that axes may be uneven or logarithmic. Where
// points are few they are drawn themselves, and the cells are what keys move over.
import { h } from "/parts/dom.js";
import { cell_at, cell_image, cells_of, draw_axes, draw_dots, kMargin, nearest_dot, reach } from "./cells.js";

/**
 * @typedef {import("./cells.js").Look} Look
 * @typedef {object} Told what a map says
 * @property {(cell: [number, number] | null) => void} hover
 * @property {(cell: [number, number], point: number | null) => void} choose the point where it is known
 * @property {(cell: [number, number]) => void} open
 * @property {(part: Rectangle | null) => void} zoom null: all
 * @property {(part: Rectangle | null, is_further?: boolean) => void} mark null: nothing; keys go on with the rectangle that they marked last
 */

/** Whether cells of the same numbers are the same. @param {import("../pictures.js").Picture} a @param {import("../pictures.js").Picture} b */
function have_same_cells(a, b) {
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
    /** @type {import("../pictures.js").Picture | null} */
    this.picture = null;
    /** @type {Look | null} */
    this.look = null;
    /** The cells as they are drawn. @type {ImageData | null} */
    this.image = null;
    /** @type {import("../pictures.js").Marks | null} */
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

  /** @param {import("../pictures.js").Picture} picture @param {Look} look @param {import("../pictures.js").Marks | null} marks */
  show(picture, look, marks) {
    if (!this.picture || !have_same_cells(picture, this.picture)) this.chosen = this.hovered = this.anchor = null;
    this.picture = picture;
    this.look = look;
    this.marks = marks;
    this.top.setAttribute("aria-label", picture.dots ? `points over ${picture.x.name} and ${picture.y.name}` : `${picture.z.name} over ${picture.x.name} and ${picture.y.name}`);
    this.draw();
  }

  /** @param {import("../pictures.js").Marks | null} marks */
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

// What hands do on a map: point, choose, open, and drag a rectangle that zooms or marks; by mouse, finger or keys.

const kDrag = 6; // pixels

/**
 * @typedef {object} Rectangle
 * @property {[number, number]} from column and row of one corner's cell
 * @property {[number, number]} to of the opposite one
 * @property {[number, number]} x where it ends, in values
 * @property {[number, number]} y
 */

/** @param {MapCanvas} map @param {[number, number]} from @param {[number, number]} to @returns {Rectangle} */
function of_cells(map, from, to) {
  const ends = (/** @type {any} */ side, /** @type {number} */ a, /** @type {number} */ b) => {
    const places = [side.order.indexOf(a), side.order.indexOf(b)];
    return /** @type {[number, number]} */ ([side.edges[Math.min(...places)], side.edges[Math.max(...places) + 1]]);
  };
  return { from, to, x: ends(map.x, from[0], to[0]), y: ends(map.y, from[1], to[1]) };
}

/** @param {MapCanvas} map @param {{x: number, y: number, to_x: number, to_y: number}} drag @returns {Rectangle} */
function of_drag(map, drag) {
  const { area, x, y } = /** @type {any} */ (map);
  const rising = (/** @type {number} */ a, /** @type {number} */ b) => a - b;
  const inside = (/** @type {number} */ v) => Math.min(Math.max(v, 0), 1);
  const xs = [drag.x, drag.to_x].map((v) => inside((v - area.x) / area.w)).sort(rising);
  const ys = [drag.y, drag.to_y].map((v) => inside(1 - (v - area.y) / area.h)).sort(rising);
  const cell = (/** @type {number} */ px, /** @type {number} */ py) => /** @type {[number, number]} */ ([cell_at(x, px), cell_at(y, py)]);
  return { from: cell(xs[0], ys[0]), to: cell(Math.max(xs[1] - 1e-9, 0), Math.max(ys[1] - 1e-9, 0)),
    x: [x.scale.value(xs[0]), x.scale.value(xs[1])], y: [y.scale.value(ys[0]), y.scale.value(ys[1])] };
}

/** @param {MapCanvas} map */
function listen_to_hands(map) {
  const at = (/** @type {MouseEvent} */ event) => {
    const box = map.top.getBoundingClientRect();
    return /** @type {[number, number]} */ ([event.clientX - box.left, event.clientY - box.top]);
  };
  let marks = false;
  map.top.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
    const [x, y] = at(event);
    if (map.drag) {
      map.drag.to_x = x;
      map.drag.to_y = y;
    }
    map.hover(map.cell_at(x, y));
  });
  map.top.addEventListener("pointerleave", () => map.hover(null));
  map.top.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
    const [x, y] = at(event);
    const may_drag = event.pointerType === "mouse" || map.drags === "mark"; // a finger scrolls the page
    if (event.button !== 0 || !may_drag || !map.cell_at(x, y)) return;
    marks = (map.drags === "mark") !== event.shiftKey;
    map.drag = { x, y, to_x: x, to_y: y };
    map.top.setPointerCapture(event.pointerId);
  });
  const end = (/** @type {PointerEvent} */ event) => {
    const { drag } = map;
    map.drag = null;
    if (event.type === "pointerup" && drag && Math.abs(drag.to_x - drag.x) > kDrag && Math.abs(drag.to_y - drag.y) > kDrag) {
      (marks ? map.on.mark : map.on.zoom)(of_drag(map, drag));
    } else if (event.type === "pointerup" && event.button === 0) {
      map.choose_at(...at(event));
    }
    map.draw_top();
  };
  map.top.addEventListener("pointerup", end);
  map.top.addEventListener("pointercancel", end);
  map.top.addEventListener("dblclick", (/** @type {MouseEvent} */ event) => {
    const cell = map.cell_at(...at(event));
    if (cell) map.on.open(cell);
  });
  listen_to_keys(map);
}

/** @type {Record<string, [number, number]>} */
const kSteps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1], PageUp: [0, 10], PageDown: [0, -10], Home: [-1e9, 0], End: [1e9, 0] };

/** @param {MapCanvas} map */
function listen_to_keys(map) {
  const move = (/** @type {any} */ side, /** @type {number} */ i, /** @type {number} */ by) =>
    side.order[Math.min(Math.max(side.order.indexOf(i) + by, 0), side.order.length - 1)];
  const about = (/** @type {any} */ side, /** @type {number} */ i) => {
    const k = side.order.indexOf(i);
    const half = Math.max(Math.floor(side.order.length / 4), 1);
    return [side.order[Math.max(k - half, 0)], side.order[Math.min(k + half, side.order.length - 1)]];
  };
  map.top.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
    if (!map.x || !map.y || event.ctrlKey || event.altKey || event.metaKey) return;
    const step = kSteps[event.key];
    const place = map.chosen ?? /** @type {[number, number]} */ ([map.x.order[0], map.y.order[0]]);
    if (step) {
      const cell = /** @type {[number, number]} */ (map.chosen ? [move(map.x, place[0], step[0]), move(map.y, place[1], step[1])] : place);
      const is_further = map.anchor !== null;
      map.anchor = event.shiftKey ? map.anchor ?? place : null;
      map.choose(cell);
      map.on.choose(cell, null);
      if (map.anchor) map.on.mark(of_cells(map, map.anchor, cell), is_further);
    } else if (event.key === "Enter" && map.chosen) {
      map.on.open(map.chosen);
    } else if (event.key === "Escape") {
      map.anchor = null;
      map.on.mark(null);
    } else if (event.key === "+" || event.key === "=") {
      const [x0, x1] = about(map.x, place[0]);
      const [y0, y1] = about(map.y, place[1]);
      map.on.zoom(of_cells(map, [x0, y0], [x1, y1]));
    } else if (event.key === "-" || event.key === "0") {
      map.on.zoom(null);
    } else {
      return;
    }
    event.preventDefault();
  });
}
