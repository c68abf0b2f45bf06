// @ts-check
// What drawings of a point are made of: an empty canvas, ground, lengths, arrows.
import { ink } from "/parts/colours.js";
import { shown } from "/parts/format.js";

export const kHeight = 330;

/** @param {number} size @returns {number} a round length at most that long */
function round_length(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return [5, 2, 1].map((digit) => digit * power).find((length) => length <= size) ?? power;
}

/** A length in the unit that suits it. @param {number} metres */
export function length_text(metres) {
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
export const draw_ground = (c, width, level) => {
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
export const label = (c, text, x, y) => {
  c.save();
  c.strokeStyle = ink("page");
  c.lineWidth = 5;
  c.strokeText(text, x, y);
  c.restore();
  c.fillText(text, x, y);
};

/** @param {any} c @param {number} width @param {number} metres_per_px */
export const draw_length = (c, width, metres_per_px) => {
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
export const arrow = (c, [x0, y0], [dx, dy], colour) => {
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
