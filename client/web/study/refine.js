// @ts-check
// Submits the part that a map shows as a study of its own, with more values along both axes.
import { h, named } from "/parts/dom.js";
import { count } from "/parts/format.js";
import { change } from "/server.js";

/** Steps along an axis are halved, or divided further until there are this many. */
const kLeastSteps = 64;

/** Keys of the model as a recipe has them. */
const kModelKeys = { E: "E_Pa", A: "A_m2", I: "I_m4", rho: "rho_kg_m3", g: "g_m_s2", elements_per_link: "elements_per_link", k: "k_N_m", eta2: "eta2",
  tip_mass: "tip_mass_kg", dt: "dt_s", dt_fall: "dt_fall_s", spectral_radius: "spectral_radius", tolerance: "tolerance", lengths: "lengths_m" };
const kIntegrators = ["explicit", "generalized-alpha"];

/** @typedef {import("./study.js").StudyView} View */

/** The model of a study as a recipe has it. @param {{key: string, value: any}[]} model */
function model_of(model) {
  const value = (/** @type {string} */ key) => model.find((one) => one.key === key)?.value;
  return { ...Object.fromEntries(Object.entries(kModelKeys).map(([key, name]) => [name, value(key)])), integrator: Math.max(kIntegrators.indexOf(value("integrator")), 0) };
}

/** An axis between the least and the most value that are shown of it. @param {View} view @param {"x" | "y"} name @param {import("./axes.js").Axis} axis */
function finer_axis(view, name, axis) {
  const { [name]: side, head } = /** @type {any} */ (view.picture);
  const [from, to] = [Math.min(...side.values), Math.max(...side.values)];
  const steps = head[name].last - head[name].first;
  if (steps === 0) return { key: axis.key, values: [from] };
  const is_log = axis.range ? axis.range.spacing === "log" : view.is(`${name}log`) !== "" && from > 0;
  return { key: axis.key, from, to, count: steps * Math.max(2, Math.ceil(kLeastSteps / steps)) + 1, ...(is_log ? { spacing: "SPACING_LOGARITHMIC" } : {}) };
}

/** The axes of the block that is shown, other axes held where they are. @param {View} view @returns {any[]} */
function finer_axes(view) {
  const held = new Map(view.picture?.head.at.map((/** @type {any} */ one) => [one.key, one.value]));
  return view.block.axes.map((/** @type {import("./axes.js").Axis} */ axis) => {
    if (axis.key === view.is("x")) return finer_axis(view, "x", axis);
    if (axis.key === view.is("y")) return finer_axis(view, "y", axis);
    return axis.expression ? { key: axis.key, expression: axis.expression } : { key: axis.key, values: [held.get(axis.key)] };
  });
}

/** A name for what is refined of a study. @param {string} name */
function next_name(name) {
  const [, base, number] = /^(.*)-refined(?:-(\d+))?$/.exec(name) ?? [];
  return base === undefined ? `${name}-refined` : `${base}-refined-${Number(number ?? 1) + 1}`;
}

/** A field for the new study's name, and the button. @param {View} view */
export function refine_row(view) {
  const name = h("input", { type: "text", value: next_name(view.study.name), spellcheck: false, autocomplete: "off" });
  const button = h("button", { type: "button", class: "refine", title: "Submits the shown part with more values along both axes as a study", onclick: () => submit() }, "Refine");
  const element = h("div", { class: "row", hidden: true }, named("refined as the study", name), button);

  async function submit() {
    const { block, study } = view;
    button.disabled = true;
    try {
      const recipe = { errors: study.errors, model: model_of(study.model), blocks: [{ axes: finer_axes(view), ...(block.where ? { where: block.where } : {}) }] };
      const made = await change("/api/studies", { name: name.value.trim(), recipe });
      const kept = ["z", "x", "y", "xlog", "ylog", "zlog", "from", "to"].map((one) => [one, view.is(one)]).filter(([, value]) => value !== "");
      view.place.go(`#/study/${made.id}?${new URLSearchParams([["pic", "map"], ...kept])}`);
    } catch (error) {
      view.complain(error);
    }
    button.disabled = false;
  }
  return { element,
    /** For the picture that is shown. */
    offer() {
      element.hidden = !view.place.may_change || view.is("pic") !== "map" || !view.picture?.head.x?.stride;
      if (element.hidden) return;
      const axes = finer_axes(view);
      const size = (/** @type {"x" | "y"} */ side) => axes.find((axis) => axis.key === view.is(side))?.count ?? 1;
      button.textContent = `Refine to ${count(size("x"))} × ${count(size("y"))} points`;
    } };
}
