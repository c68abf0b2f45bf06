// @ts-check
// The finger itself: the whole of it, its motion since touch enlarged, and the tip from near by.
import { h, named, picker } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { shown } from "/parts/format.js";
import { ends_of } from "/parts/scale.js";
import { arrow, begin, draw_ground, draw_length, kHeight, label, length_text } from "./strokes.js";

const kEnlargements = ["1", "10", "30", "100"];
/** What the finger reaches from release to touch. @param {import("./trace.js").Trace} trace @param {number} ground */
function reach_of(trace, ground) {
  const box = { left: 0, right: 0, top: 0, bottom: ground };
  const all = [trace.nodes(0), ...Array.from({ length: trace.fall.rows }, (_, row) => trace.fall.nodes(row))];
  for (const nodes of all) {
    for (let i = 0; i < nodes.length; i += 2) {
      box.left = Math.min(box.left, nodes[i]);
      box.right = Math.max(box.right, nodes[i]);
      box.top = Math.max(box.top, nodes[i + 1]);
      box.bottom = Math.min(box.bottom, nodes[i + 1]);
    }
  }
  return box;
}

/** @param {import("./trace.js").Trace} trace */
export function finger(trace) {
  const whole = h("canvas", { role: "img", "aria-label": "The finger, seen from the side" });
  const near = h("canvas", { role: "img", "aria-label": "The tip and the ground, enlarged" });
  const whole_place = h("div", { class: "plot" }, whole);
  const near_place = h("div", { class: "plot" }, near);
  let enlargement = 30;
  let at = 0;
  /** Where it is before touch; -1: it touches. */
  let falling = -1;
  const x = trace.column("x_m");
  const y = trace.column("y_m");
  const xP = trace.column("xP_m");
  const fn = trace.column("fn_N");
  const ft = trace.column("ft_N");
  const rest = trace.nodes(0);
  const ground = -trace.head.H;
  /** From where to where some columns reach. @param {...ArrayLike<number>} columns */
  const span = (...columns) => {
    const ends = columns.flatMap((column) => ends_of(column).map((end) => end ?? 0));
    return [Math.min(...ends), Math.max(...ends)];
  };
  const largest = Math.max(1e-9, ...span(fn, ft).map(Math.abs));
  // All places of tip and P during the contact.
  const [x0, x1] = span(x, xP);
  const [y0, y1] = span(y, [ground]);
  const fall = trace.fall.rows > 0 ? { x: trace.fall.column("x_m"), y: trace.fall.column("y_m"), v: trace.fall.column("vn_m_s") } : { x: [], y: [], v: [] };
  const box = reach_of(trace, ground);

  function draw_whole() {
    const made = begin(whole, whole_place);
    if (!made) return;
    const { c, width } = made;
    const metres_per_px = Math.max((box.right - box.left) / (width - 40), (box.top - box.bottom) / (kHeight - 70));
    const left = (width - (box.right - box.left) / metres_per_px) / 2;
    const px = (/** @type {number} */ v) => left + (v - box.left) / metres_per_px;
    const py = (/** @type {number} */ v) => kHeight - 26 + (box.bottom - v) / metres_per_px;
    draw_ground(c, width, py(ground));
    const moved = falling >= 0 ? trace.fall.nodes(falling) : trace.nodes(at).map((v, i) => rest[i] + enlargement * (v - rest[i]));
    const path = (/** @type {ArrayLike<number>} */ nodes) => {
      c.beginPath();
      for (let i = 0; i < nodes.length; i += 2) c.lineTo(px(nodes[i]), py(nodes[i + 1]));
      c.stroke();
    };
    c.strokeStyle = ink("weak");
    c.lineWidth = 1;
    c.beginPath();
    for (let i = 0; i <= (falling >= 0 ? falling : fall.x.length - 1); ++i) c.lineTo(px(fall.x[i]), py(fall.y[i]));
    c.stroke();
    c.setLineDash([3, 4]);
    path(rest);
    c.setLineDash([]);
    c.strokeStyle = ink("finger");
    c.lineWidth = 4;
    path(moved);
    c.fillStyle = ink("text");
    for (let i = 0; i < moved.length; i += 2 * trace.head.elements_per_link) {
      c.beginPath();
      c.arc(px(moved[i]), py(moved[i + 1]), i === 0 ? 6 : 4, 0, 2 * Math.PI);
      c.fill();
    }
    c.textAlign = "left";
    c.textBaseline = "bottom";
    label(c, "O", px(0) + 8, py(0) - 6);
    c.textBaseline = "top";
    label(c, falling >= 0 ? `falls, ${shown(-fall.v[falling], 3)} m/s downwards` : `touches, motion enlarged ${enlargement} times`, 10, 10);
    draw_length(c, width, metres_per_px);
  }

  function draw_near() {
    const made = begin(near, near_place);
    if (!made) return;
    const { c, width } = made;
    if (falling >= 0) {
      draw_ground(c, width, kHeight * 0.6);
      c.fillStyle = ink("text");
      c.textAlign = "left";
      c.textBaseline = "top";
      label(c, `falls: the tip is ${length_text(Math.max(fall.y[falling] - ground, 0))} above the ground`, 10, 10);
      return;
    }
    const metres_per_px = Math.max((x1 - x0) / (width * 0.55), (y1 - y0) / (kHeight * 0.4), 1e-9);
    const px = (/** @type {number} */ v) => width / 2 + (v - (x0 + x1) / 2) / metres_per_px;
    const level = kHeight * 0.6;
    const py = (/** @type {number} */ v) => level - (v - ground) / metres_per_px;
    draw_ground(c, width, level);
    c.strokeStyle = ink("weak");
    c.lineWidth = 1;
    c.beginPath();
    for (let i = 0; i <= at; ++i) c.lineTo(px(x[i]), py(y[i]));
    c.stroke();
    // The last element's direction, not its length.
    const nodes = trace.nodes(at);
    const [nx, ny] = [nodes[nodes.length - 4] - x[at], nodes[nodes.length - 3] - y[at]];
    const n = Math.hypot(nx, ny) || 1;
    c.strokeStyle = ink("finger");
    c.lineWidth = 9;
    c.beginPath();
    c.moveTo(px(x[at]) + (nx / n) * width, py(y[at]) - (ny / n) * width);
    c.lineTo(px(x[at]), py(y[at]));
    c.stroke();
    c.strokeStyle = ink("text");
    c.setLineDash([2, 3]);
    c.lineWidth = 1.2;
    c.beginPath();
    c.moveTo(px(x[at]), py(y[at]));
    c.lineTo(px(xP[at]), level);
    c.stroke();
    c.setLineDash([]);
    c.fillStyle = ink("text");
    c.beginPath();
    c.arc(px(xP[at]), level, 4, 0, 2 * Math.PI);
    c.fill();
    const per_N = (kHeight * 0.3) / largest;
    arrow(c, [px(x[at]), py(y[at])], [0, -fn[at] * per_N], ink("line0"));
    arrow(c, [px(x[at]), py(y[at])], [ft[at] * per_N, 0], ink("line1"));
    c.fillStyle = ink("text");
    c.textAlign = "center";
    c.textBaseline = "top";
    label(c, "P", px(xP[at]), level + 20);
    c.textAlign = "left";
    const what = { S: "stick", s: "slip", C: "compression", R: "restitution" };
    label(c, [...trace.state(at)].map((one) => what[/** @type {keyof typeof what} */ (one)]).join(", "), 10, 10);
    c.fillStyle = ink("line0");
    label(c, `Fn ${shown(fn[at], 4)} N`, 10, 28);
    c.fillStyle = ink("line1");
    label(c, `Ft ${shown(ft[at], 4)} N`, 10, 46);
    draw_length(c, width, metres_per_px);
  }

  const draw = () => {
    draw_whole();
    draw_near();
  };
  const watch = new ResizeObserver(draw);
  watch.observe(whole_place);
  watch.observe(near_place);
  const element = h("div", { class: "two" },
    h("figure", { class: "lines" }, h("figcaption", {}, "The finger; dashed: at touch"), whole_place,
      named("motion since touch, enlarged", picker(kEnlargements.map((n) => [n, `${n} times`]), String(enlargement), (n) => {
        enlargement = Number(n);
        draw_whole();
      }))),
    h("figure", { class: "lines" }, h("figcaption", {}, "The tip at the ground, with the forces on it"), near_place));
  return { element,
    /** @param {import("./player.js").Instant} instant */
    stand_at({ row, is_falling }) {
      if (is_falling ? row === falling : falling < 0 && row === at) return;
      falling = is_falling ? row : -1;
      at = is_falling ? 0 : row;
      draw();
    },
    close: () => watch.disconnect() };
}
