// @ts-check
// What was solved while somebody looked is kept as a study, under a name.
import { h } from "/parts/dom.js";
import { count } from "/parts/format.js";
import { keep } from "../asked/look.js";
import { show_takeaways } from "../take.js";

/** @param {import("../study.js").StudyView} view @param {() => {id: number, side: number, is_of: string}} now what is shown: its number, 0: nothing, and of what it is */
export function keeping(view, now) {
  /** What was kept last, and its name. */
  let kept = "";
  let kept_as = "";
  const name = h("input", { type: "text", placeholder: "name", "aria-label": "Name under which it is kept", size: 12, hidden: true,
    onkeydown: (/** @type {KeyboardEvent} */ event) => { if (event.key === "Enter") keep_it(); } });
  const button = h("button", { type: "button", class: "keep", hidden: true, onclick: () => keep_it() }, "Keep it as a study");
  const told = h("p", { role: "status", class: "said" });

  async function keep_it() {
    const { id, is_of } = now();
    const points = view.picture ? view.picture.values.length - view.picture.head.left_out : 0;
    try {
      const made = await keep(id, name.value.trim());
      [kept, kept_as] = [is_of, made.name];
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
  function offer() {
    const { id, side, is_of } = now();
    name.hidden = button.hidden = !id || kept === is_of;
    button.textContent = `Keep these ${side} × ${side} cells as a study`;
  }
  return { name, button, told, offer,
    /** The name under which what is shown was kept; empty: it was not. */
    get kept_as() {
      return kept === now().is_of ? kept_as : "";
    } };
}
