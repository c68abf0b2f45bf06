// Legends of pictures: a colour bar or a list of categories, and the kinds of empty cells.
import * as colours from "../lib/colours.js";
import { h } from "../lib/dom.js";
import { count, counted, heading, shownUnit, withUnit } from "../lib/format.js";
import { baseOf, baseText, scale } from "../lib/scale.js";
import { drawTicksBelow } from "./map.js";

const barHeight = 44;

/** Names of the kinds of cells without a value. */
export const emptyTexts = {
  missing: "not solved",
  failed: "failed",
  left_out: "left out by the study",
  none: "no value",
  filtered: "filtered out",
};

/** Returns the range of the colours. Each end comes from the address, or else from the picture. */
export function spanOf(view, { least, most }) {
  const end = (name) => {
    const isNumber = view.field(name) !== "" && Number.isFinite(Number(view.field(name)));
    return isNumber ? Number(view.field(name)) : null;
  };
  const [from, to] = [end("from"), end("to")];
  // Values of slices and bins have single precision, so further digits are noise.
  const [low, high] = [least ?? 0, most ?? 1].map((one) =>
    from === to ? one : Number(one.toPrecision(7)),
  );
  const width = high - low || Math.abs(from ?? to ?? 0) * 0.05 || 1;
  const first = from ?? (to === null || low < to ? low : to - width);
  const last = to ?? (from === null || high > from ? high : from + width);
  return first <= last ? [first, last] : [last, first];
}

/** Draws the colour bar on a canvas, in its displayed width. */
function drawBar(canvas, z, { from, to, zLog }) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth;
  if (width === 0) return;
  canvas.width = width * ratio;
  canvas.height = barHeight * ratio;
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  const left = 14;
  const wide = width - 2 * left;
  const isSingle = from === to;
  for (let i = 0; i < wide; ++i) {
    const colour = isSingle ? 0 : Math.round((i / Math.max(wide - 1, 1)) * 255);
    context.fillStyle = colours.cssColour(colours.palette[colour]);
    context.fillRect(left + i, 2, 1.5, 16);
  }
  context.fillStyle = colours.ink("text");
  drawTicksBelow(context, { x: left, y: 2, w: wide, h: 16 }, scale(from, to, zLog), z, width);
}

function colourBar({ z }, look) {
  const ends = [look.from, look.to].map((end) => withUnit(end, z.name, z.unit)).join(" to ");
  const [, factor] = shownUnit(z.name, z.unit);
  const base = baseText(baseOf(look.from * factor, look.to * factor));
  const canvas = h("canvas", { role: "img", "aria-label": `Colours of ${z.name}, from ${ends}` });
  new ResizeObserver(() => drawBar(canvas, z, look)).observe(canvas);
  return h("div.bar", h("p", heading(z.name, z.unit) + base), canvas);
}

/** Creates a sample of a pattern. */
function swatch(pixel) {
  const canvas = h("canvas", { width: 26, height: 16, class: "swatch", "aria-hidden": "true" });
  const context = canvas.getContext("2d");
  const image = context.createImageData(26, 16);
  new Uint32Array(image.data.buffer).forEach((_, i, pixels) => {
    pixels[i] = pixel(i % 26, Math.floor(i / 26));
  });
  context.putImageData(image, 0, 0);
  return canvas;
}

function categoryList({ dictionary, z, dots }, { categories }) {
  const all = dictionary.reduce((sum, one) => sum + one.cells, 0);
  const percent = (cells) => {
    const share = cells / all;
    return h("span.weak", ` ${(100 * share).toFixed(share < 0.01 ? 2 : 1)} %`);
  };
  const own = dictionary.filter((_, i) => categories[i] !== colours.otherLook);
  const others = dictionary.filter((_, i) => categories[i] === colours.otherLook);
  const entry = ({ text, cells }, look) =>
    h(
      "li",
      swatch((x, y) => colours.categoryPixel(look, x, y)),
      text,
      percent(cells),
    );
  const rest = others.reduce((sum, one) => sum + one.cells, 0);
  return h(
    "div.categories",
    h("p", `${z.name}: ${count(dictionary.length)} in ${counted(all, dots ? "point" : "cell")}`),
    h(
      "ul",
      ...own.map((one) => entry(one, categories[dictionary.indexOf(one)])),
      others.length > 0 &&
        entry({ text: `${count(others.length)} others`, cells: rest }, colours.otherLook),
    ),
  );
}

function emptyList({ head }) {
  const found = Object.entries(emptyTexts).filter(
    ([why]) => head.nx !== undefined && head[why] > 0,
  );
  const dark = colours.isDark();
  return h(
    "ul.gaps",
    ...found.map(([why, text]) =>
      h(
        "li",
        swatch((x, y) => colours.emptyPixel(why, x, y, dark)),
        `${counted(head[why], "cell")} ${text}`,
      ),
    ),
  );
}

/** Creates the legend of a map or of single points. */
export function legendOf({ picture }, look) {
  const { z, least, dots } = picture;
  const isPlain = dots && !dots.z;
  const meaning = z.isCategory
    ? categoryList(picture, look)
    : least !== null && !isPlain && colourBar(picture, look);
  return [meaning, emptyList(picture)];
}
