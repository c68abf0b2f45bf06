// @ts-check
// What is drawn of a picture: a map or points on a canvas, lines, bars; with what colours mean and how much is shown.
import { h } from "/parts/dom.js";
import { palette } from "/parts/colours.js";
import { has_span, span_of } from "./command.js";
import { part_of } from "./conditions.js";
import { categories, colour_bar, gaps } from "./drawn/legend.js";
import { facts } from "./words.js";

/** @param {import("./study.js").StudyView} view */
export function drawing_of(view) {
  const lines_place = h("div", {});
  const legend = h("div", { class: "colours" });
  const told = h("p", { class: "weak facts" });
  /** @type {any} */
  let lines = null;
  let turn = 0;

  function end() {
    ++turn;
    lines?.close();
    lines = null;
    lines_place.replaceChildren();
  }
  /** @param {import("./asked/picture.js").Picture} picture @returns {import("./drawn/map.js").Look} */
  function look_of(picture) {
    const [from, to] = span_of(view, picture);
    return { colours: palette(view.is("pal") || "viridis"), from, to, z_log: view.is("zlog") !== "" && from > 0,
      x_log: view.is("xlog") !== "", y_log: view.is("ylog") !== "" };
  }
  /** @param {import("./asked/picture.js").Picture} picture */
  async function draw_lines(picture) {
    const mine = ++turn;
    const as_bars = view.is("pic") === "histogram";
    const { drawn_lines } = await import("./drawn/drawn_lines.js");
    if (mine !== turn) return;
    lines?.close();
    lines = drawn_lines(picture, { as_bars, x_log: view.is("xlog") !== "", y_log: view.is("ylog") !== "", counts: view.marking.marks?.counts,
      y_ends: !as_bars && has_span(view) ? span_of(view, picture) : undefined, zoomed: (part) => view.zoom_lines(part),
      drag_marks: view.is("drag") === "mark", brushed: (part) => (as_bars ? view.marking.mark(part ? part_of(picture.x, [], part.x) : "") : view.marking.mark_lines(part)) });
    if (!as_bars) lines.mark(view.marking.marks);
    lines_place.replaceChildren(lines.element);
  }
  return { lines_place, legend, told, end,
    /** By the colours and scales that the address says. */
    draw() {
      const { picture } = view;
      if (!picture) return;
      legend.replaceChildren();
      if (view.has_map) {
        end();
        const look = look_of(picture);
        view.map.show(picture, look, view.marking.marks);
        if (picture.z.is_category) legend.append(categories(picture));
        else if (picture.least !== null) legend.append(colour_bar(picture, look));
        legend.append(gaps(picture));
      } else {
        draw_lines(picture).catch((error) => view.complain(error));
      }
      told.textContent = facts(picture, view.is("pic"), view.study).join(" ");
      if (view.has_map && !picture.z.is_category && picture.least !== null && picture.most !== null) {
        const [from, to] = span_of(view, picture);
        if (picture.most < from || picture.least > to) told.append(` All values lie ${picture.most < from ? "below" : "above"} what colours span.`);
      }
      if (view.is("x0") || view.is("y0") || (view.is("pic") === "lines" && has_span(view))) told.append(" A part is shown. ", h("button", { type: "button", onclick: () => view.zoom(null) }, "Show all"));
    },
    /** Only what is marked is another. */
    mark() {
      if (view.has_map) view.map.mark(view.marking.marks);
      else if (view.is("pic") === "histogram" && view.picture) draw_lines(view.picture);
      else lines?.mark(view.marking.marks);
    } };
}
