// @ts-check
// What people take with them: the picture as files, the view as a link, and the commands that make both.
import { copied, h, keep_focus, save, save_file } from "/parts/dom.js";
import { png_of } from "/parts/png.js";
import { plot_command, query_command } from "./command.js";
import { cells_csv } from "./words.js";

/** What was made for an element, before somebody copied of it. @type {WeakMap<HTMLElement, string>} */
const made_for = new WeakMap();

/**
 * Buttons stay under the finger that presses one while a study runs, and what they said, as long as they mean the same.
 * @param {HTMLElement} element @param {...HTMLElement} parts
 */
function show_parts(element, ...parts) {
  const made = parts.map((part) => part.outerHTML).join("");
  if (made_for.get(element) === made) return;
  made_for.set(element, made);
  keep_focus(element, () => element.replaceChildren(...parts));
}

/** @param {import("./study.js").StudyView} view */
export function show_takeaways(view) {
  if (!view.picture) return;
  show_parts(view.commands, h("p", {}, "The picture as it is shown:"), files(view),
    h("p", {}, "The same picture, as oblique plot draws it:"), copied("the command of the picture", plot_command(view)),
    h("p", {}, "The rows of the table:"), copied("the command of the rows", query_command(view)),
    h("p", { class: "weak" }, view.place.file ? "The address of this view is a link to it, as long as oblique view goes on."
      : "Add --db FILE or --server ADDRESS where the database is not oblique.db. The address of this view is a link to it."),
    link_row());
}

function link_row() {
  const said = h("span", { role: "status", class: "weak" });
  return h("div", { class: "row" }, h("button", { type: "button", onclick: async () => {
    try {
      await navigator.clipboard.writeText(location.href);
      said.textContent = "copied";
    } catch {
      said.textContent = "copy it from the address of this page";
    }
  } }, "Copy the link"), said);
}

/** What is shown, as files. @param {import("./study.js").StudyView} view */
function files(view) {
  const { name } = view.study;
  const png = async () => {
    const figure = view.drawing.figure();
    if (figure) save_file(`${name}.png`, await png_of([figure]));
  };
  return h("div", { class: "row files" },
    h("button", { type: "button", onclick: () => png().catch((error) => view.complain(error)) }, "PNG"),
    h("button", { type: "button", onclick: () => { if (view.picture) save(`${name}.csv`, "text/csv", cells_csv(view.picture)); } }, "CSV"));
}
