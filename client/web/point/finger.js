// @ts-check
// The finger moving: the whole of it, and the tip from near by.
import { h, named, picker } from "/parts/dom.js";
import { near_of } from "./near.js";
import { whole_of } from "./whole.js";

const kEnlargements = ["1", "10", "30", "100"];

/** @typedef {{x: ArrayLike<number>, y: ArrayLike<number>, v: ArrayLike<number>}} Fall the tip's places [m] and its velocity upwards [m/s], row by row; none: it begins at touch */

/** @param {import("./trace.js").Trace} trace */
export function finger(trace) {
  const fall = trace.fall.rows > 0 ? { x: trace.fall.column("x_m"), y: trace.fall.column("y_m"), v: trace.fall.column("vn_m_s") } : { x: [], y: [], v: [] };
  const whole = whole_of(trace, fall);
  const near = near_of(trace, fall);
  let enlargement = 30;
  /** @type {import("./player.js").Instant} */
  let at = { row: 0, is_falling: false };

  const draw_whole = () => whole.draw(at, enlargement);
  const draw = () => {
    draw_whole();
    near.draw(at);
  };
  const watch = new ResizeObserver(draw);
  watch.observe(whole.place);
  watch.observe(near.place);
  const element = h("div", { class: "two" },
    h("figure", { class: "lines" }, h("figcaption", {}, "The finger; dashed: at touch"), whole.place,
      named("motion since touch, enlarged", picker(kEnlargements.map((n) => [n, `${n} times`]), String(enlargement), (n) => {
        enlargement = Number(n);
        draw_whole();
      }))),
    h("figure", { class: "lines" }, h("figcaption", {}, "The tip at the ground, with the forces on it"), near.place));
  return { element,
    /** @param {import("./player.js").Instant} instant */
    stand_at(instant) {
      if (instant.row === at.row && instant.is_falling === at.is_falling) return;
      at = instant;
      draw();
    },
    close: () => watch.disconnect() };
}
