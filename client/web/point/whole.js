// @ts-check
// The whole of the finger from the side, its motion since touch enlarged.
import { h } from "/parts/dom.js";
import { ink } from "/parts/colours.js";
import { shown } from "/parts/format.js";
import { begin, draw_ground, draw_length, kHeight, label } from "./strokes.js";

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

/** @param {import("./trace.js").Trace} trace @param {import("./finger.js").Fall} fall */
export function whole_of(trace, fall) {
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
