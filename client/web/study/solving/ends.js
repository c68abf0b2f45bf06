// @ts-check
// Between which values a map is solved: those of a picture or a part of it, and fields in which people say others.
import { h } from "/parts/dom.js";
import { axis_value, between_text, ends_around, own_axes, ranges_of } from "../axes.js";
import { rounded } from "../conditions.js";

/** @typedef {import("../study.js").StudyView} View */
/** @typedef {import("../asked/picture.js").Side} Side */

/** Half-way to the neighbours of the one value that a side shows; where it has none, around it. @param {View} view @param {Side} side @returns {number[]} */
function around(view, side) {
  const axis = own_axes(view.block).find((one) => one.key === side.name);
  const [value] = side.values;
  const number = side.numbers?.[0] ?? 0;
  const near = axis ? [number - 1, number + 1].filter((i) => i >= 0 && i < axis.values).map((i) => axis_value(axis, i) ?? value) : [];
  const { from, to } = ends_around(view.study, side.name, value);
  return near.length > 0 ? [value, ...near.map((one) => (value + one) / 2)] : [from, to];
}

/** @param {View} view @param {Side} side @param {number[] | null} cells of a rectangle, first and last @param {number[]} edges of it */
function ends_of(view, side, cells, edges) {
  const all = side.values;
  let values = cells ? cells.map((i) => all[i]) : [...all];
  if (cells && cells[0] === cells[1] && all.length > 1) {
    const [least, most] = [Math.min(...all), Math.max(...all)];
    values = edges.map((one) => Math.min(Math.max(one, least), most));
  }
  if (Math.min(...values) === Math.max(...values)) values = around(view, side);
  return [Math.min(...values), Math.max(...values)];
}

/** What an address says of a picture that is to be solved, or of a part of it. @param {View} view @param {import("../drawn/brush.js").Rectangle | null} part */
export function between_of(view, part) {
  const picture = /** @type {import("../asked/picture.js").Picture} */ (view.picture);
  const range = (/** @type {Side} */ side, /** @type {0 | 1} */ i, /** @type {string} */ log) => {
    const ends = ends_of(view, side, part && [part.from[i], part.to[i]], part ? [part.x, part.y][i] : []);
    // Of values that a computation gave, what a pixel of the map can tell.
    const [from, to] = ends.map((one) => rounded(one, ends[1] - ends[0]));
    return { from, to, is_log: view.is(log) !== "" && from > 0 };
  };
  return between_text({ [picture.x.name]: range(picture.x, 0, "xlog"), [picture.y.name]: range(picture.y, 1, "ylog") });
}

/** All digits of a number are seen: without its last ones it reads as a smaller one. @param {string} text */
const room_of = (text) => Math.max(8, text.length + 1);

/** Fields for the ends of both axes. @param {View} view @param {(between: string) => void} take */
export function ends_fields(view, take) {
  const wrong = h("p", { role: "status", class: "said" });
  const tell = (/** @type {string} */ what) => {
    wrong.textContent = what;
    wrong.classList.toggle("bad", what !== "");
  };
  const rows = h("div", { class: "row ends" });
  const element = h("div", { hidden: true }, rows, wrong);
  let shown = "";

  function read() {
    const inputs = /** @type {HTMLInputElement[]} */ ([...rows.querySelectorAll("input")]);
    const ranges = ranges_of(shown) ?? {};
    for (const input of inputs) {
      const [key, end] = /** @type {[string, "from" | "to"]} */ ([input.dataset.key, input.dataset.end]);
      ranges[key][end] = input.value.trim() === "" ? NaN : Number(input.value.replace(",", "."));
      ranges[key].is_log &&= ranges[key].from > 0;
    }
    const bad = Object.keys(ranges).find((key) => !(ranges[key].from < ranges[key].to));
    for (const input of inputs) input.setAttribute("aria-invalid", String(input.dataset.key === bad));
    tell(bad ? `${bad} must go from a number to a greater one.` : "");
    const text = between_text(ranges);
    if (!bad && text !== shown) take(text);
  }
  return { element,
    /** As the address has them; what is wrong stays to be mended. */
    show() {
      const between = view.is("between");
      element.hidden = between === "";
      const ranges = ranges_of(between);
      if (!ranges || between === shown) return;
      shown = between;
      tell("");
      const focused = /** @type {HTMLElement} */ (document.activeElement)?.dataset ?? {};
      const field = (/** @type {string} */ key, /** @type {"from" | "to"} */ end) => h("input", { type: "text", inputMode: "decimal", size: room_of(String(ranges[key][end])), value: String(ranges[key][end]),
        "aria-label": `${key} ${end}`, "data-key": key, "data-end": end, onchange: read,
        oninput: (/** @type {any} */ event) => { event.target.size = room_of(event.target.value); } });
      // In the order of the pickers above.
      rows.replaceChildren(...[view.is("x"), view.is("y")].filter((key) => ranges[key]).map((key) => h("span", { class: "from-to" }, h("span", { class: "weak" }, `${key} from`),
        field(key, "from"), h("span", { class: "weak" }, "to"), field(key, "to"), h("span", { class: "weak" }, view.unit_of(key).replace(/^1$/, "")))));
      if (focused.key) /** @type {any} */ (rows.querySelector(`[data-key="${focused.key}"][data-end="${focused.end}"]`))?.focus();
    },
    /** Why what was asked for last is not solved. @param {string} why */
    refuse: tell };
}
