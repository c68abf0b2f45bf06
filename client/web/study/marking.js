// @ts-check
// Conditions that change, and what is marked: by a rectangle over a picture or in words, the same points in all of them.
import { ask_marks } from "./pictures.js";
import { column_of, joined, part_of, rounded, within } from "./conditions.js";
import { show_takeaways } from "./take.js";

/** @typedef {import("./pictures.js").Picture} Picture */

/** A picture shows some of the other axes' values: what is marked is what is seen. @param {any[]} blocks of the study @param {Picture} picture @param {string[]} parts of it */
function condition_of(blocks, picture, parts) {
  const held = (picture.head.at ?? []).filter((/** @type {any} */ one) => one.of > 1).map((/** @type {any} */ one) => `${column_of(one.key)} = ${one.value}`);
  const { first_point, points } = blocks[picture.head.block] ?? {};
  const of_block = points && blocks.length > 1 ? [`point >= ${first_point}`, `point < ${first_point + points}`] : [];
  return joined(...parts, ...held, ...of_block) || `${column_of(picture.x.name)} IS NOT NULL`;
}

/** What is seen in a rectangle over a map. @param {Picture} picture @param {import("./drawn/map.js").Rectangle} part */
const parts_of_map = ({ x, y }, { from, to, x: across, y: upwards }) => [part_of(x, [from[0], to[0]], across), part_of(y, [from[1], to[1]], upwards)];

/** What is seen of lines in a span of the axis, and of the output where it does not go from below to above; null: no value. @param {Picture} picture @param {import("/parts/lines.js").Part} part */
function parts_of_lines(picture, part) {
  const { x, y, z } = picture;
  const inside = [...x.values.keys()].filter((i) => x.values[i] >= part.x[0] && x.values[i] <= part.x[1]).sort((a, b) => x.values[a] - x.values[b]);
  if (inside.length === 0) return null;
  const wide = (picture.most ?? 1) - (picture.least ?? 0);
  return [part_of(x, [inside[0], inside[inside.length - 1]], []), y.is_whole ? "" : `${column_of(y.name)} IN (${Array.from(y.values).join(", ")})`,
    part.y ? within(z.name, rounded(part.y[0], wide), rounded(part.y[1], wide)) : ""];
}

/** @param {import("./study.js").StudyView} view */
export function marking_of(view) {
  /** @type {AbortController | null} */
  let asked = null;
  /** @type {import("./pictures.js").Marks | null} */
  let marks = null;

  /** A step that people go back over. @param {Record<string, string>} conditions where and mark @param {boolean} [is_further] the rectangle of the last step grows */
  function change(conditions, is_further = false) {
    view.set(conditions, !is_further);
    view.say("");
    view.conditions.tell();
    view.table.begin();
    if ("where" in conditions) {
      view.load();
    } else {
      load();
      show_takeaways(view);
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
      const found = condition ? await ask_marks(view, picture, condition, signal) : null;
      if (signal.aborted || picture !== view.picture) return;
      marks = found;
      view.drawing.mark();
      view.root.dataset.marks = condition;
    } catch (error) {
      if (!signal.aborted) view.complain(error);
    }
  }
  /** @param {string} condition @param {boolean} [is_further] */
  function mark(condition, is_further = false) {
    if (condition !== view.is("mark")) change({ mark: condition }, is_further);
  }
  /** @param {string[] | null} parts of the picture; null: nothing @param {boolean} is_further */
  function mark_seen(parts, is_further) {
    if (parts && view.picture) mark(condition_of(view.study.blocks, view.picture, parts), is_further);
    else mark("");
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
    /** @param {import("./drawn/map.js").Rectangle | null} part of the map; null: nothing @param {boolean} [is_further] keys go on with it */
    mark_part(part, is_further = false) {
      mark_seen(part && view.picture && parts_of_map(view.picture, part), is_further);
    },
    /** @param {import("/parts/lines.js").Part | null} part of lines; null: nothing @param {boolean} [is_further] keys go on with it */
    mark_lines(part, is_further = false) {
      if (view.picture) mark_seen(part && parts_of_lines(view.picture, part), is_further);
    },
    /** What is marked becomes the condition. */
    keep() {
      change({ where: joined(view.is("where"), view.is("mark")), mark: "" });
    },
    stop: () => asked?.abort() };
}
