// @ts-check
// What is drawn of a picture: a map or points on a canvas, lines, bars; with what colours mean and how much is shown.
import { h, keep_focus } from "/parts/dom.js";
import { palette } from "/parts/colours.js";
import { shown } from "/parts/format.js";
import { has_span, span_of } from "./take.js";
import { part_of } from "./conditions.js";
import { categories, colour_bar, gaps } from "./drawn/legend.js";
import { facts } from "./words.js";

/**
 * @typedef {import("./study.js").StudyView} View
 * @typedef {import("./pictures.js").Picture} Picture
 */

/** In which order values lie along an axis. @param {Picture} picture */
const order_of = (picture) => Array.from(picture.x.values.keys()).sort((a, b) => picture.x.values[a] - picture.x.values[b]);

/** A picture as lines or bars, with what is done with a part that is marked or zoomed into. @param {View} view @param {Picture} picture @returns {import("/parts/lines.js").Lines} */
function lines_of(view, picture) {
  const { x, y, z } = picture;
  const as_bars = view.is("pic") === "histogram";
  const y_log = view.is("ylog") !== "" && !as_bars;
  const order = order_of(picture);
  const unit = y.unit && y.unit !== "1" ? ` ${y.unit}` : "";
  const series = Array.from(y.values.keys()).map((row) => ({
    label: as_bars ? "all" : y.name ? `${y.name} = ${shown(y.values[row])}${unit}` : z.name,
    values: order.map((i) => {
      const value = as_bars ? picture.head.counts[i] : picture.values[row * x.values.length + i];
      return Number.isFinite(value) && !(y_log && value <= 0) ? value : null;
    }) }));
  const counts = view.marking.marks?.counts ?? (view.is("mark") ? [] : null);
  if (as_bars && counts) series.push({ label: "marked", values: order.map((i) => counts[i] ?? 0) });
  const xs = order.map((i) => x.values[i]);
  const ends = x.edges ? [x.edges[0], x.edges[x.edges.length - 1]] : [xs[0], xs[xs.length - 1]];
  return { title: as_bars ? `How often values of ${x.name} are met` : `${z.name} over ${x.name}`,
    x: { name: x.name, unit: x.unit, values: xs, is_log: view.is("xlog") !== "" && xs[0] > 0, ends, edges: x.edges },
    y: { name: as_bars ? "points" : z.name, unit: as_bars ? "" : z.unit, is_log: y_log, ends: !as_bars && has_span(view) ? span_of(view, picture) : undefined },
    series, as_bars, drag_marks: view.is("drag") === "mark", height: 380, zoomed: (part) => view.zoom_lines(part),
    brushed: (part, is_further = false) => (as_bars ? view.marking.mark(part ? part_of(x, [], part.x) : "", is_further)
      : view.marking.mark_lines(part, is_further)) };
}

/** Colours and scales of a map. @param {View} view @param {Picture} picture @returns {import("./drawn/map.js").Look} */
function look_of(view, picture) {
  const [from, to] = span_of(view, picture);
  return { colours: palette(), from, to, z_log: view.is("zlog") !== "" && from > 0,
    x_log: view.is("xlog") !== "", y_log: view.is("ylog") !== "" };
}

/** That no value has a colour of its own, where it is so. @param {View} view @param {Picture} picture */
function beyond_colours(view, picture) {
  const { z, least, most } = picture;
  if (!view.has_map || z.is_category || least === null || most === null) return "";
  const [from, to] = span_of(view, picture);
  return most < from || least > to ? ` All values lie ${most < from ? "below" : "above"} what colours span.` : "";
}

/** What colours mean; a list that is open stays so. @param {HTMLElement} legend @param {Picture} picture @param {import("./drawn/map.js").Look} look */
function show_legend(legend, picture, look) {
  const means = picture.z.is_category ? categories(picture) : picture.least !== null ? colour_bar(picture, look) : "";
  const is_open = legend.querySelector("details")?.open ?? false;
  keep_focus(legend, () => legend.replaceChildren(means, gaps(picture)));
  const others = legend.querySelector("details");
  if (others) others.open = is_open;
}

/** @param {View} view */
export function drawing_of(view) {
  const lines_place = h("div", {});
  const legend = h("div", { class: "colours" });
  const said = h("span", {});
  /** What stands while a part is shown. */
  const part = h("span", {}, " A part is shown. ", h("button", { type: "button", onclick: () => view.zoom(null) }, "Show all"));
  const told = h("p", { class: "weak facts" }, said);
  /** Lines or bars. @type {any} */
  let plot = null;
  let turn = 0;

  function end() {
    ++turn;
    plot?.close();
    plot = null;
    lines_place.replaceChildren();
  }
  /** @param {Picture} picture */
  async function draw_lines(picture) {
    const mine = ++turn;
    const { line_plot } = await import("/parts/lines.js");
    if (mine !== turn) return;
    const lines = lines_of(view, picture);
    // The same plot stays under the hands that are at it.
    if (!plot?.update(lines)) {
      const hands = plot?.hands;
      plot?.close();
      plot = line_plot(lines);
      lines_place.replaceChildren(plot.element);
      if (hands) plot.go_on(hands);
    }
    if (!lines.as_bars) mark_lines(picture);
  }
  /** @param {Picture} picture */
  function mark_lines(picture) {
    const { marks } = view.marking;
    const nx = picture.x.values.length;
    plot?.mark(marks && Array.from(picture.y.values.keys()).map((row) => order_of(picture).map((i) => marks.cells[row * nx + i])));
  }
  return { lines_place, legend, told, end,
    /** By the colours and scales that the address says. */
    draw() {
      const { picture } = view;
      if (!picture) return;
      if (view.has_map) {
        end();
        const look = look_of(view, picture);
        view.map.show(picture, look, view.marking.marks);
        show_legend(legend, picture, look);
      } else {
        legend.replaceChildren();
        draw_lines(picture).catch((error) => view.complain(error));
      }
      said.textContent = facts(picture, view.is("pic"), view.study, view.unit_of).join(" ") + beyond_colours(view, picture);
      const is_part = view.is("x0") || view.is("y0") || (view.is("pic") === "lines" && has_span(view));
      if (!is_part) part.remove();
      else if (!part.isConnected) told.append(part);
    },
    /** The picture as it is drawn, with what colours and lines mean. @returns {import("/parts/png.js").Figure | null} null: it is not drawn yet */
    figure() {
      const title = view.study.name;
      if (view.has_map) return { title, canvas: view.map.base, legend };
      return plot && { ...plot.figure(), title: `${title}: ${plot.figure().title}` };
    },
    /** Only what is marked is another. */
    mark() {
      if (view.has_map) view.map.mark(view.marking.marks);
      else if (view.is("pic") === "histogram" && view.picture) draw_lines(view.picture);
      else if (view.picture) mark_lines(view.picture);
    } };
}
