// @ts-check
// What the study lacks is solved while somebody looks: offered, shown as it becomes finer, kept.
import { h } from "/parts/dom.js";
import { finer, keep } from "./asked/look.js";

/** @param {import("./study.js").StudyView} view */
export function solving_panel(view) {
  const element = h("div", { class: "row solving" });
  /** @type {AbortController | null} */
  let stop = null;
  let id = 0;

  function end() {
    stop?.abort();
    stop = null;
    id = 0;
  }
  function offer() {
    const is_writing = document.activeElement instanceof HTMLInputElement && element.contains(document.activeElement);
    if (is_writing && stop) return;
    element.replaceChildren();
    if (!view.place.may_change || view.is("pic") !== "map") return;
    if (!stop) {
      element.append(h("button", { type: "button", class: "finer", onclick: () => solve(null) }, "Solve what lies between"));
      return;
    }
    const name = h("input", { type: "text", placeholder: "name", "aria-label": "Name under which it is kept", size: 12 });
    element.append(h("button", { type: "button", onclick: () => view.load() }, "Back to the study"), ...(id ? [name,
      h("button", { type: "button", onclick: async () => {
        try {
          const kept = await keep(id, name.value.trim());
          view.say(["Kept as ", h("a", { href: `#/study/${kept.id}` }, kept.name)]);
        } catch (error) {
          view.complain(error);
        }
      } }, "Keep it as a study")] : []));
  }
  /** Solves the picture finer than the study has it, or a part of it. @param {import("./drawn/brush.js").Rectangle | null} part */
  async function solve(part) {
    const { picture } = view;
    if (!picture) return;
    view.stop_asking();
    end();
    const mine = stop = new AbortController();
    const ends = (/** @type {import("./asked/picture.js").Side} */ side, /** @type {0 | 1} */ i, /** @type {string} */ log) => {
      const values = part ? [side.values[part.from[i]], side.values[part.to[i]]] : [...side.values];
      return { from: Math.min(...values), to: Math.max(...values), is_log: view.is(log) !== "" && Math.min(...values) > 0 };
    };
    const ranges = { [picture.x.name]: ends(picture.x, 0, "xlog"), [picture.y.name]: ends(picture.y, 1, "ylog") };
    const held = Object.fromEntries(picture.head.at.map((/** @type {any} */ one) => [one.key, one.value]));
    view.choice.none();
    offer();
    try {
      const wanted = { study: view.study.id, block: view.block, z: view.is("z"), ranges, held, where: view.is("where") };
      for await (const step of finer(wanted, mine.signal, view.unit_of)) {
        if (mine.signal.aborted) return;
        id = step.id;
        view.root.dataset.side = String(step.is_whole ? step.side : 0);
        view.show(step.picture, "map");
      }
    } catch (error) {
      if (mine.signal.aborted) return;
      end();
      offer();
      view.complain(error);
    }
  }
  return { element, offer, solve, end,
    get is_on() {
      return stop !== null;
    },
    /** The study that has the points of the picture; 0: the one that is looked at. */
    get study() {
      return id;
    } };
}
