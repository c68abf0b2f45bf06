// @ts-check
// Conditions that change, and what is marked: by a rectangle over a picture or in words, the same points in all of them.
import { ask_marks } from "./asked/question.js";
import { column_of, joined, part_of, rounded, within } from "./conditions.js";
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
      const found = condition && !view.solving.is_on ? await ask_marks(view, picture, condition, signal) : null;
      if (signal.aborted || picture !== view.picture) return;
      marks = found;
      view.drawing.mark();
      view.root.dataset.marks = condition;
    } catch (error) {
      if (!signal.aborted) view.complain(error);
    } finally {
      if (!view.asked) view.waited();
    }
  }
  /** @param {string} condition */
  function mark(condition) {
    if (condition !== view.is("mark")) change("mark", condition);
  }
  /** A picture shows some of the other axes' values: what is marked is what is seen. @param {import("./asked/picture.js").Picture} picture @param {...string} parts */
  function mark_seen(picture, ...parts) {
    const held = (picture.head.at ?? []).filter((/** @type {any} */ one) => one.of > 1).map((/** @type {any} */ one) => `${column_of(one.key)} = ${one.value}`);
    const { first_point, points } = view.study.blocks[picture.head.block] ?? {};
    const of_block = points && view.study.blocks.length > 1 ? [`point >= ${first_point}`, `point < ${first_point + points}`] : [];
    mark(joined(...parts, ...held, ...of_block) || `${column_of(picture.x.name)} IS NOT NULL`);
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
      mark_seen(picture, part_of(picture.x, [part.from[0], part.to[0]], part.x), part_of(picture.y, [part.from[1], part.to[1]], part.y));
    },
    /** @param {import("/parts/lines.js").Part | null} part of lines: a span of the axis, and of the output where it does not go from below to above */
    mark_lines(part) {
      const { picture } = view;
      if (!picture) return;
      const { values } = picture.x;
      const inside = [...values.keys()].filter((i) => part && values[i] >= part.x[0] && values[i] <= part.x[1]).sort((a, b) => values[a] - values[b]);
      if (!part || inside.length === 0) {
        mark("");
        return;
      }
      const { y, z } = picture;
      const wide = (picture.most ?? 1) - (picture.least ?? 0);
      mark_seen(picture, part_of(picture.x, [inside[0], inside[inside.length - 1]], []),
        y.is_whole ? "" : `${column_of(y.name)} IN (${Array.from(y.values).join(", ")})`,
        part.y ? within(z.name, rounded(part.y[0], wide), rounded(part.y[1], wide)) : "");
    },
    /** What is marked becomes the condition. */
    keep() {
      const where = joined(view.is("where"), view.is("mark"));
      view.set({ mark: "" });
      change("where", where);
    },
    stop: () => asked?.abort() };
}
