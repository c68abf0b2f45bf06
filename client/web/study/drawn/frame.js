// @ts-check
// Where the cells of a map lie, and the axes around it.
import { ink } from "/parts/colours.js";
import { heading } from "/parts/format.js";
import { scale, ticks, tick_text } from "/parts/scale.js";

export const kMargin = { left: 64, right: 14, top: 10, bottom: 46 };

/** @typedef {ReturnType<typeof cells_of>} Cells */

/** Where the cells of a side begin and end, rising. @param {import("../asked/picture.js").Side} side @param {boolean} wants_log */
export function cells_of(side, wants_log) {
  const order = Array.from(side.values.keys()).sort((a, b) => side.values[a] - side.values[b]);
  const sorted = order.map((i) => side.values[i]);
  const is_log = wants_log && (side.edges ?? sorted)[0] > 0;
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

/** For each pixel the cell that it lies in. @param {Cells} cells @param {number} pixels */
export function cell_of_pixels(cells, pixels) {
  const found = new Int32Array(pixels);
  const ends = cells.edges.map((edge) => cells.scale.place(edge));
  for (let p = 0, k = 0; p < pixels; ++p) {
    while (k + 1 < cells.order.length && ends[k + 1] <= (p + 0.5) / pixels) ++k;
    found[p] = cells.order[k];
  }
  return found;
}

/** The cell at a place from 0 to 1. @param {Cells} cells @param {number} place */
export function cell_at(cells, place) {
  let k = 0;
  while (k + 1 < cells.order.length && cells.scale.place(cells.edges[k + 1]) <= place) ++k;
  return cells.order[k];
}

/** From where to where a cell reaches, from 0 to 1. @param {Cells} cells @param {number} i */
export function reach(cells, i) {
  const k = cells.order.indexOf(i);
  return [cells.scale.place(cells.edges[k]), cells.scale.place(cells.edges[k + 1])];
}

/**
 * @param {CanvasRenderingContext2D} context @param {{x: number, y: number, w: number, h: number}} area in CSS pixels
 * @param {import("../asked/picture.js").Picture} picture @param {Cells} x @param {Cells} y
 */
export function draw_axes(context, area, picture, x, y) {
  context.strokeStyle = ink("weak");
  context.fillStyle = ink("text");
  context.font = "12px system-ui, sans-serif";
  context.lineWidth = 1;
  context.strokeRect(area.x - 0.5, area.y - 0.5, area.w + 1, area.h + 1);
  context.textAlign = "center";
  context.textBaseline = "top";
  let right = -Infinity;
  for (const value of ticks(x.scale, Math.max(area.w / 80, 2))) {
    const at = area.x + x.scale.place(value) * area.w;
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
  for (const value of picture.y.name ? ticks(y.scale, Math.max(area.h / 45, 2)) : []) {
    const at = area.y + (1 - y.scale.place(value)) * area.h;
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
  context.save();
  context.translate(2, area.y + area.h / 2);
  context.rotate(-Math.PI / 2);
  context.textBaseline = "top";
  context.fillText(heading(picture.y.name, picture.y.unit), 0, 0);
  context.restore();
}
