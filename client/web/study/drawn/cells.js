// @ts-check
// The cells of a picture and its single points, in pixels.
import { category_pixel, css_colour, empty_pixel, ink, is_dark, kOther, own_looks } from "/parts/colours.js";
import { scale } from "/parts/scale.js";
import { kEmpty } from "../asked/picture.js";
import { cell_of_pixels } from "./frame.js";

/**
 * @typedef {import("../asked/picture.js").Picture} Picture
 * @typedef {{colours: Uint32Array, from: number, to: number, z_log: boolean, x_log: boolean, y_log: boolean}} Look
 * @typedef {import("./frame.js").Cells} Cells
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
  const dots = /** @type {import("../asked/picture.js").Dots} */ (picture.dots);
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

/** The point that lies nearest, if it is near. @param {import("../asked/picture.js").Dots} dots @param {Cells} x @param {Cells} y @param {number} px @param {number} py @param {{x: number, y: number, w: number, h: number}} area */
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
