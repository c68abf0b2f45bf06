// @ts-check
// A path in a plane, as of force over deformation, with a mark at the present instant.
import { h } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { heading } from "/parts/format.js";
import { ends_of, scale, ticks, tick_text } from "/parts/scale.js";
import { begin } from "./strokes.js";

const kMargin = { left: 66, right: 12, top: 8, bottom: 44 };
const kHeight = 260;

/**
 * @param {string} title
 * @param {{name: string, unit: string, values: Float64Array}} x
 * @param {{name: string, unit: string, values: Float64Array}} y
 * @param {number} colour
 */
export function loop_plot(title, x, y, colour) {
  const canvas = h("canvas", { role: "img", "aria-label": `${title}: ${heading(y.name, y.unit)} over ${heading(x.name, x.unit)}` });
  const place = h("div", { class: "plot loop" }, canvas);
  let at = 0;
  const ends = (/** @type {Float64Array} */ values) => {
    const [low, high] = ends_of(values);
    const least = Math.min(0, low ?? 0);
    let most = Math.max(0, high ?? 0);
    if (least === most) most = least + 1;
    const room = (most - least) * 0.04;
    return scale(least - room, most + room, false);
  };
  const of_x = ends(x.values);
  const of_y = ends(y.values);
  const draw = () => {
    const drawing = begin(canvas, place, kHeight);
    if (!drawing) return;
    const { c, width } = drawing;
    const w = width - kMargin.left - kMargin.right;
    const high = kHeight - kMargin.top - kMargin.bottom;
    const px = (/** @type {number} */ v) => kMargin.left + of_x.place(v) * w;
    const py = (/** @type {number} */ v) => kMargin.top + (1 - of_y.place(v)) * high;
    c.fillStyle = ink("text");
    c.strokeStyle = ink("grid");
    c.textAlign = "center";
    c.textBaseline = "top";
    for (const value of ticks(of_x, Math.max(w / 90, 2))) {
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
      c.lineTo(kMargin.left + w, py(value));
      c.stroke();
      c.fillText(tick_text(value), kMargin.left - 6, py(value));
    }
    c.font = "13px system-ui, sans-serif";
    c.textAlign = "center";
    c.textBaseline = "bottom";
    c.fillText(heading(x.name, x.unit), kMargin.left + w / 2, kHeight - 2);
    c.save();
    c.translate(2, kMargin.top + high / 2);
    c.rotate(-Math.PI / 2);
    c.textBaseline = "top";
    c.fillText(heading(y.name, y.unit), 0, 0);
    c.restore();
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
    /** @param {number} i */
    point_at(i) {
      if (i === at) return;
      at = i;
      draw();
    },
    close: () => watch.disconnect() };
}
