// Pickers, sliders and scales of a picture. Their state is in the address of the page.
import { button, checkbox, h, labelled, picker, setChildren } from "../lib/dom.js";
import { heading, shown, shownUnit, withUnit } from "../lib/format.js";
import { axisValue, fillIn, varyingAxes } from "./fields.js";

const zoomedOut = { x0: "", x1: "", y0: "", y1: "", page: "" };

export function controlsOf(view) {
  const { study } = view;
  const grids = [...study.blocks.entries()].filter(([, block]) => varyingAxes(block).length > 0);
  const pickers = h("div.controls");
  const sliders = h("div.sliders");

  function choose(changes) {
    view.set(changes, true);
    fillIn(view.fields, study);
    view.place.keep(view.fields);
    show();
    view.load();
  }

  /**
   * Draws the picture with other settings. Loads its data again only if they depend on the scale.
   */
  function redraw(changes) {
    view.set(changes);
    if (view.field("pic") === "map") view.draw();
    else view.load();
  }

  function kindPicker() {
    const mayMap = grids.some(([, block]) => varyingAxes(block).length > 1);
    const kinds = ["map", "lines", "scatter", "histogram"].filter(
      (kind) => kind !== "map" || mayMap,
    );
    const isOfGrid = (kind) => grids.length > 0 && ["map", "lines"].includes(kind);
    return picker(kinds, view.field("pic"), (pic) => {
      const keepsX = isOfGrid(pic) && isOfGrid(view.field("pic"));
      const z = view.field("z") === "" ? {} : { z: view.field("z") };
      choose({ pic, ...zoomedOut, ...z, ...(keepsX ? {} : { x: "" }), y: "", from: "", to: "" });
    });
  }

  /** Returns the columns that a picture can show. Always includes `shownColumn`. */
  function columnChoices(shownColumn, mayBeCategory) {
    const found = view.columns.filter(
      ([name]) => mayBeCategory || view.columnOf(name).picture === "numbers",
    );
    const isMissing = shownColumn && !found.some(([name]) => name === shownColumn);
    const all = isMissing ? [...found, [shownColumn, "other"]] : found;
    return all.map(([name, group]) => [name, heading(name, view.unitOf(name)), group]);
  }

  function outputPicker() {
    const kind = view.field("pic");
    const outputs = columnChoices(view.field("z"), kind === "map" || kind === "scatter");
    const none = kind === "scatter" ? [["", "none"]] : [];
    const z = picker([...none, ...outputs], view.field("z"), (name) => {
      view.fields.set("z", name); // "" is a valid choice
      choose({ ...(name ? { z: name } : {}), from: "", to: "" });
    });
    return labelled(kind === "scatter" ? "colour" : "output", z);
  }

  function axisPickers() {
    const axes = view.block
      ? varyingAxes(view.block).map((axis) => [axis.key, heading(axis.key, axis.unit)])
      : null;
    const axisPicker = (name, none = []) =>
      picker(
        [...none, ...(axes ?? columnChoices(view.field(name), false))],
        view.field(name),
        (key) =>
          choose({
            [name]: key,
            ...(name === "x" && view.field("y") === key ? { y: "" } : {}),
            ...zoomedOut,
          }),
      );
    const found = [labelled("x axis", axisPicker("x"))];
    if (view.hasMap) found.push(labelled("y axis", axisPicker("y")));
    else if (axes?.length > 1)
      found.push(labelled("lines of", axisPicker("y", [["", "one line"]])));
    return found;
  }

  function blockPicker() {
    const choices = grids.map(([i, block]) => {
      const size = varyingAxes(block).map((axis) => `${axis.values} ${axis.key}`);
      return [String(i), `${i + 1}: ${size.join(" × ")}`];
    });
    return labelled(
      "block",
      picker(choices, view.field("block"), (block) => choose({ block, ...zoomedOut })),
    );
  }

  function scaleBoxes() {
    const kind = view.field("pic");
    const isOn = (name) => view.field(name) !== "";
    const box = (name, text) =>
      checkbox(text, isOn(name), (is) => redraw({ [name]: is ? "1" : "" }));
    return h(
      "div.ticks",
      box("xlog", "log x"),
      kind !== "histogram" && !(kind === "lines" && !view.block) && box("ylog", "log y"),
      hasColourBar() && box("zlog", "log colours"),
    );
  }

  function mousePicker() {
    const drags = picker(["zoom", "select"], view.field("drag") || "zoom", (drag) => {
      view.set({ drag: drag === "select" ? drag : "" });
      view.map.dragSelects = drag === "select";
      view.draw();
    });
    return labelled("mouse", drags, "While dragging; with Shift the other action");
  }

  const hasColourBar = () => view.hasMap && view.columnOf(view.field("z"))?.picture === "numbers";

  /** Creates the fields for the range of the colours, in shown units. */
  function rangeFields() {
    const [, factor] = shownUnit(view.field("z"), view.unitOf(view.field("z")));
    const end = (name) => {
      const value = view.field(name) === "" ? "" : shown(Number(view.field(name)) * factor);
      const settings = { type: "text", inputMode: "decimal", value, placeholder: "auto", size: 7 };
      const field = h("input", settings);
      field.addEventListener("change", () => {
        const text = field.value.trim();
        const isNumber = Number.isFinite(Number(text));
        field.setAttribute("aria-invalid", String(!isNumber));
        if (isNumber) redraw({ [name]: text === "" ? "" : String(Number(text) / factor) });
      });
      return field;
    };
    const fit = () => {
      redraw({ from: "", to: "" });
      show();
    };
    return [labelled("colours from", end("from")), labelled("to", end("to")), button("Fit", fit)];
  }

  function sliderOf(axis) {
    const number = Math.min(view.places().get(axis.key) ?? 0, axis.values - 1);
    const output = h("output", { "data-axis": axis.key });
    const slider = h("input", {
      type: "range",
      min: 0,
      max: axis.values - 1,
      value: number,
      "aria-label": `value of ${axis.key}`,
    });
    const tell = () => {
      const i = Number(slider.value);
      const value = axisValue(axis, i);
      const place = `value ${i + 1} of ${axis.values}`;
      output.textContent = value === undefined ? place : withUnit(value, axis.key, axis.unit);
      slider.setAttribute("aria-valuetext", output.textContent);
    };
    slider.addEventListener("input", () => {
      tell();
      const places = view.places().set(axis.key, Number(slider.value));
      view.set({ at: [...places].map(([key, at]) => `${key}@${at}`).join(",") });
      view.load({ waits: true });
    });
    tell();
    return h("div.slider", h("span", axis.key), slider, output);
  }

  function show() {
    const isHistogram = view.field("pic") === "histogram";
    setChildren(
      pickers,
      labelled("picture", kindPicker()),
      !isHistogram && outputPicker(),
      ...axisPickers(),
      view.block && grids.length > 1 && blockPicker(),
      mousePicker(),
      ...(hasColourBar() ? rangeFields() : []),
      scaleBoxes(),
    );
    const isShown = ({ key }) => key === view.field("x") || key === view.field("y");
    const held = view.block ? varyingAxes(view.block).filter((axis) => !isShown(axis)) : [];
    sliders.replaceChildren(...held.map(sliderOf));
  }
  return { element: h("div", pickers, sliders), show };
}
