// @ts-check
// The finger itself: the whole of it, its motion since touch enlarged, and the tip from near by.
import { h, named, picker } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { shown } from "/parts/format.js";

const kEnlargements = ["1", "10", "30", "100"];
const kHeight = 330;

/** @param {number} size @returns {number} a round length at most that long */
function round_length(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return [5, 2, 1].map((digit) => digit * power).find((length) => length <= size) ?? power;
}

/** A length in the unit that suits it. @param {number} metres */
function length_text(metres) {
  if (metres >= 0.1) return `${shown(metres, 3)} m`;
  return metres >= 1e-3 ? `${shown(metres * 1e3, 3)} mm` : `${shown(metres * 1e6, 3)} µm`;
}

/** @param {import("./trace.js").Trace} trace */
export function finger(trace) {
  const whole = h("canvas", { role: "img", "aria-label": "The finger, seen from the side" });
  const near = h("canvas", { role: "img", "aria-label": "The tip and the ground, enlarged" });
  const whole_place = h("div", { class: "plot" }, whole);
  const near_place = h("div", { class: "plot" }, near);
  let enlargement = 30;
  let at = 0;
  const x = trace.column("x_m");
  const y = trace.column("y_m");
  const xP = trace.column("xP_m");
  const fn = trace.column("fn_N");
  const ft = trace.column("ft_N");
  const rest = trace.nodes(0);
  const ground = -trace.head.H;
  const largest = Math.max(1e-9, ...fn, ...Array.from(ft, Math.abs));

  /** @param {any} canvas @param {HTMLElement} place */
  const begin = (canvas, place) => {
    const width = place.clientWidth;
    if (width < 60) return null;
    const ratio = window.devicePixelRatio || 1;
    canvas.width = width * ratio;
    canvas.height = kHeight * ratio;
    canvas.style.height = `${kHeight}px`;
    const c = canvas.getContext("2d");
    c.scale(ratio, ratio);
    c.font = "12px system-ui, sans-serif";
    c.lineJoin = c.lineCap = "round";
    return { c, width };
  };
  /** @param {any} c @param {number} width @param {number} level */
  const draw_ground = (c, width, level) => {
    c.strokeStyle = ink("ground");
    c.lineWidth = 1.5;
    c.beginPath();
    c.moveTo(0, level);
    c.lineTo(width, level);
    c.stroke();
    c.lineWidth = 0.7;
    c.beginPath();
    for (let gx = -12; gx < width; gx += 11) {
      c.moveTo(gx + 10, level);
      c.lineTo(gx, level + 9);
    }
    c.stroke();
  };
  /** @param {any} c @param {number} width @param {number} metres_per_px */
  const draw_length = (c, width, metres_per_px) => {
    const metres = round_length(width * 0.3 * metres_per_px);
    const w = metres / metres_per_px;
    c.strokeStyle = c.fillStyle = ink("text");
    c.lineWidth = 2;
    c.beginPath();
    c.moveTo(width - 12 - w, 14);
    c.lineTo(width - 12, 14);
    c.stroke();
    c.textAlign = "right";
    c.textBaseline = "top";
    c.fillText(length_text(metres), width - 12, 19);
  };
  /** @param {any} c @param {number[]} from @param {number[]} by pixels @param {string} colour */
  const arrow = (c, [x0, y0], [dx, dy], colour) => {
    const length = Math.hypot(dx, dy);
    if (length < 3) return;
    const [ux, uy] = [dx / length, dy / length];
    c.strokeStyle = c.fillStyle = colour;
    c.lineWidth = 2.2;
    c.beginPath();
    c.moveTo(x0, y0);
    c.lineTo(x0 + dx - 6 * ux, y0 + dy - 6 * uy);
    c.stroke();
    c.beginPath();
    c.moveTo(x0 + dx, y0 + dy);
    c.lineTo(x0 + dx - 9 * ux - 4 * uy, y0 + dy - 9 * uy + 4 * ux);
    c.lineTo(x0 + dx - 9 * ux + 4 * uy, y0 + dy - 9 * uy - 4 * ux);
    c.fill();
  };

  function draw_whole() {
    const made = begin(whole, whole_place);
    if (!made) return;
    const { c, width } = made;
    const length = trace.head.lengths_m.reduce((/** @type {number} */ a, /** @type {number} */ b) => a + b, 0);
    const metres_per_px = Math.max((length * 1.12) / (width - 20), (trace.head.H * 1.25 + 0.1) / (kHeight - 30));
    const left = (width - length / metres_per_px) / 2;
    const px = (/** @type {number} */ v) => left + v / metres_per_px;
    const py = (/** @type {number} */ v) => kHeight - 26 + (ground - v) / metres_per_px;
    draw_ground(c, width, py(ground));
    const now = trace.nodes(at);
    const moved = now.map((v, i) => rest[i] + enlargement * (v - rest[i]));
    const path = (/** @type {ArrayLike<number>} */ nodes) => {
      c.beginPath();
      for (let i = 0; i < nodes.length; i += 2) c.lineTo(px(nodes[i]), py(nodes[i + 1]));
      c.stroke();
    };
    c.strokeStyle = ink("weak");
    c.setLineDash([3, 4]);
    c.lineWidth = 1;
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
    c.fillText("O", px(0) + 8, py(0) - 6);
    draw_length(c, width, metres_per_px);
  }

  function draw_near() {
    const made = begin(near, near_place);
    if (!made) return;
    const { c, width } = made;
    // All places of tip and P during the contact fit in.
    const [x0, x1] = [Math.min(...x, ...xP), Math.max(...x, ...xP)];
    const [y0, y1] = [Math.min(...y, ground), Math.max(...y, ground)];
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
    c.textAlign = "center";
    c.textBaseline = "top";
    c.fillText("P", px(xP[at]), level + 20);
    const per_N = (kHeight * 0.3) / largest;
    arrow(c, [px(x[at]), py(y[at])], [0, -fn[at] * per_N], ink("line0"));
    arrow(c, [px(x[at]), py(y[at])], [ft[at] * per_N, 0], ink("line1"));
    c.textAlign = "left";
    c.textBaseline = "top";
    c.fillStyle = ink("text");
    const what = { S: "stick", s: "slip", C: "compression", R: "restitution" };
    c.fillText([...trace.state(at)].map((one) => what[/** @type {keyof typeof what} */ (one)]).join(", "), 10, 10);
    c.fillStyle = ink("line0");
    c.fillText(`Fn ${shown(fn[at], 4)} N`, 10, 28);
    c.fillStyle = ink("line1");
    c.fillText(`Ft ${shown(ft[at], 4)} N`, 10, 46);
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
    /** @param {number} i */
    point_at(i) {
      if (i === at) return;
      at = i;
      draw();
    },
    close: () => watch.disconnect() };
}
