// @ts-check
// What is drawn of a picture: a map or points on a canvas, lines, bars; with what colours mean and how much is shown.
import { h, keep_focus } from "/parts/dom.js";
import { palette } from "/parts/colours.js";
import { has_span, span_of } from "./take.js";
import { part_of } from "./conditions.js";
import { categories, colour_bar, gaps } from "./drawn/legend.js";
import { facts } from "./words.js";

/**
 * @typedef {import("./study.js").StudyView} View
 * @typedef {import("./pictures.js").Picture} Picture
 */

/** Colours and scales of a map. @param {View} view @param {Picture} picture @returns {import("./drawn/map.js").Look} */
function look_of(view, picture) {
  const [from, to] = span_of(view, picture);
  return { colours: palette(), from, to, z_log: view.is("zlog") !== "" && from > 0,
    x_log: view.is("xlog") !== "", y_log: view.is("ylog") !== "" };
}

/** Scales of lines or bars, and what hands do with them. @param {View} view @param {Picture} picture @returns {import("./drawn/drawn_lines.js").How} */
function how_of(view, picture) {
  const as_bars = view.is("pic") === "histogram";
  return { as_bars, x_log: view.is("xlog") !== "", y_log: view.is("ylog") !== "", drag_marks: view.is("drag") === "mark",
    counts: view.marking.marks?.counts ?? (view.is("mark") ? [] : null),
    y_ends: !as_bars && has_span(view) ? span_of(view, picture) : undefined,
    zoomed: (part) => view.zoom_lines(part),
    brushed: (part, is_further = false) => (as_bars ? view.marking.mark(part ? part_of(picture.x, [], part.x) : "", is_further)
      : view.marking.mark_lines(part, is_further)) };
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
  /** @type {any} */
  let lines = null;
  let turn = 0;

  function end() {
    ++turn;
    lines?.close();
    lines = null;
    lines_place.replaceChildren();
  }
  /** @param {Picture} picture */
  async function draw_lines(picture) {
    const mine = ++turn;
    const how = how_of(view, picture);
    const { drawn_lines } = await import("./drawn/drawn_lines.js");
    if (mine !== turn) return;
    // The same plot stays under the hands that are at it.
    if (!lines?.update(picture, how)) {
      const hands = lines?.hands;
      lines?.close();
      lines = drawn_lines(picture, how);
      lines_place.replaceChildren(lines.element);
      if (hands) lines.go_on(hands);
    }
    if (!how.as_bars) lines.mark(view.marking.marks);
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
      return lines && { ...lines.figure(), title: `${title}: ${lines.figure().title}` };
    },
    /** Only what is marked is another. */
    mark() {
      if (view.has_map) view.map.mark(view.marking.marks);
      else if (view.is("pic") === "histogram" && view.picture) draw_lines(view.picture);
      else lines?.mark(view.marking.marks);
    } };
}
