// @ts-check
// What the study lacks is solved while somebody looks: offered, shown as it becomes finer, kept. The address says what it is of.
import { h } from "/parts/dom.js";
import { count } from "/parts/format.js";
import { Refusal } from "/server.js";
import { wanted_of } from "./asked/between.js";
import { finer, keep } from "./asked/look.js";
import { between_text, varying } from "./axes.js";
import { show_takeaways } from "./take.js";

const kSettled_ms = 100;

/** @param {import("./study.js").StudyView} view */
export function solving_panel(view) {
  /** @type {AbortController | null} */
  let stop = null;
  let id = 0;
  let side = 0;
  /** Of what the last picture was. */
  let shown = "";
  /** What is solved, as a recipe has it. @type {any} */
  let block = null;
  /** What was kept last. */
  let kept = "";
  const now = () => `${shown} ${side}`;

  const begin = h("button", { type: "button", class: "finer", hidden: true, onclick: () => solve(null) }, "Solve what lies between");
  const back = h("button", { type: "button", hidden: true, onclick: () => {
    view.set({ between: "" }, true);
    view.load();
  } }, "Back to the study");
  const name = h("input", { type: "text", placeholder: "name", "aria-label": "Name under which it is kept", size: 12, hidden: true,
    onkeydown: (/** @type {KeyboardEvent} */ event) => { if (event.key === "Enter") keep_it(); } });
  const button = h("button", { type: "button", class: "keep", hidden: true, onclick: () => keep_it() }, "Keep it as a study");
  const told = h("p", { role: "status", class: "said" });
  const element = h("div", {}, h("div", { class: "row solving" }, begin, back, name, button), told);

  async function keep_it() {
    const [of, what] = [id, now()];
    const points = view.picture ? view.picture.values.length - view.picture.head.left_out : 0;
    try {
      const made = await keep(of, name.value.trim());
      kept = what;
      name.value = "";
      told.className = "said";
      told.replaceChildren("Kept as ", h("a", { href: `#/study/${made.id}` }, made.name), `, ${count(points)} points.`);
      if (button.contains(document.activeElement) || name.contains(document.activeElement)) told.querySelector("a")?.focus();
      offer();
      show_takeaways(view);
    } catch (error) {
      told.className = "said bad";
      told.textContent = String(/** @type {Error} */ (error).message);
    }
  }
  function end() {
    stop?.abort();
    stop = block = null;
    id = side = 0;
    shown = "";
  }
  function offer() {
    const may = view.place.may_change && view.is("pic") === "map";
    begin.hidden = !may || stop !== null;
    back.hidden = stop === null;
    name.hidden = button.hidden = !id || kept === now();
    button.textContent = `Keep these ${side} × ${side} cells as a study`;
    if (!stop) told.replaceChildren();
  }
  /** Solves the picture finer than the study has it, or a part of it. @param {import("./drawn/brush.js").Rectangle | null} part */
  function solve(part) {
    const { picture } = view;
    if (!picture) return;
    const ends = (/** @type {import("./asked/picture.js").Side} */ side_, /** @type {0 | 1} */ i, /** @type {string} */ log) => {
      const values = part ? [side_.values[part.from[i]], side_.values[part.to[i]]] : [...side_.values];
      return { from: Math.min(...values), to: Math.max(...values), is_log: view.is(log) !== "" && Math.min(...values) > 0 };
    };
    view.set({ between: between_text({ [picture.x.name]: ends(picture.x, 0, "xlog"), [picture.y.name]: ends(picture.y, 1, "ylog") }), cell: "" }, true);
    view.choice.none();
    view.load();
  }
  /** Solves what the address says; another output is drawn from the same points. */
  async function go_on() {
    const was_on = stop !== null;
    view.stop_asking();
    stop?.abort();
    const mine = stop = new AbortController();
    const { signal } = mine;
    offer();
    try {
      if (!view.place.may_change) throw new Refusal(403, "What lies between is solved for those who may change studies.");
      const wanted = await wanted_of(view.study, view.fields, signal);
      const what = JSON.stringify([view.is("block"), wanted.ranges, wanted.held]);
      if (what !== shown) {
        // A slider that is dragged has many places.
        if (was_on) await new Promise((go) => setTimeout(go, kSettled_ms));
        if (signal.aborted) return;
        shown = what;
        side = id = 0;
        offer();
      }
      for await (const step of finer(wanted, side, signal, view.unit_of)) {
        if (signal.aborted) return;
        ({ id, side, block } = step);
        step.picture.held = varying(view.block).filter((axis) => axis.key in wanted.held).map((axis) => ({ key: axis.key, value: wanted.held[axis.key] }));
        view.root.dataset.side = String(step.is_whole ? step.side : 0);
        view.show(step.picture, "map");
      }
    } catch (error) {
      if (signal.aborted) return;
      end();
      offer();
      if (/** @type {any} */ (error).status) view.set({ between: "" });
      if (/** @type {any} */ (error).status) await view.load();
      view.complain(error);
    }
  }
  return { element, offer, solve, go_on, end,
    get is_on() {
      return stop !== null;
    },
    /** Cells a side of the picture. */
    get side() {
      return side;
    },
    /** Whether what is shown was kept. */
    get is_kept() {
      return kept === now();
    },
    get block() {
      return block;
    } };
}
