// Shows the finger during the contact: a side view of the whole finger with enlarged motion, and a
// view of the tip at the ground with the contact particle P and the forces. Both follow the time of
// a player.
import { ink } from "../lib/colours.js";
import { button, h } from "../lib/dom.js";
import { shown } from "../lib/format.js";
import { endsOf } from "../lib/scale.js";
import { rowAt } from "./trace.js";

const height = 250;
const playedSeconds = 8;
const sliderSteps = 1000;
const stateNames = { S: "stick", s: "slip", C: "compression", R: "restitution" };

function lengthText(metres) {
  if (metres >= 0.1) return `${shown(metres, 3)} m`;
  return metres >= 1e-3 ? `${shown(metres * 1e3, 3)} mm` : `${shown(metres * 1e6, 3)} µm`;
}

/** Clears a canvas and fits it to its container; returns null if the container has no room. */
function begin(canvas, place) {
  const width = place.clientWidth;
  if (width < 60) return null;
  const ratio = window.devicePixelRatio || 1;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  canvas.style.height = `${height}px`;
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  context.font = "12px system-ui, sans-serif";
  context.lineJoin = context.lineCap = "round";
  context.textBaseline = "top";
  return { context, width };
}

function drawPath(context, points, colour, lineWidth, dash = []) {
  context.strokeStyle = ink(colour);
  context.lineWidth = lineWidth;
  context.setLineDash(dash);
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
  context.stroke();
  context.setLineDash([]);
}

function drawDisc(context, [x, y], radius) {
  context.fillStyle = ink("text");
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
}

function drawGround(context, width, level) {
  context.fillStyle = ink("ground");
  context.fillRect(0, level, width, 5);
}

/** Writes a text with a border in the background colour, which separates it from lines behind. */
function write(context, text, x, y, colour = "text", align = "left") {
  context.textAlign = align;
  context.strokeStyle = ink("page");
  context.lineWidth = 5;
  context.strokeText(text, x, y);
  context.fillStyle = ink(colour);
  context.fillText(text, x, y);
}

/** Draws a scale bar of a round length. */
function drawLength(context, width, metresPerPixel) {
  const most = width * 0.3 * metresPerPixel;
  const power = 10 ** Math.floor(Math.log10(most));
  const metres = [5, 2, 1].map((digit) => digit * power).find((length) => length <= most) ?? power;
  const start = [width - 12 - metres / metresPerPixel, 14];
  drawPath(context, [start, [width - 12, 14]], "text", 2);
  write(context, lengthText(metres), width - 12, 19, "text", "right");
}

function drawArrow(context, [x, y], [dx, dy], colour) {
  const length = Math.hypot(dx, dy);
  if (length < 3) return;
  const [ux, uy] = [(dx / length) * 9, (dy / length) * 9];
  const head = [x + dx, y + dy];
  const neck = [x + dx - ux / 2, y + dy - uy / 2];
  drawPath(context, [[x, y], neck], colour, 2.2);
  context.fillStyle = ink(colour);
  context.beginPath();
  context.moveTo(...head);
  context.lineTo(head[0] - ux - uy / 2, head[1] - uy + ux / 2);
  context.lineTo(head[0] - ux + uy / 2, head[1] - uy - ux / 2);
  context.fill();
}

/** Converts coordinates (alternating x and y) to pairs of pixels. */
const pixelsOf = (nodes, px, py) =>
  Array.from({ length: nodes.length / 2 }, (_, i) => [px(nodes[2 * i]), py(nodes[2 * i + 1])]);

function figureOf(caption, label) {
  const canvas = h("canvas", { role: "img", "aria-label": label });
  const place = h("div.plot", canvas);
  return {
    canvas,
    place,
    element: h("figure.lines", h("figcaption", caption), place),
  };
}

/** Returns the largest power of ten that enlarges the motion to at most a quarter of the finger. */
function enlargementOf(trace, size) {
  const rest = trace.nodes(0);
  let moved = 1e-12;
  for (let row = 0; row < trace.rows; row += Math.ceil(trace.rows / 100)) {
    trace.nodes(row).forEach((value, i) => {
      moved = Math.max(moved, Math.abs(value - rest[i]));
    });
  }
  return 10 ** Math.max(Math.floor(Math.log10(size / 4 / moved)), 0);
}

function wholeFinger(trace) {
  const rest = trace.nodes(0);
  const ground = -trace.head.H;
  const [left, right] = endsOf(rest.filter((_, i) => i % 2 === 0));
  const [bottom, top] = endsOf([ground, ...rest.filter((_, i) => i % 2 === 1)]);
  const enlargement = enlargementOf(trace, Math.max(right - left, top - bottom));
  const caption = `Finger, motion since touch enlarged ${enlargement} times; dashed: at touch`;
  const figure = figureOf(caption, "Side view of the finger");
  function draw(row) {
    const made = begin(figure.canvas, figure.place);
    if (!made) return;
    const { context, width } = made;
    const scale = Math.max((right - left) / (width - 80), (top - bottom) / (height - 70));
    const margin = (width - (right - left) / scale) / 2;
    const px = (x) => margin + (x - left) / scale;
    const py = (y) => height - 26 + (bottom - y) / scale;
    drawGround(context, width, py(ground));
    drawPath(context, pixelsOf(rest, px, py), "weak", 1, [3, 4]);
    const moved = trace.nodes(row).map((value, i) => rest[i] + enlargement * (value - rest[i]));
    const nodes = pixelsOf(moved, px, py);
    drawPath(context, nodes, "finger", 4);
    const joints = nodes.filter((_, i) => i % trace.head.elements_per_link === 0);
    joints.forEach((joint, i) => drawDisc(context, joint, i === 0 ? 6 : 4));
    write(context, "O", px(0) + 10, py(0) - 6);
    drawLength(context, width, scale);
  }
  return { ...figure, draw };
}

function tipAtGround(trace) {
  const figure = figureOf(
    "Tip at the ground with forces",
    "Enlarged view of the tip and the ground",
  );
  const [x, y, xP, fn, ft] = ["x_m", "y_m", "xP_m", "fn_N", "ft_N"].map(trace.column);
  const ground = -trace.head.H;
  const level = height * 0.62;
  const largest = Math.max(1e-9, ...[fn, ft].flatMap(endsOf).map(Math.abs));
  const span = (columns) => endsOf(columns.flatMap(endsOf));
  const [left, right] = span([x, xP]);
  const [bottom, top] = span([y, [ground]]);
  function draw(row) {
    const made = begin(figure.canvas, figure.place);
    if (!made) return;
    const { context, width } = made;
    const scale = Math.max((right - left) / (width * 0.5), (top - bottom) / (height * 0.4), 1e-9);
    const px = (value) => width / 2 + (value - (left + right) / 2) / scale;
    const py = (value) => level - (value - ground) / scale;
    const tip = [px(x[row]), py(y[row])];
    const particle = [px(xP[row]), level];
    drawGround(context, width, level);
    const past = Array.from({ length: row + 1 }, (_, i) => [px(x[i]), py(y[i])]);
    drawPath(context, past, "weak", 1);
    // The last element is drawn in its true direction, but its length is not to scale.
    const [nx, ny] = trace.nodes(row).slice(-4);
    const [dx, dy] = [nx - x[row], ny - y[row]];
    const far = width / (Math.hypot(dx, dy) || 1);
    drawPath(context, [[tip[0] + dx * far, tip[1] - dy * far], tip], "finger", 9);
    drawPath(context, [tip, particle], "text", 1.2, [2, 3]);
    drawDisc(context, particle, 4);
    const pixelsPerNewton = (height * 0.3) / largest;
    drawArrow(context, tip, [0, -fn[row] * pixelsPerNewton], "line0");
    drawArrow(context, tip, [ft[row] * pixelsPerNewton, 0], "line1");
    write(context, "P", particle[0], level + 16, "text", "center");
    write(context, [...trace.state(row)].map((one) => stateNames[one]).join(", "), 10, 10);
    write(context, `F_n ${shown(fn[row], 4)} N`, 10, 28, "line0");
    write(context, `F_t ${shown(ft[row], 4)} N`, 10, 46, "line1");
    drawLength(context, width, scale);
  }
  return { ...figure, draw };
}

/** Creates the view of the finger with a player; calls `moved` with each row that it shows. */
export function fingerOf(trace, moved) {
  const times = trace.column("t_s");
  const last = times.at(-1) || 1e-9;
  const [tip, whole] = [tipAtGround(trace), wholeFinger(trace)];
  let row = 0;
  let time = 0;
  let frame = 0;
  let before = 0;
  const play = button("Play", () => (frame ? pause() : start()), { class: "play" });
  const slider = h("input", {
    type: "range",
    min: 0,
    max: sliderSteps,
    value: 0,
    "aria-label": "time since touch",
    oninput: () => {
      pause();
      set((last * Number(slider.value)) / sliderSteps);
    },
  });
  const output = h("output");
  const draw = () => [tip, whole].forEach((one) => one.draw(row));
  const watch = new ResizeObserver(draw);
  [tip, whole].forEach((one) => watch.observe(one.place));

  function set(to) {
    time = Math.min(Math.max(to, 0), last);
    row = rowAt(times, time);
    slider.value = String(Math.round((sliderSteps * time) / last));
    output.textContent = `${(time * 1e6).toFixed(1)} µs`;
    slider.setAttribute("aria-valuetext", output.textContent);
    draw();
    moved(row);
  }
  function step(now) {
    const passed = Math.min((now - before) / 1000, 0.1);
    before = now;
    set(time + (passed * last) / playedSeconds);
    if (time >= last) pause();
    else if (frame) frame = requestAnimationFrame(step);
  }
  function start() {
    if (time >= last) time = 0;
    before = performance.now();
    play.textContent = "Pause";
    frame = requestAnimationFrame(step);
  }
  function pause() {
    cancelAnimationFrame(frame);
    frame = 0;
    play.textContent = "Play";
  }
  return {
    tip: tip.element,
    whole: whole.element,
    player: h("div.row.player", play, h("span.scrub", slider, output)),
    /** Plays from touch, unless the browser is set to prefer reduced motion. */
    begin() {
      set(0);
      if (!matchMedia("(prefers-reduced-motion: reduce)").matches) start();
    },
    show(at) {
      pause();
      set(times[at]);
    },
    close() {
      pause();
      watch.disconnect();
    },
  };
}
