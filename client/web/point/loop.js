// @ts-check
// A path in a plane, as of force over deformation, with a mark at the present instant.
import { h } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { heading } from "/parts/format.js";
import { ends_of, scale, ticks, tick_text } from "/parts/scale.js";
import { begin } from "./strokes.js";

const kMargin = { left: 66, right: 12, top: 8, bottom: 44 };
const kHeight = 260;

/** From before the least to beyond the most, with 0. @param {Float64Array} values */
function ends(values) {
  const [low, high] = ends_of(values);
  const least = Math.min(0, low ?? 0);
  let most = Math.max(0, high ?? 0);
  if (least === most) most = least + 1;
  const room = (most - least) * 0.04;
  return scale(least - room, most + room, false);
}

/** @typedef {{name: string, unit: string, values: Float64Array}} Side */

/** Where the plot lies in a drawing, and where its values lie. @param {number} width @param {import("/parts/scale.js").Scale} of_x @param {import("/parts/scale.js").Scale} of_y */
function area_of(width, of_x, of_y) {
  const wide = width - kMargin.left - kMargin.right;
  const high = kHeight - kMargin.top - kMargin.bottom;
  return { wide, high, of_x, of_y, px: (/** @type {number} */ v) => kMargin.left + of_x.place(v) * wide,
    py: (/** @type {number} */ v) => kMargin.top + (1 - of_y.place(v)) * high };
}

/** Lines of the grid, with ticks. @param {any} c @param {ReturnType<typeof area_of>} area */
function draw_grid(c, { wide, high, of_x, of_y, px, py }) {
  c.fillStyle = ink("text");
  c.strokeStyle = ink("grid");
  c.textAlign = "center";
  c.textBaseline = "top";
  for (const value of ticks(of_x, Math.max(wide / 90, 2))) {
    c.beginPath();
    c.moveTo(px(value), kMargin.top);
    c.lineTo(px(value), kMargin.top + high);
    c.stroke();
    c.fillText(tick_text(value), px(value), kMargin.top + high + 6);
  }
  c.textAlign = "right";
  c.textBaseline = "middle";
  for (const value of ticks(of_y, Math.max(high / 45, 2))) {
    c.beginPath();
    c.moveTo(kMargin.left, py(value));
    c.lineTo(kMargin.left + wide, py(value));
    c.stroke();
    c.fillText(tick_text(value), kMargin.left - 6, py(value));
  }
}

/** What the axes are. @param {any} c @param {ReturnType<typeof area_of>} area @param {Side} x @param {Side} y */
function write_names(c, { wide, high }, x, y) {
  c.font = "13px system-ui, sans-serif";
  c.textAlign = "center";
  c.textBaseline = "bottom";
  c.fillText(heading(x.name, x.unit), kMargin.left + wide / 2, kHeight - 2);
  c.save();
  c.translate(2, kMargin.top + high / 2);
  c.rotate(-Math.PI / 2);
  c.textBaseline = "top";
  c.fillText(heading(y.name, y.unit), 0, 0);
  c.restore();
}

/** @param {string} title @param {Side} x @param {Side} y @param {number} colour */
export function loop_plot(title, x, y, colour) {
  const canvas = h("canvas", { role: "img", "aria-label": `${title}: ${heading(y.name, y.unit)} over ${heading(x.name, x.unit)}` });
  const place = h("div", { class: "plot loop" }, canvas);
  let at = 0;
  const of_x = ends(x.values);
  const of_y = ends(y.values);
  const draw = () => {
    const drawing = begin(canvas, place, kHeight);
    if (!drawing) return;
    const { c, width } = drawing;
    const area = area_of(width, of_x, of_y);
    draw_grid(c, area);
    write_names(c, area, x, y);
    c.strokeStyle = ink(`line${colour}`);
    c.lineWidth = 1.6;
    c.beginPath();
    x.values.forEach((v, i) => c.lineTo(area.px(v), area.py(y.values[i])));
    c.stroke();
    c.fillStyle = ink("text");
    c.beginPath();
    c.arc(area.px(x.values[at]), area.py(y.values[at]), 4.5, 0, 2 * Math.PI);
    c.fill();
  };
  const watch = new ResizeObserver(draw);
  watch.observe(place);
  return { element: h("figure", { class: "lines" }, h("figcaption", {}, title), place),
    /** As it is drawn. @returns {import("/parts/png.js").Figure} */
    figure: () => ({ title, canvas, legend: null }),
    /** @param {number} i */
    point_at(i) {
      if (i === at) return;
      at = i;
      draw();
    },
    close: () => watch.disconnect() };
}
