// @ts-check
// A file that the server makes.
import { h, save_file } from "/parts/dom.js";
import { file_at } from "/server.js";

/**
 * A link to it. Who presses it gets the file when it is there, or the server's sentence; a browser that follows the
 * link by itself would say no more than that the download failed.
 * @param {string} text @param {string} name of the file @param {string} path
 * @param {(sentence: string, is_bad?: boolean) => void} say
 * @returns {HTMLAnchorElement}
 */
export function file_link(text, name, path, say) {
  let is_asked = false;
  const link = h("a", { class: "button", download: name, href: path, onclick: async (/** @type {MouseEvent} */ event) => {
    if (event.ctrlKey || event.metaKey || event.shiftKey || event.altKey) return;
    event.preventDefault();
    if (is_asked) return;
    is_asked = true;
    say(`${text} is being made.`);
    try {
      const { file, is_cut } = await file_at(link.getAttribute("href"));
      save_file(name, file);
      say(is_cut ? "It is too large for the page and was cut off: oblique query gives all of it." : "");
    } catch (error) {
      say(String(/** @type {Error} */ (error).message), true);
    }
    is_asked = false;
  } }, text);
  return link;
}

/** Where links say what became of them. */
export function file_sayer() {
  const said = h("span", { role: "status", class: "weak" });
  return { said, say: (/** @type {string} */ sentence, is_bad = false) => {
    said.textContent = sentence;
    said.className = is_bad ? "bad" : "weak";
  } };
}
