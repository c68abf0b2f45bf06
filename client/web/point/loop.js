// @ts-check
// A path in a plane, as of force over deformation, with a mark at the present instant.
import { h } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { heading } from "/parts/format.js";
import { ends_of, scale } from "/parts/scale.js";
import { draw_axes, kMargin } from "/study/drawn/cells.js";
import { begin } from "./finger.js";

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
    const area = { x: kMargin.left, y: kMargin.top, w: width - kMargin.left - kMargin.right, h: kHeight - kMargin.top - kMargin.bottom };
    const px = (/** @type {number} */ v) => area.x + of_x.place(v) * area.w;
    const py = (/** @type {number} */ v) => area.y + (1 - of_y.place(v)) * area.h;
    draw_axes(c, area, { x, y }, { scale: of_x }, { scale: of_y });
    c.strokeStyle = ink(`line${colour}`);
    c.lineWidth = 1.6;
    c.beginPath();
    x.values.forEach((v, i) => c.lineTo(px(v), py(y.values[i])));
    c.stroke();
    c.fillStyle = ink("text");
    c.beginPath();
    c.arc(px(x.values[at]), py(y.values[at]), 4.5, 0, 2 * Math.PI);
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
