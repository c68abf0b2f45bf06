// @ts-check
// What hands do on a map: point, choose, open, and drag a rectangle that zooms or marks; by mouse, finger or keys.
import { cell_at } from "./frame.js";

const kDrag = 6; // pixels

/**
 * @typedef {object} Rectangle
 * @property {[number, number]} from column and row of one corner's cell
 * @property {[number, number]} to of the opposite one
 * @property {[number, number]} x where it ends, in values
 * @property {[number, number]} y
 */

/** @param {import("./map.js").MapCanvas} map @param {[number, number]} from @param {[number, number]} to @returns {Rectangle} */
function of_cells(map, from, to) {
  const ends = (/** @type {any} */ side, /** @type {number} */ a, /** @type {number} */ b) => {
    const places = [side.order.indexOf(a), side.order.indexOf(b)];
    return /** @type {[number, number]} */ ([side.edges[Math.min(...places)], side.edges[Math.max(...places) + 1]]);
  };
  return { from, to, x: ends(map.x, from[0], to[0]), y: ends(map.y, from[1], to[1]) };
}

/** @param {import("./map.js").MapCanvas} map @param {{x: number, y: number, to_x: number, to_y: number}} drag @returns {Rectangle} */
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

/** @param {import("./map.js").MapCanvas} map */
export function listen_to_hands(map) {
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

/** @param {import("./map.js").MapCanvas} map */
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
