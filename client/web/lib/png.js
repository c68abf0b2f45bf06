// Saves drawings as a PNG file: canvases one below the other, with titles and legends.
import { ink } from "./colours.js";

const margin = 12; // CSS pixels
const lineHeight = 20;

/** Returns the entries of a legend. Each has a text and may have a sign (a canvas). */
function entriesOf(legend) {
  const found = [...(legend?.querySelectorAll("p, .bar canvas, li") ?? [])];
  return found.map((one) => ({
    sign: one instanceof HTMLCanvasElement ? one : one.querySelector("canvas"),
    text: one.textContent.trim(),
    isWide: ["P", "CANVAS"].includes(one.tagName),
  }));
}

/** Draws a legend below position `y`; returns the position below the legend. */
function drawLegend(context, legend, y, width) {
  let x = margin;
  for (const { sign, text, isWide } of entriesOf(legend)) {
    const signWidth = sign ? sign.offsetWidth + 6 : 0;
    const wide = isWide ? width : signWidth + context.measureText(text).width + 18;
    if (x > margin && (isWide || x + wide > margin + width)) {
      x = margin;
      y += lineHeight;
    }
    if (sign) context.drawImage(sign, x, y + 2, sign.offsetWidth, sign.offsetHeight);
    if (text) context.fillText(text, x + signWidth, y + 3);
    x += wide;
    if (!isWide) continue;
    x = margin;
    y += Math.max(sign?.offsetHeight ?? 0, lineHeight);
  }
  return x > margin ? y + lineHeight : y;
}

/** Draws figures one below the other; returns the position below the last. */
function drawFigures(context, figures, width) {
  let y = margin;
  context.fillStyle = ink("text");
  context.textBaseline = "top";
  for (const { title, canvas, legend } of figures) {
    context.font = "600 14px system-ui, sans-serif";
    context.fillText(title, margin, y);
    context.font = "13px system-ui, sans-serif";
    y += lineHeight + 2;
    context.drawImage(canvas, margin, y, canvas.clientWidth, canvas.clientHeight);
    y = drawLegend(context, legend, y + canvas.clientHeight + 4, width) + margin;
  }
  return y;
}

/**
 * Creates a PNG file. Figures are {title, canvas, legend}; canvas and legend are elements of the
 * page; the legend may be null.
 */
export function pngOf(figures) {
  const ratio = window.devicePixelRatio || 1;
  const width = Math.max(...figures.map(({ canvas }) => canvas.clientWidth));
  const canvas = document.createElement("canvas");
  const height = drawFigures(canvas.getContext("2d"), figures, width);
  canvas.width = Math.round((width + 2 * margin) * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  context.fillStyle = ink("page");
  context.fillRect(0, 0, width + 2 * margin, height);
  drawFigures(context, figures, width);
  return new Promise((resolve, reject) =>
    canvas.toBlob((blob) =>
      blob ? resolve(blob) : reject(new Error("the picture is too large for this browser")),
    ),
  );
}
