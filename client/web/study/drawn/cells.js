// @ts-check
// The cells of a picture and its single points in pixels, and the axes around them.
import { category_pixel, css_colour, empty_pixel, ink, is_dark, kOther, own_looks } from "/parts/colours.js";
import { heading } from "/parts/format.js";
import { scale, ticks, tick_text } from "/parts/scale.js";
import { kEmpty } from "../pictures.js";

export const kMargin = { left: 64, right: 14, top: 10, bottom: 46 };

/** @typedef {ReturnType<typeof cells_of>} Cells */

/** Where the cells of a side begin and end, rising. @param {import("../pictures.js").Side} side @param {boolean} wants_log */
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
function cell_of_pixels(cells, pixels) {
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
 * @param {{x: {name: string, unit: string}, y: {name: string, unit: string}}} sides @param {{scale: import("/parts/scale.js").Scale}} x @param {{scale: import("/parts/scale.js").Scale}} y
 */
export function draw_axes(context, area, sides, x, y) {
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
  for (const value of sides.y.name ? ticks(y.scale, Math.max(area.h / 45, 2)) : []) {
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
  context.fillText(heading(sides.x.name, sides.x.unit), area.x + area.w / 2, area.y + area.h + kMargin.bottom - 2);
  context.save();
  context.translate(2, area.y + area.h / 2);
  context.rotate(-Math.PI / 2);
  context.textBaseline = "top";
  context.fillText(heading(sides.y.name, sides.y.unit), 0, 0);
  context.restore();
}

/**
 * @typedef {import("../pictures.js").Picture} Picture
 * @typedef {{colours: Uint32Array, from: number, to: number, z_log: boolean, x_log: boolean, y_log: boolean}} Look
 */

const kEdge = 2; // pixels of the line around what is marked
const kWhite = 0xffffffff;
const kBlack = 0xff000000;

/** The place of a value among 256 colours. @param {import("/parts/scale.js").Scale} of_z @param {number} value */
function colour_of(of_z, value) {
  const place = of_z.place(value);
  return Number.isNaN(place) ? 0 : Math.min(Math.max(Math.round(place * 255), 0), 255);
}

/** A colour, a category or -1 - the number of a reason for each cell: looked up once a cell, not once a pixel. @param {Picture} picture @param {Look} look */
function codes(picture, look) {
  const of_z = scale(look.from, look.to, look.z_log);
  const looks = own_looks(picture.dictionary);
  return Int32Array.from(picture.values, (value, i) => {
    const why = picture.why_empty(i);
    if (why) return -1 - kEmpty.indexOf(why);
    return picture.z.is_category ? (value < looks ? value : kOther) : colour_of(of_z, value);
  });
}

/**
 * @param {Picture} picture @param {Look} look @param {Cells} x @param {Cells} y @param {Uint8Array | null} marked cells
 * @param {number} width @param {number} height in pixels of the canvas @param {ImageData | null} last an image that is not needed any more
 * @returns {ImageData}
 */
export function cell_image(picture, look, x, y, marked, width, height, last) {
  const image = last && last.width === width && last.height === height ? last : new ImageData(width, height);
  const pixels = new Uint32Array(image.data.buffer);
  const columns = cell_of_pixels(x, width);
  const lines = cell_of_pixels(y, height).reverse();
  const dark = is_dark();
  const nx = picture.x.values.length;
  const cells = codes(picture, look);
  for (let py = 0; py < height; ++py) {
    const row = lines[py] * nx;
    for (let px = 0; px < width; ++px) {
      const cell = cells[row + columns[px]];
      pixels[py * width + px] = cell < 0 ? empty_pixel(kEmpty[-1 - cell], px, py, dark)
        : picture.z.is_category ? category_pixel(cell, px, py) : look.colours[cell];
    }
  }
  if (marked) surround(pixels, marked, columns, lines, nx);
  return image;
}

/** Draws a line around what is marked: white within, black without. @param {Uint32Array} pixels @param {Uint8Array} marked @param {Int32Array} columns @param {Int32Array} lines @param {number} nx */
function surround(pixels, marked, columns, lines, nx) {
  const [width, height] = [columns.length, lines.length];
  const is = (/** @type {number} */ px, /** @type {number} */ py) => marked[lines[py] * nx + columns[px]];
  for (let py = 0; py < height; ++py) {
    const above = Math.max(py - kEdge, 0);
    const below = Math.min(py + kEdge, height - 1);
    for (let px = 0; px < width; ++px) {
      const own = is(px, py);
      const left = Math.max(px - kEdge, 0);
      const right = Math.min(px + kEdge, width - 1);
      if (is(left, py) !== own || is(right, py) !== own || is(px, above) !== own || is(px, below) !== own) {
        pixels[py * width + px] = own ? kWhite : kBlack;
      }
    }
  }
}

/**
 * @param {CanvasRenderingContext2D} context @param {{x: number, y: number, w: number, h: number}} area
 * @param {Picture} picture @param {Look} look @param {Cells} x @param {Cells} y @param {Set<number> | null} marked points
 */
export function draw_dots(context, area, picture, look, x, y, marked) {
  const dots = /** @type {import("../pictures.js").Dots} */ (picture.dots);
  const n = dots.points.length;
  const radius = n < 400 ? 4 : n < 4000 ? 2.6 : 1.6;
  const of_z = scale(look.from, look.to, look.z_log);
  const [plain, weak, text] = ["bar", "weak", "text"].map(ink);
  const place = (/** @type {number} */ i) => [area.x + x.scale.place(dots.x[i]) * area.w, area.y + (1 - y.scale.place(dots.y[i])) * area.h];
  context.save();
  context.beginPath();
  context.rect(area.x, area.y, area.w, area.h);
  context.clip();
  const colour = (/** @type {number} */ i) => {
    const value = dots.z?.[i];
    return !dots.z ? plain : value === null || value === undefined ? weak : css_colour(look.colours, colour_of(of_z, value));
  };
  // What is marked lies above the others, which step back.
  for (const is_marked of marked ? [false, true] : [false]) {
    context.globalAlpha = marked && !is_marked ? 0.35 : 1;
    for (let i = 0; i < n; ++i) {
      if (marked && marked.has(dots.points[i]) !== is_marked) continue;
      const [px, py] = place(i);
      context.fillStyle = colour(i);
      context.beginPath();
      context.arc(px, py, is_marked ? radius + 1 : radius, 0, 2 * Math.PI);
      context.fill();
      if (!is_marked) continue;
      context.strokeStyle = text;
      context.lineWidth = 1.2;
      context.stroke();
    }
  }
  context.restore();
}

/** The point that lies nearest, if it is near. @param {import("../pictures.js").Dots} dots @param {Cells} x @param {Cells} y @param {number} px @param {number} py @param {{x: number, y: number, w: number, h: number}} area */
export function nearest_dot(dots, x, y, px, py, area) {
  let best = -1;
  let least = 14 * 14; // pixels
  for (let i = 0; i < dots.points.length; ++i) {
    const dx = area.x + x.scale.place(dots.x[i]) * area.w - px;
    const dy = area.y + (1 - y.scale.place(dots.y[i])) * area.h - py;
    if (dx * dx + dy * dy < least) {
      least = dx * dx + dy * dy;
      best = i;
    }
  }
  return best;
}
