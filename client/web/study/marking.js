// @ts-check
// Conditions that change, and what is marked: by a rectangle over a picture or in words, the same points in all of them.
import { ask_marks } from "./asked/question.js";
import { column_of, joined, part_of } from "./conditions.js";
import { show_takeaways } from "./take.js";

/** @param {import("./study.js").StudyView} view */
export function marking_of(view) {
  /** @type {AbortController | null} */
  let asked = null;
  /** @type {import("./asked/question.js").Marks | null} */
  let marks = null;

  /** @param {"where" | "mark"} name @param {string} condition */
  function change(name, condition) {
    view.set({ [name]: condition });
    view.say("");
    view.conditions.tell();
    view.table.begin();
    if (name === "mark") {
      load();
      show_takeaways(view);
    } else {
      view.load();
    }
  }
  /** Finds which cells and points of the picture are marked. */
  async function load() {
    asked?.abort();
    const { picture } = view;
    const condition = view.is("mark");
    if (!picture || (condition === "" && !marks)) return;
    const { signal } = asked = new AbortController();
    try {
      const found = condition && view.is("pic") !== "lines" && !view.solving.is_on ? await ask_marks(view, picture, condition, signal) : null;
      if (signal.aborted || picture !== view.picture) return;
      marks = found;
      view.drawing.mark();
      view.root.dataset.marks = condition;
    } catch (error) {
      if (!signal.aborted) view.complain(error);
    }
  }
  /** @param {string} condition */
  function mark(condition) {
    if (condition !== view.is("mark")) change("mark", condition);
  }
  return { change, load, mark,
    get marks() {
      return marks;
    },
    /** Another picture has come. */
    forget() {
      asked?.abort();
      marks = null;
    },
    /** @param {import("./drawn/brush.js").Rectangle | null} part of the map */
    mark_part(part) {
      const { picture } = view;
      if (!part || !picture) {
        mark("");
        return;
      }
      // A map shows some of the other axes' values: what is marked is what is seen.
      const held = (picture.head.at ?? []).filter((/** @type {any} */ one) => one.of > 1).map((/** @type {any} */ one) => `${column_of(one.key)} = ${one.value}`);
      const parts = [part_of(picture.x, [part.from[0], part.to[0]], part.x), part_of(picture.y, [part.from[1], part.to[1]], part.y), ...held];
      mark(joined(...parts) || `${column_of(picture.x.name)} IS NOT NULL`);
    },
    /** What is marked becomes the condition. */
    keep() {
      const where = joined(view.is("where"), view.is("mark"));
      view.set({ mark: "" });
      change("where", where);
    },
    stop: () => asked?.abort() };
}
