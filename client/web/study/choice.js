// @ts-check
// The cell or point that is chosen in a picture: spoken, marked in the table, opened.
import { h } from "/parts/dom.js";
import { count } from "/parts/format.js";
import { step_of } from "./pictures.js";
import { sentence } from "./words.js";

/** The number of the value that lies nearest. @param {Float64Array} values @param {number} value */
function nearest(values, value) {
  let best = 0;
  for (let i = 1; i < values.length; ++i) if (Math.abs(values[i] - value) < Math.abs(values[best] - value)) best = i;
  return best;
}

/** @typedef {import("./study.js").StudyView} View */

/** The cell of a point, where the picture shows it. @param {View} view @param {number} point @returns {[number, number] | null} */
function cell_of(view, point) {
  const { picture } = view;
  if (!picture) return null;
  const i = picture.dots?.points.indexOf(point) ?? -1;
  if (picture.dots && i >= 0) return [step_of(picture.x, picture.dots.x[i], view.is("xlog") !== ""), step_of(picture.y, picture.dots.y[i], view.is("ylog") !== "")];
  if (!picture.head.x?.stride) return null;
  const numbers = picture.x.numbers ?? [];
  for (let row = 0; row < picture.y.values.length; ++row) {
    const column = (point - /** @type {number} */ (picture.point(0, row))) / picture.head.x.stride;
    const found = numbers.indexOf(column + (numbers[0] ?? 0));
    if (Number.isInteger(column) && found >= 0) return [found, row];
  }
  return null;
}

/** Where this picture has what was chosen in another one. @param {View} view @param {import("./pictures.js").Picture} picture @param {[number, number]} values @returns {[number, number] | null} */
function cell_at(view, picture, values) {
  // Bins are made anew: their cells lie near the others'.
  const may_be_near = picture.x.edges !== undefined;
  const cell = [picture.x, picture.y].map((side, i) => (may_be_near ? nearest(side.values, values[i]) : side.values.indexOf(values[i])));
  return cell.includes(-1) ? null : /** @type {[number, number]} */ (cell);
}

/** @param {View} view @param {number} point @param {string} text what is said beside it */
const link_of = (view, point, text) => [h("a", { class: "button", href: view.address_of(point) }, `Open point ${count(point)}`), h("span", { class: "weak" }, text)];

/** @param {View} view */
export function choice_of(view) {
  const spoken = h("p", { class: "reading", "aria-live": "polite" });
  const line = h("p", { class: "choice" });
  const { map } = view;
  /** The values of the cell that is chosen: another picture may have it in another place, or not at all. @type {[number, number] | null} */
  let place = null;

  return { spoken, line,
    /** @param {[number, number] | null} cell */
    speak(cell) {
      spoken.textContent = cell && view.picture ? sentence(view.picture, cell) : "Point at a cell, or move with the arrow keys.";
    },
    /** @param {[number, number]} cell @param {number | null} [which] of several points of a cell */
    choose(cell, which = null) {
      this.speak(cell);
      place = view.picture && !view.picture.dots ? [view.picture.x.values[cell[0]], view.picture.y.values[cell[1]]] : null;
      const point = which ?? view.picture?.point(...cell) ?? null;
      line.replaceChildren();
      if (point === null) return;
      line.replaceChildren(...link_of(view, point, " or press Enter, or click twice"));
      view.table.choose(point);
      view.set({ cell: String(point) });
    },
    /** @param {[number, number]} cell */
    open(cell) {
      const point = (map.chosen_point !== null && String(cell) === String(map.chosen) ? map.chosen_point : view.picture?.point(...cell)) ?? null;
      if (point !== null) view.place.go(view.address_of(point));
    },
    /** Marks a point of the study where the picture has it. @param {number} point */
    choose_point(point) {
      view.table.choose(point);
      const cell = cell_of(view, point);
      map.choose(cell, view.picture?.dots ? point : null);
      if (cell) {
        this.choose(cell, point);
      } else {
        place = null;
        line.replaceChildren(...link_of(view, point, view.has_map ? " (this picture does not show it)" : ""));
        view.set({ cell: String(point) });
      }
    },
    /** After another picture has come. */
    again() {
      const { picture } = view;
      if (!view.has_map || !picture) {
        line.replaceChildren();
        return;
      }
      const cell = place && !picture.dots ? cell_at(view, picture, place) : null;
      if (cell) {
        map.choose(cell);
        this.choose(cell);
      } else if (view.is("cell")) {
        const was = place;
        this.choose_point(Number(view.is("cell")));
        place ??= was;  // a finer one may show it again
      } else if (place) {
        line.replaceChildren();
        this.speak(null);
      }
    },
    none() {
      place = null;
      map.choose(null);
      line.replaceChildren();
      this.speak(null);
    } };
}
