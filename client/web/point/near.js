// @ts-check
// The tip at the ground, enlarged, with the contact particle P and the forces.
import { h } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { shown } from "/parts/format.js";
import { ends_of } from "/parts/scale.js";
import { arrow, begin, draw_ground, draw_length, kHeight, label, length_text } from "./strokes.js";

const kLevel = kHeight * 0.6;
const kStates = { S: "stick", s: "slip", C: "compression", R: "restitution" };

/** From where to where some columns reach. @param {...ArrayLike<number>} columns */
function span(...columns) {
  const ends = columns.flatMap((column) => ends_of(column).map((end) => end ?? 0));
  return [Math.min(...ends), Math.max(...ends)];
}

/** @param {any} c @param {number} width @param {number} metres above the ground */
function draw_falling(c, width, metres) {
  draw_ground(c, width, kLevel);
  c.fillStyle = ink("text");
  c.textAlign = "left";
  c.textBaseline = "top";
  label(c, `falls: the tip is ${length_text(Math.max(metres, 0))} above the ground`, 10, 10);
}

/** P on the ground, and the springs between it and the tip. @param {any} c @param {number[]} tip in pixels @param {number} px_of_P */
function draw_particle(c, [x, y], px_of_P) {
  c.strokeStyle = ink("text");
  c.setLineDash([2, 3]);
  c.lineWidth = 1.2;
  c.beginPath();
  c.moveTo(x, y);
  c.lineTo(px_of_P, kLevel);
  c.stroke();
  c.setLineDash([]);
  c.fillStyle = ink("text");
  c.beginPath();
  c.arc(px_of_P, kLevel, 4, 0, 2 * Math.PI);
  c.fill();
}

/** @param {import("./trace.js").Trace} trace @param {import("./finger.js").Fall} fall */
export function near_of(trace, fall) {
  const canvas = h("canvas", { role: "img", "aria-label": "The tip and the ground, enlarged" });
  const place = h("div", { class: "plot" }, canvas);
  const [x, y, xP, fn, ft] = ["x_m", "y_m", "xP_m", "fn_N", "ft_N"].map(trace.column);
  const ground = -trace.head.H;
  const largest = Math.max(1e-9, ...span(fn, ft).map(Math.abs));
  // All places of tip and P during the contact.
  const [x0, x1] = span(x, xP);
  const [y0, y1] = span(y, [ground]);

  /** Where the tip was, and the last element's direction, not its length. @param {any} c @param {number} at @param {number} length @param {(x: number) => number} px @param {(y: number) => number} py */
  function draw_tip(c, at, length, px, py) {
    c.strokeStyle = ink("weak");
    c.lineWidth = 1;
    c.beginPath();
    for (let i = 0; i <= at; ++i) c.lineTo(px(x[i]), py(y[i]));
    c.stroke();
    const nodes = trace.nodes(at);
    const [nx, ny] = [nodes[nodes.length - 4] - x[at], nodes[nodes.length - 3] - y[at]];
    const n = Math.hypot(nx, ny) || 1;
    c.strokeStyle = ink("finger");
    c.lineWidth = 9;
    c.beginPath();
    c.moveTo(px(x[at]) + (nx / n) * length, py(y[at]) - (ny / n) * length);
    c.lineTo(px(x[at]), py(y[at]));
    c.stroke();
  }
  /** @param {any} c @param {number} at @param {number[]} tip in pixels */
  function draw_forces(c, at, tip) {
    const per_N = (kHeight * 0.3) / largest;
    arrow(c, tip, [0, -fn[at] * per_N], ink("line0"));
    arrow(c, tip, [ft[at] * per_N, 0], ink("line1"));
  }
  /** @param {any} c @param {number} at @param {number} px_of_P */
  function write(c, at, px_of_P) {
    c.fillStyle = ink("text");
    c.textAlign = "center";
    c.textBaseline = "top";
    label(c, "P", px_of_P, kLevel + 20);
    c.textAlign = "left";
    label(c, [...trace.state(at)].map((one) => kStates[/** @type {keyof typeof kStates} */ (one)]).join(", "), 10, 10);
    c.fillStyle = ink("line0");
    label(c, `Fn ${shown(fn[at], 4)} N`, 10, 28);
    c.fillStyle = ink("line1");
    label(c, `Ft ${shown(ft[at], 4)} N`, 10, 46);
  }
  return { place,
    /** @param {import("./player.js").Instant} instant */
    draw({ row, is_falling }) {
      const made = begin(canvas, place);
      if (!made) return;
      const { c, width } = made;
      if (is_falling) {
        draw_falling(c, width, fall.y[row] - ground);
        return;
      }
      const metres_per_px = Math.max((x1 - x0) / (width * 0.55), (y1 - y0) / (kHeight * 0.4), 1e-9);
      const px = (/** @type {number} */ v) => width / 2 + (v - (x0 + x1) / 2) / metres_per_px;
      const py = (/** @type {number} */ v) => kLevel - (v - ground) / metres_per_px;
      draw_ground(c, width, kLevel);
      draw_tip(c, row, width, px, py);
      const tip = [px(x[row]), py(y[row])];
      draw_particle(c, tip, px(xP[row]));
      draw_forces(c, row, tip);
      write(c, row, px(xP[row]));
      draw_length(c, width, metres_per_px);
    } };
}
