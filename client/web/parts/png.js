// @ts-check
// What is drawn, as a PNG file: canvases below each other, each with its title and legend.
import { ink } from "/parts/colours.js";

/** @typedef {{title: string, canvas: HTMLCanvasElement, legend: HTMLElement | null}} Figure */

const kRoom = 12; // CSS pixels around all
const kLine = 20;

/** Entries of a legend: what is drawn, if anything, and its text. @param {HTMLElement | null} legend */
function entries_of(legend) {
  const found = /** @type {HTMLElement[]} */ ([...legend?.querySelectorAll("p.of, .bar canvas, li, summary") ?? []]);
  return found.filter((one) => one.tagName === "SUMMARY" || !one.closest("details")).map((one) => {
    const sign = /** @type {HTMLElement | null} */ (one instanceof HTMLCanvasElement ? one : one.querySelector("canvas, .shade"));
    return { sign, text: one.textContent?.trim() ?? "", is_wide: ["P", "CANVAS"].includes(one.tagName) };
  });
}

/** A small canvas, or a field of one colour. @param {CanvasRenderingContext2D} c @param {HTMLElement} sign @param {number} x @param {number} y @param {number} w @param {number} h */
function draw_sign(c, sign, x, y, w, h) {
  if (sign instanceof HTMLCanvasElement) {
    c.drawImage(sign, x, y, w, h);
    return;
  }
  c.save();
  c.fillStyle = getComputedStyle(sign).color;
  c.fillRect(x, y, w, h);
  c.restore();
}

/**
 * Draws a legend, entry after entry.
 * @param {CanvasRenderingContext2D} c @param {HTMLElement | null} legend @param {number} y where it begins @param {number} width
 * @returns {number} where it ends
 */
function draw_legend(c, legend, y, width) {
  let x = kRoom;
  for (const { sign, text, is_wide } of entries_of(legend)) {
    const [w, h] = [sign?.offsetWidth ?? 0, sign?.offsetHeight ?? 0];
    const wide = is_wide ? width : w + (w && 6) + c.measureText(text).width + 18;
    if (x > kRoom && (is_wide || x + wide > kRoom + width)) {
      x = kRoom;
      y += kLine;
    }
    if (sign) draw_sign(c, sign, x, y + (is_wide ? 0 : 2), w, h);
    if (text) c.fillText(text, x + w + (w && 6), y + 3);
    x += wide;
    if (!is_wide) continue;
    x = kRoom;
    y += Math.max(h, kLine);
  }
  return x > kRoom ? y + kLine : y;
}

/** Draws all figures, or only measures them. @param {CanvasRenderingContext2D} c @param {Figure[]} figures @param {number} width @returns {number} where they end */
function draw(c, figures, width) {
  let y = kRoom;
  c.fillStyle = ink("text");
  c.textBaseline = "top";
  for (const { title, canvas, legend } of figures) {
    c.font = "600 14px system-ui, sans-serif";
    c.fillText(title, kRoom, y);
    c.font = "13px system-ui, sans-serif";
    y += kLine + 2;
    c.drawImage(canvas, kRoom, y, canvas.clientWidth, canvas.clientHeight);
    y = draw_legend(c, legend, y + canvas.clientHeight + 4, width) + kRoom;
  }
  return y;
}

/** @param {Figure[]} figures that the page shows @returns {Promise<Blob>} */
export function png_of(figures) {
  const ratio = window.devicePixelRatio || 1;
  const width = Math.max(...figures.map(({ canvas }) => canvas.clientWidth));
  const canvas = document.createElement("canvas");
  const context = () => /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const height = draw(context(), figures, width);
  canvas.width = Math.round((width + 2 * kRoom) * ratio);
  canvas.height = Math.round(height * ratio);
  const c = context();
  c.scale(ratio, ratio);
  c.fillStyle = ink("page");
  c.fillRect(0, 0, width + 2 * kRoom, height);
  draw(c, figures, width);
  return new Promise((done, failed) => canvas.toBlob((blob) => (blob ? done(blob) : failed(new Error("the picture is too large for this browser"))), "image/png"));
}
