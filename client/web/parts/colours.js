// @ts-check
// Colours of values and of categories, readable by the colour-blind.

const kViridis = "440154 482475 414487 355f8d 2a788e 21918c 22a884 44bf70 7ad151 bddf26 fde725";

/** @param {string} hex @returns {[number, number, number]} */
const rgb = (hex) => [parseInt(hex.slice(0, 2), 16), parseInt(hex.slice(2, 4), 16), parseInt(hex.slice(4, 6), 16)];

/** One pixel of an ImageData, opaque. @param {number[]} colour */
const packed = ([r, g, b]) => ((255 << 24) | (b << 16) | (g << 8) | r) >>> 0;

/** 256 colours from the least to the most. @returns {Uint32Array} */
export function palette() {
  const stops = kViridis.split(" ").map(rgb);
  return Uint32Array.from({ length: 256 }, (_, i) => {
    const at = (i / 255) * (stops.length - 1);
    const k = Math.min(Math.floor(at), stops.length - 2);
    return packed(stops[k].map((c, j) => Math.round(c + (at - k) * (stops[k + 1][j] - c))));
  });
}

/** @param {Uint32Array} colours @param {number} i */
export function css_colour(colours, i) {
  const c = colours[i];
  return `rgb(${c & 255} ${(c >> 8) & 255} ${(c >> 16) & 255})`;
}

/** How kinds look, that with most cells first: colour and hatching as oblique plot has them; a test compares. */
const kKinds = /** @type {[string, number][]} */ ([["77aadd", 0], ["eedd88", 1], ["ee8866", 2], ["99ddff", 3], ["bbcc33", 4], ["ffaabb", 5], ["44bb99", 6], ["b59a80", 7],
  ["77aadd", 4], ["eedd88", 5], ["ee8866", 6], ["99ddff", 7], ["bbcc33", 0], ["ffaabb", 1], ["44bb99", 2], ["b59a80", 3]]);
const kOthers = /** @type {[string, number]} */ (["dddddd", 4]);
const kMostKinds = 12;
/** The code of what has no look of its own. */
export const kOther = kKinds.length;

/** How many of these have a look of their own: of many kinds those with next to no cells have none. @param {{cells: number}[]} kinds that with most cells first */
export function own_looks(kinds) {
  let kept = kinds.length;
  if (kept > kMostKinds) {
    const whole = kinds.reduce((sum, one) => sum + one.cells, 0);
    kept = kMostKinds;
    while (kept > 1 && kinds[kept - 1].cells * 400 < whole) --kept;
  }
  return kept + 1 >= kinds.length ? kinds.length : kept;
}

/** Whether a pixel lies on a hatching: none, rising, falling, crossed, dots, level, upright, grid. @type {((x: number, y: number) => boolean)[]} */
const kHatchings = [() => false, (x, y) => (x + y) % 7 < 2, (x, y) => (x - y + 7000000) % 7 < 2,
  (x, y) => (x + y) % 9 < 2 || (x - y + 9000000) % 9 < 2, (x, y) => x % 7 < 2 && y % 7 < 2, (_, y) => y % 6 < 1, (x) => x % 6 < 1, (x, y) => x % 8 < 1 || y % 8 < 1];
const kLooks = [...kKinds, kOthers].map(([hex, hatch]) => ({ plain: packed(rgb(hex)), inked: packed(rgb(hex).map((c) => Math.round(c * 0.62 + 6))), is_inked: kHatchings[hatch] }));

/** The colour of a pixel of a kind. @param {number} code @param {number} x @param {number} y */
export function category_pixel(code, x, y) {
  const { plain, inked, is_inked } = kLooks[Math.min(code, kOther)];
  return is_inked(x, y) ? inked : plain;
}

/** What stands for a pixel without a value. @param {"missing" | "failed" | "left_out" | "none" | "filtered"} why @param {number} x @param {number} y @param {boolean} is_dark */
export function empty_pixel(why, x, y, is_dark) {
  const ground = is_dark ? 0xff211e1c : 0xfff4f4f2;
  const ink = is_dark ? 0xff5c5650 : 0xffc4beb8;
  if (why === "left_out") return ground;
  if (why === "filtered") return x % 5 < 1 && y % 5 < 1 ? (is_dark ? 0xff686460 : 0xffb0aca8) : (is_dark ? 0xff3a3632 : 0xffe2dedb);
  if (why === "failed") return (x + y) % 8 < 2 || (x - y + 8000000) % 8 < 2 ? (is_dark ? 0xff7d8aff : 0xff1c26a8) : ground;
  if (why === "none") return y % 4 < 1 ? ink : ground;
  return (x + y) % 8 < 1 ? ink : ground;
}

export const is_dark = () => matchMedia("(prefers-color-scheme: dark)").matches;
/** A colour of the page's style. @param {string} name */
export const ink = (name) => {
  const probe = document.getElementById("ink");
  if (!probe) return "#888";
  probe.className = `ink-${name}`;
  return getComputedStyle(probe).color;
};
