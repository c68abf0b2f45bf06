// @ts-check
// What a picture is of: pickers, sliders, scales. A choice goes into the address, and from there into the picture.
import { h, keep_focus, named, picker, tick } from "/parts/dom.js";
import { count, heading, shown } from "/parts/format.js";
import { axis_value, fill_in, varying } from "./axes.js";
import { colour_controls } from "./drawn/legend.js";
import { show_takeaways } from "./take.js";

/** @typedef {import("./study.js").StudyView} View */

/** The pickers above a picture, and what follows from a choice. @param {View} view */
export function show_controls(view) {
  const kind = view.is("pic");
  const again = (/** @type {Record<string, string>} */ changes) => {
    // Another output is one of the same part.
    view.set({ ...changes, ...("z" in changes ? {} : { x0: "", x1: "", y0: "", y1: "", cell: "" }) }, true);
    fill_in(view.fields, view.study);
    view.place.keep(view.fields);
    view.choice.none();
    show_controls(view);
    view.load();
    view.table.load();
  };
  const may_map = view.grids.some((/** @type {any} */ g) => varying(g.b).length > 1);
  const kinds = [...(may_map ? [["map", "map"]] : []),
    ...(view.grids.length > 0 ? [["lines", "lines"]] : []), ["gathered", "scatter"], ["histogram", "histogram"]];
  const on_grid = kind === "map" || kind === "lines";
  const axes = on_grid ? varying(view.block).map((a) => [a.key, heading(a.key, a.unit)])
    : view.numbers.map((c) => [c.name, heading(c.name, c.unit)]);
  const outputs = view.columns.filter((c) => c.picture === "numbers" || (kind === "map" && c.picture === "categories"))
    .map((c) => [c.name, heading(c.name, c.unit)]);
  const parts = [named("picture", picker(kinds, kind, (pic) => again({ pic, ...(on_grid && pic === "histogram" ? { x: "" } : {}), y: "", from: "", to: "" })))];
  if (kind !== "histogram") {
    parts.push(named(kind === "gathered" ? "colour" : "output", picker(kind === "gathered" ? [["", "none"], ...outputs] : outputs, view.is("z"), (z) => {
      if (z === "") view.fields.set("z", "");
      again({ ...(z === "" ? {} : { z }), from: "", to: "" });
    })));
  }
  if (on_grid && view.grids.length > 1) {
    parts.push(named("block", picker(view.grids.map((/** @type {any} */ g) => [String(g.i), `${g.i + 1}: ${varying(g.b).map((a) => `${a.values} ${a.key}`).join(" × ")}`]),
      view.is("block"), (block) => again({ block, at: "" }))));
  }
  parts.push(named(kind === "histogram" ? "of" : "across", picker(axes, view.is("x"), (x) => again({ x, ...(x === view.is("y") ? { y: on_grid ? view.is("x") : "" } : {}) }))));
  if (kind !== "histogram" && axes.length > 1) {
    parts.push(named(kind === "lines" ? "a line for each" : "upwards", picker(kind === "lines" ? [["", "none"], ...axes.filter(([k]) => k !== view.is("x"))] : axes, view.is("y"),
      (y) => again({ y, ...(y === view.is("x") ? { x: view.is("y") } : {}) }))));
  }
  const redraw = (/** @type {Record<string, string>} */ changes) => {
    view.set(changes);
    if (kind === "map") view.drawing.draw();
    else view.load();
    show_takeaways(view);
  };
  parts.push(h("div", { class: "ticks" }, tick(`log ${view.is("x")}`, view.is("xlog") !== "", (is) => redraw({ xlog: is ? "1" : "" })),
    kind === "histogram" ? null : tick(kind === "lines" ? "log output" : `log ${view.is("y")}`, view.is("ylog") !== "", (is) => redraw({ ylog: is ? "1" : "" }))));
  const drags = picker([["zoom", "zooms in"], ["mark", "marks points"]], view.is("drag") === "mark" ? "mark" : "zoom", (drag) => {
    view.set({ drag: drag === "mark" ? "mark" : "" });
    view.map.let_drag(drag === "mark" ? "mark" : "zoom");
    view.drawing.draw();
  });
  drags.title = "with Shift it is the other one";
  parts.push(named("dragging", drags));
  keep_focus(view.controls, () => view.controls.replaceChildren(...parts));
  show_sliders(view, on_grid);
  const has_bar = (kind === "map" || kind === "gathered") && view.columns.find((c) => c.name === view.is("z"))?.picture !== "categories";
  const colours = has_bar ? [colour_controls({ from: view.is("from"), to: view.is("to"), is_log: view.is("zlog") !== "" },
    (changed) => {
      view.set(/** @type {any} */ (changed));
      if ("from" in changed && "to" in changed) show_controls(view);
      view.drawing.draw();
      show_takeaways(view);
    })] : [];
  keep_focus(view.colour_row, () => view.colour_row.replaceChildren(...colours));
}

/** At which values the other axes are held. @param {View} view @param {boolean} on_grid */
function show_sliders(view, on_grid) {
  const others = on_grid ? varying(view.block).filter((a) => a.key !== view.is("x") && a.key !== view.is("y")) : [];
  const places = view.places();
  view.sliders.replaceChildren(...others.map((axis) => {
    const number = Math.min(places.get(axis.key) ?? 0, axis.values - 1);
    const out = h("output", { "data-axis": axis.key }, held(axis, number));
    const slider = h("input", { type: "range", min: 0, max: axis.values - 1, step: 1, value: number, "aria-label": `${axis.key}, held at`,
      "aria-valuetext": held(axis, number), oninput: () => {
        const now = view.places();
        now.set(axis.key, Number(slider.value));
        out.textContent = held(axis, Number(slider.value));
        slider.setAttribute("aria-valuetext", out.textContent);
        view.set({ at: [...now].map(([key, n]) => `${key}@${n}`).join(",") });
        view.load(true);  // what comes while it is dragged is shown
      }, onchange: () => {
        if (view.wants_more) view.load();
      } });
    return h("div", { class: "slider" }, h("span", {}, axis.key), slider, out);
  }));
}

/** @param {any} axis @param {number} number */
function held(axis, number) {
  const value = axis_value(axis, number);
  return value === undefined ? `value ${number + 1} of ${count(axis.values)}` : `${shown(value)} ${axis.unit === "1" ? "" : axis.unit}`;
}
