// Colours of values and categories, suitable for colour-blind readers.

const viridis = "440154 482475 414487 355f8d 2a788e 21918c 22a884 44bf70 7ad151 bddf26 fde725";

const rgb = (hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16));

const packed = ([r, g, b]) => ((255 << 24) | (b << 16) | (g << 8) | r) >>> 0;

/** The colour scale: 256 pixels, from the smallest to the largest value. */
export const palette = (() => {
  const stops = viridis.split(" ").map(rgb);
  return Uint32Array.from({ length: 256 }, (_, i) => {
    const at = (i / 255) * (stops.length - 1);
    const k = Math.min(Math.floor(at), stops.length - 2);
    return packed(stops[k].map((c, j) => Math.round(c + (at - k) * (stops[k + 1][j] - c))));
  });
})();

export const cssColour = (pixel) =>
  `rgb(${pixel & 255} ${(pixel >> 8) & 255} ${(pixel >> 16) & 255})`;

// Colours and patterns of categories, the same as in `oblique plot`. The last entry is shared by
// all categories beyond the others.
const colours = "77aadd eedd88 ee8866 99ddff bbcc33 ffaabb 44bb99 b59a80".split(" ");
const patterns = [
  () => false,
  (x, y) => (x + y) % 7 < 2,
  (x, y) => (x - y + 7000000) % 7 < 2,
  (x, y) => (x + y) % 9 < 2 || (x - y + 9000000) % 9 < 2,
  (x, y) => x % 7 < 2 && y % 7 < 2,
  (_, y) => y % 6 < 1,
  (x) => x % 6 < 1,
  (x, y) => x % 8 < 1 || y % 8 < 1,
];
const looks = [
  ...[0, 4].flatMap((shift) => colours.map((hex, i) => [hex, patterns[(i + shift) % 8]])),
  ["dddddd", patterns[4]],
].map(([hex, isInked]) => ({
  plain: packed(rgb(hex)),
  inked: packed(rgb(hex).map((c) => Math.round(c * 0.62 + 6))),
  isInked,
}));

/** Index of the entry that all categories beyond the others share. */
export const otherLook = looks.length - 1;
const mostAtFirst = 12;

/**
 * Assigns a look (colour and pattern) to each category of a study. A category keeps its look while
 * the page is open.
 */
export class CategoryLooks {
  #looks = new Map();

  /** Assigns looks to new categories; `categories` is [{text, cells}], most frequent first. */
  assign(categories) {
    const all = categories.reduce((sum, one) => sum + one.cells, 0);
    const most =
      this.#looks.size === 0 && categories.length > mostAtFirst ? mostAtFirst : otherLook;
    for (const { text, cells } of categories) {
      const isRare = categories.length > mostAtFirst && cells * 400 < all;
      if (this.#looks.size < most && !isRare && !this.#looks.has(text)) {
        this.#looks.set(text, this.#looks.size);
      }
    }
  }

  of(text) {
    return this.#looks.get(text) ?? otherLook;
  }
}

/** Returns the pixel at position x, y in the area of a category. */
export function categoryPixel(look, x, y) {
  const { plain, inked, isInked } = looks[look];
  return isInked(x, y) ? inked : plain;
}

export const categoryColour = (look) => cssColour(looks[look].plain);

/**
 * Returns the pixel at position x, y in a cell without a value. Kinds of cells: missing, failed,
 * left_out, none (the result has no such value), filtered.
 */
export function emptyPixel(why, x, y, isDark) {
  const [ground, line, error] = isDark
    ? [0xff211e1c, 0xff5c5650, 0xff7d8aff]
    : [0xfff4f4f2, 0xffc4beb8, 0xff1c26a8];
  const isRising = (x + y) % 8;
  const isFalling = (x - y + 8000000) % 8;
  if (why === "missing") return isRising < 1 ? line : ground;
  if (why === "failed") return isRising < 2 || isFalling < 2 ? error : ground;
  if (why === "none") return y % 4 < 1 ? line : ground;
  if (why === "filtered") return x % 5 < 1 && y % 5 < 1 ? line : isDark ? 0xff3a3632 : 0xffe2dedb;
  return ground;
}

export const isDark = () => matchMedia("(prefers-color-scheme: dark)").matches;

/** Returns the colour that the style sheet gives to the class ink-NAME. */
export function ink(name) {
  const probe = document.getElementById("ink");
  probe.className = `ink-${name}`;
  return getComputedStyle(probe).color;
}
