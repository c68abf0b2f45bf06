// @ts-check
// The finger moving: the whole of it from the side, its motion since touch enlarged; and its tip at the ground, with the
// contact particle P and the forces.
import { h, named, picker } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { shown } from "/parts/format.js";
import { ends_of } from "/parts/scale.js";

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

/** An empty drawing; null where there is no room. @param {any} canvas @param {HTMLElement} place */
export const begin = (canvas, place, height = kHeight) => {
  const width = place.clientWidth;
  if (width < 60) return null;
  const ratio = window.devicePixelRatio || 1;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  canvas.style.height = `${height}px`;
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

/** A text that is read where lines run below it: they end around it. @param {any} c @param {string} text @param {number} x @param {number} y */
const label = (c, text, x, y) => {
  c.save();
  c.strokeStyle = ink("page");
  c.lineWidth = 5;
  c.strokeText(text, x, y);
  c.restore();
  c.fillText(text, x, y);
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
  label(c, length_text(metres), width - 12, 19);
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

/** A path through places that come as x and y by turns. @param {any} c @param {ArrayLike<number>} nodes @param {(x: number) => number} px @param {(y: number) => number} py */
function draw_path(c, nodes, px, py) {
  c.beginPath();
  for (let i = 0; i < nodes.length; i += 2) c.lineTo(px(nodes[i]), py(nodes[i + 1]));
  c.stroke();
}

/** @param {import("./trace.js").Trace} trace @param {Fall} fall */
function whole_of(trace, fall) {
  const canvas = h("canvas", { role: "img", "aria-label": "The finger, seen from the side" });
  const place = h("div", { class: "plot" }, canvas);
  const rest = trace.nodes(0);
  const ground = -trace.head.H;
  const box = reach_of(trace, ground);

  /** Where the tip falls, and the finger as it is at touch. @param {any} c @param {number} last row of the fall @param {(x: number) => number} px @param {(y: number) => number} py */
  function draw_before(c, last, px, py) {
    c.strokeStyle = ink("weak");
    c.lineWidth = 1;
    c.beginPath();
    for (let i = 0; i <= last; ++i) c.lineTo(px(fall.x[i]), py(fall.y[i]));
    c.stroke();
    c.setLineDash([3, 4]);
    draw_path(c, rest, px, py);
    c.setLineDash([]);
  }
  /** Its links and joints. @param {any} c @param {ArrayLike<number>} nodes @param {(x: number) => number} px @param {(y: number) => number} py */
  function draw_links(c, nodes, px, py) {
    c.strokeStyle = ink("finger");
    c.lineWidth = 4;
    draw_path(c, nodes, px, py);
    c.fillStyle = ink("text");
    for (let i = 0; i < nodes.length; i += 2 * trace.head.elements_per_link) {
      c.beginPath();
      c.arc(px(nodes[i]), py(nodes[i + 1]), i === 0 ? 6 : 4, 0, 2 * Math.PI);
      c.fill();
    }
  }
  return { place,
    /** @param {import("./player.js").Instant} instant @param {number} enlargement of the motion since touch */
    draw({ row, is_falling }, enlargement) {
      const made = begin(canvas, place);
      if (!made) return;
      const { c, width } = made;
      const metres_per_px = Math.max((box.right - box.left) / (width - 40), (box.top - box.bottom) / (kHeight - 70));
      const left = (width - (box.right - box.left) / metres_per_px) / 2;
      const px = (/** @type {number} */ v) => left + (v - box.left) / metres_per_px;
      const py = (/** @type {number} */ v) => kHeight - 26 + (box.bottom - v) / metres_per_px;
      draw_ground(c, width, py(ground));
      draw_before(c, is_falling ? row : fall.x.length - 1, px, py);
      draw_links(c, is_falling ? trace.fall.nodes(row) : trace.nodes(row).map((v, i) => rest[i] + enlargement * (v - rest[i])), px, py);
      c.textAlign = "left";
      c.textBaseline = "bottom";
      label(c, "O", px(0) + 8, py(0) - 6);
      c.textBaseline = "top";
      label(c, is_falling ? `falls, ${shown(-fall.v[row], 3)} m/s downwards` : `touches, motion enlarged ${enlargement} times`, 10, 10);
      draw_length(c, width, metres_per_px);
    } };
}

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

/** @param {import("./trace.js").Trace} trace @param {Fall} fall */
function near_of(trace, fall) {
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
