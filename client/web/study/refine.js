// Submits the shown part of a map as a new study with more values along both axes.
import { post } from "../api.js";
import { button, h, labelled } from "../lib/dom.js";
import { count } from "../lib/format.js";

/** Minimum number of steps along a refined axis. Refining at least doubles the number. */
const leastSteps = 64;

const integrators = ["explicit", "generalized-alpha"];

/**
 * Returns the model of a recipe in the form that the server expects: names end with their units.
 */
function modelOf(model) {
  const nameOf = ({ key, unit }) =>
    unit ? `${key}_${unit.replace("/", "_").replaceAll("^", "")}` : key;
  const own = model.filter(({ key }) => key !== "links" && key !== "length"); // lengths gives both
  const values = Object.fromEntries(own.map((one) => [nameOf(one), one.value]));
  return { ...values, integrator: Math.max(integrators.indexOf(values.integrator), 0) };
}

/** Returns an axis with more values, from the smallest to the largest shown value. */
function finerAxis(view, name, axis) {
  const { values } = view.picture[name];
  const { first, last } = view.picture.head[name];
  const [from, to] = [Math.min(...values), Math.max(...values)];
  const steps = last - first;
  if (steps === 0) return { key: axis.key, values: [from] };
  const isLog = axis.range ? axis.range.spacing === "log" : view.field(`${name}log`) && from > 0;
  return {
    key: axis.key,
    from,
    to,
    count: steps * Math.max(2, Math.ceil(leastSteps / steps)) + 1,
    ...(isLog ? { spacing: "SPACING_LOGARITHMIC" } : {}),
  };
}

/**
 * Returns the axes of the shown block. The two axes of the map get more values; other axes keep
 * their selected values.
 */
function finerAxes(view) {
  const held = new Map(view.picture.head.at.map((one) => [one.key, one.value]));
  return view.block.axes.map((axis) => {
    const { key, expression } = axis;
    const name = ["x", "y"].find((one) => view.field(one) === key);
    if (name) return finerAxis(view, name, axis);
    return expression ? { key, expression } : { key, values: [held.get(key)] };
  });
}

/** Returns "a-refined" for "a", then "a-refined-2", and so on. */
function nextName(name) {
  const [, base, number = "1"] = /^(.*)-refined(?:-(\d+))?$/.exec(name) ?? [];
  return base === undefined ? `${name}-refined` : `${base}-refined-${Number(number) + 1}`;
}

/** Creates the button and a field for the name of the new study. */
export function refineRow(view) {
  const settings = { type: "text", value: nextName(view.study.name), spellcheck: false };
  const name = h("input", { ...settings, autocomplete: "off" });
  const title =
    "Submits the shown part with more values along both axes as a new study and shows it";
  const submitButton = button("Refine", () => submit(), { class: "refine", title });
  const element = h("div.row", { hidden: true }, labelled("new study", name), submitButton);

  async function submit() {
    const { block, study } = view;
    submitButton.disabled = true;
    try {
      const axes = { axes: finerAxes(view), ...(block.where ? { where: block.where } : {}) };
      const recipe = { errors: study.errors, model: modelOf(study.model), blocks: [axes] };
      const made = await post("api/studies", { name: name.value.trim(), recipe });
      const kept = ["z", "x", "y", "xlog", "ylog", "zlog", "from", "to"]
        .map((one) => [one, view.field(one)])
        .filter(([, value]) => value !== "");
      view.place.go(`#/study/${made.id}?${new URLSearchParams([["pic", "map"], ...kept])}`);
    } catch (error) {
      view.complain(error);
    }
    submitButton.disabled = false;
  }
  return {
    element,
    /** Shows the button if the picture can be refined. */
    offer() {
      const isMap = view.field("pic") === "map" && view.picture.head.x?.stride;
      element.hidden = !view.place.mayChange || !isMap;
      if (element.hidden) return;
      const axes = finerAxes(view);
      const size = ["x", "y"].map(
        (side) => axes.find(({ key }) => key === view.field(side))?.count ?? 1,
      );
      submitButton.textContent = `Refine to ${size.map(count).join(" × ")} points`;
    },
  };
}
