// @ts-check
// What people take with them: the picture as files, the view as a link, and the commands that make both.
import { copied, h, keep_focus, save } from "/parts/dom.js";
import { file_link, file_sayer } from "/parts/file_link.js";
import { picture_fields, plot_command, query_command, run_command } from "./command.js";
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
  if (view.solving.is_on) {
    const { kept_as } = view.solving;
    const name = kept_as || `${view.study.name}-part`;
    const what = kept_as ? "These points are kept as a study."
      : `What is solved while one looks goes when nobody looks. The address of this view finds it again or solves it anew; or keep it as a study.${view.place.file && " The first command is for when oblique view has ended."}`;
    show_parts(view.commands, h("p", { class: "weak" }, what), files(view, name, view.solving.id),
      ...(view.solving.block ? [copied("the command that solves it", run_command(view, name)), copied("the command of the picture", plot_command(view, name))] : []));
    return;
  }
  const said = h("span", { role: "status", class: "weak" });
  show_parts(view.commands,
    h("p", {}, "The picture, as oblique plot draws it:"), files(view, view.study.name, view.study.id),
    copied("the command of the picture", plot_command(view)),
    h("p", {}, "The rows of the table:"), copied("the command of the rows", query_command(view)),
    h("p", { class: "weak" }, view.place.file ? "The address of this view is a link to it, as long as oblique view goes on."
      : "Add --db FILE or --server ADDRESS where the database is not oblique.db. The address of this view is a link to it."),
    h("div", { class: "row" }, h("button", { type: "button", onclick: async () => {
      try {
        await navigator.clipboard.writeText(location.href);
        said.textContent = "copied";
      } catch {
        said.textContent = "copy it from the address of this page";
      }
    } }, "Copy the link"), said));
}

/** @param {import("./study.js").StudyView} view */
const numbers = (view) => h("button", { type: "button", onclick: () => { if (view.picture) save("picture.csv", "text/csv", cells_csv(view.picture)); } }, "Numbers on screen as CSV");

/** The picture as files. @param {import("./study.js").StudyView} view @param {string} name @param {number} id of the study that has its points; 0: it is not made yet */
function files(view, name, id) {
  const { said, say } = file_sayer();
  const file = (/** @type {string} */ format) => file_link(format.toUpperCase(), `${name}.${format}`, picture_path(view, id, format), say);
  return h("div", { class: "row files" }, ...(id ? [file("svg"), file("png"), file("csv")] : []), numbers(view), said);
}

/** @param {import("./study.js").StudyView} view @param {number} id @param {string} format */
function picture_path(view, id, format) {
  const fields = Object.entries({ ...picture_fields(view), format }).filter(([, value]) => value !== "");
  return `/api/studies/${id}/picture?${new URLSearchParams(fields)}`;
}
