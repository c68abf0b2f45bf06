// @ts-check
// What colours mean: a bar with its range, or a list of categories.
import { h, named, tick } from "/parts/dom.js";
import { category_pixel, css_colour, empty_pixel, ink, is_dark, kOther, own_looks } from "/parts/colours.js";
import { count, heading, shown } from "/parts/format.js";
import { scale, ticks, tick_text } from "/parts/scale.js";

/**
 * @param {import("../pictures.js").Picture} picture @param {import("./cells.js").Look} look
 */
export function colour_bar(picture, look) {
  const canvas = h("canvas", { role: "img",
    "aria-label": `Colours of ${picture.z.name}, from ${shown(look.from)} to ${shown(look.to)} ${picture.z.unit}` });
  const draw = () => {
    const ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth;
    const height = 44;
    if (width === 0) return;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    const left = 14;
    const w = width - 2 * left;
    for (let i = 0; i < w; ++i) {
      // One value has one colour.
      context.fillStyle = css_colour(look.colours, look.from === look.to ? 0 : Math.round((i / Math.max(w - 1, 1)) * 255));
      context.fillRect(left + i, 2, 1.5, 16);
    }
    context.strokeStyle = context.fillStyle = ink("text");
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "top";
    const of = scale(look.from, look.to, look.z_log);
    let right = -Infinity;
    for (const value of look.from === look.to ? [look.from] : ticks(of, Math.max(w / 70, 2))) {
      const x = left + of.place(value) * w;
      const text = look.from === look.to ? shown(value) : tick_text(value);
      const half = context.measureText(text).width / 2;
      context.fillRect(x - 0.5, 18, 1, 5);
      const at = Math.min(Math.max(x, half), width - half);
      if (at - half < right + 6) continue;
      context.fillText(text, at, 25);
      right = at + half;
    }
  };
  const watch = new ResizeObserver(draw);
  watch.observe(canvas);
  return h("div", { class: "bar" }, h("p", { class: "of" }, heading(picture.z.name, picture.z.unit)), canvas);
}

/** A small picture of a pixel pattern. @param {(x: number, y: number) => number} pixel */
function swatch(pixel) {
  const canvas = h("canvas", { width: 26, height: 16, class: "swatch", "aria-hidden": "true" });
  const image = canvas.getContext("2d").createImageData(26, 16);
  const pixels = new Uint32Array(image.data.buffer);
  for (let i = 0; i < pixels.length; ++i) pixels[i] = pixel(i % 26, Math.floor(i / 26));
  canvas.getContext("2d").putImageData(image, 0, 0);
  return canvas;
}

/** @param {import("../pictures.js").Picture} picture */
export function categories(picture) {
  const cells = picture.dictionary.reduce((sum, one) => sum + one.cells, 0);  // that have a kind, as in the files of oblique plot
  const line = (/** @type {{text: string, cells: number}} */ one, /** @type {number} */ code) => h("li", {},
    swatch((x, y) => category_pixel(code, x, y)), h("span", {}, one.text),
    h("span", { class: "weak" }, ` ${(100 * one.cells / cells).toFixed(one.cells / cells < 0.01 ? 2 : 1)} %`));
  const looks = own_looks(picture.dictionary);
  const first = picture.dictionary.slice(0, looks);
  const rest = picture.dictionary.slice(looks);
  const others = rest.reduce((sum, one) => sum + one.cells, 0);
  return h("div", { class: "categories" }, h("p", { class: "of" }, `${picture.z.name}: ${count(picture.dictionary.length)} here`),
    h("ul", {}, ...first.map(line)),
    rest.length > 0 && h("details", {}, h("summary", {}, swatch((x, y) => category_pixel(kOther, x, y)),
      `${count(rest.length)} others, ${count(others)} cells`),
    h("ul", {}, ...rest.map((one) => h("li", {}, one.text, h("span", { class: "weak" }, ` ${count(one.cells)} cells`))))));
}

/** What is missing, in words and pattern. @param {import("../pictures.js").Picture} picture */
export function gaps(picture) {
  const dark = is_dark();
  const told = [["missing", "not solved"], ["failed", "failed"], ["left_out", "left out by the study's filter"], ["filtered", "where the condition is not met"]]
    .filter(([why]) => picture.head.nx !== undefined && picture.head[why] > 0);
  return h("ul", { class: "gaps" }, ...told.map(([why, text]) => h("li", {},
    swatch((x, y) => empty_pixel(/** @type {any} */ (why), x, y, dark)), `${count(picture.head[why])} ${picture.head[why] === 1 ? "cell" : "cells"} ${text}`)));
}

/**
 * The range that colours span, and how.
 * @param {{from: string, to: string, is_log: boolean}} now
 * @param {(changed: {from?: string, to?: string, zlog?: string}) => void} take
 */
export function colour_controls(now, take) {
  const said = h("span", { role: "status", class: "bad" });
  const number = (/** @type {"from" | "to"} */ name) => {
    const field = h("input", { type: "text", inputMode: "decimal", value: now[name], placeholder: "fits", size: 8,
      onchange: () => {
        const is_number = field.value.trim() === "" || Number.isFinite(Number(field.value));
        field.setAttribute("aria-invalid", String(!is_number));
        said.textContent = is_number ? "" : `"${field.value.trim()}" is no number.`;
        if (is_number) take({ [name]: field.value.trim() });
      } });
    return named(name === "from" ? "colours from" : "to", field);
  };
  return h("div", { class: "row" }, number("from"), number("to"),
    h("button", { type: "button", onclick: () => take({ from: "", to: "" }) }, "Fit"), said,
    tick("log colours", now.is_log, (is) => take({ zlog: is ? "1" : "" })));
}
