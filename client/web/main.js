// @ts-check
// The first view: how the server stands, live.
import { session, follow } from "/server.js";
import { overview } from "/overview.js";

const view = /** @type {HTMLElement} */ (document.getElementById("view"));
const pace = /** @type {HTMLElement} */ (document.getElementById("pace"));

/** @param {string} text */
function say(text) {
  const p = document.createElement("p");
  p.textContent = text;
  view.replaceChildren(p);
}

try {
  const here = await session();
  if (here.may_look) {
    follow((now) => overview(view, pace, now), (text) => { pace.textContent = text; });
  } else {
    say(here.how_to_enter);
  }
} catch (error) {
  say(String(error));
}
