// @ts-check
// Which view an address means. Views are functions: they fill an element and give what ends them.
import { h } from "/parts/dom.js";
import { session, follow, in_words, Silence } from "/server.js";
import { overview } from "/overview.js";

/**
 * @typedef {object} Place what an address says
 * @property {URLSearchParams} fields
 * @property {(fields: URLSearchParams, is_step?: boolean) => void} keep writes them into the address, soon; a step is one that people go back over
 * @property {(address: string) => void} go to another view, so that this one can be come back to
 * @property {boolean} may_change
 * @property {string} file that commands are to read; empty: they ask the server
 * @property {AbortSignal} signal this view is left, or did not come about
 * @property {() => any} now the last overview, or null
 * @property {(links: (string | Node)[]) => void} trail what stands beside the name
 * @property {(path: string) => string} last how that view was left
 * @typedef {{close?: () => void, take?: (now: any) => void, go_to?: (fields: URLSearchParams) => void, focus?: () => void, again?: () => void}} View
 *   `go_to` another address of the same path; `focus` for who came back; `again` after the server did not answer
 */

const view = /** @type {HTMLElement} */ (document.getElementById("view"));
const pace = /** @type {HTMLElement} */ (document.getElementById("pace"));
const trail = /** @type {HTMLElement} */ (document.getElementById("trail"));

/** @type {View} */
let shown = {};
/** @type {any} */
let now = null;
let turn = 0;
/** Ends what the view that is shown, or comes, still asks for. */
let leaving = new AbortController();
/** Of the view that is shown. */
let here = "";
let may_change = false;
let file = "";
/** How views were left. @type {Map<string, string>} */
const left = new Map();

/** Browsers refuse addresses that change more than some hundred times in ten seconds. */
const kWriteAgain_ms = 150;
/** After the server did not answer. */
const kAskAgain_ms = 3000;
/** The address that this view is to have; empty: it has it. */
let wanted = "";
let later = 0;
const path_of = (/** @type {string} */ address) => address.replace(/^#/, "").split("?", 1)[0] || "/";
const address_of = (/** @type {string} */ path, /** @type {URLSearchParams} */ fields) => `#${path}${String(fields) && `?${fields}`}`;

function write() {
  if (wanted === "" || path_of(wanted) !== path_of(location.hash)) return;
  try {
    history.replaceState(null, "", wanted);
    wanted = "";
  } catch { /* too often for this browser: a little later */ }
}
function write_soon() {
  if (later) return;
  write();
  later = setTimeout(() => {
    later = 0;
    if (wanted !== "") write_soon();
  }, kWriteAgain_ms);
}

/** The address that is left stays behind. @param {string} address */
function step_to(address) {
  write();
  if (address === location.hash) return;
  try {
    history.pushState(null, "", address);
  } catch { /* too often for this browser: it is written as others are */ }
}

function links(/** @type {(string | Node)[]} */ parts) {
  trail.replaceChildren(...parts.flatMap((part) => [h("span", { "aria-hidden": "true" }, "/"), part]));
  const last = parts.at(-1);
  document.title = last ? `${typeof last === "string" ? last : last.textContent} – oblique` : "oblique";
}

async function show() {
  const path = path_of(location.hash);
  const query = location.hash.split("?", 2)[1];
  if (path === here && shown.go_to) {
    wanted = "";
    left.set(path, location.hash);
    shown.go_to(new URLSearchParams(query ?? ""));
    return;
  }
  const is_first = turn === 0;
  here = path;
  const mine = ++turn;
  leaving.abort();
  leaving = new AbortController();
  const { signal } = leaving;
  shown.close?.();
  shown = {};
  wanted = "";
  const root = h("div", {});
  /** @type {Place} */
  const place = { fields: new URLSearchParams(query ?? ""), may_change, file, signal, now: () => now,
    // Answers may come when another view is shown.
    trail: (parts) => { if (mine === turn) links(parts); },
    last: (of) => left.get(of) ?? `#${of}`,
    keep: (fields, is_step = false) => {
      if (mine !== turn) return;
      if (is_step) step_to(address_of(path, fields));
      left.set(path, wanted = address_of(path, fields));
      write_soon();
    },
    go: (address) => {
      write();
      location.hash = address;
    } };
  left.set(path, location.hash);
  links([]);
  view.replaceChildren(root);
  try {
    const point = /^\/study\/(\d+)\/point\/(\d+)$/.exec(path);
    const study = /^\/study\/(\d+)$/.exec(path);
    /** @type {View} */
    let made;
    if (point) made = await (await import("/point/point.js")).point_view(root, place, Number(point[1]), Number(point[2]));
    else if (study) made = await (await import("/study/study.js")).study_view(root, place, Number(study[1]));
    else if (path === "/new") made = await (await import("/start.js")).start_view(root, place);
    else made = overview(root, place);
    if (mine !== turn) {
      made.close?.();
      return;
    }
    shown = made;
    if (!is_first && [document.body, view, null].includes(/** @type {any} */ (document.activeElement))) {
      view.focus({ preventScroll: true });
      made.focus?.();
    }
    if (now) shown.take?.(now);
  } catch (error) {
    if (mine !== turn) return;
    leaving.abort();
    const said = in_words(error);
    if (said instanceof Silence) setTimeout(() => { if (mine === turn) show(); }, kAskAgain_ms);
    root.replaceChildren(h("p", { role: "alert", class: "bad" }, String(said.message ?? said)),
      h("p", {}, h("a", { href: "#/" }, "All studies")));
  }
}

try {
  const told = await session();
  ({ may_change, file } = told);
  if (told.may_look) {
    const take = (/** @type {any} */ told) => {
      now = told;
      pace.textContent = told.database_fault || `${Math.round(told.points_per_s)} points/s`;
      pace.className = told.database_fault ? "bad" : "";
      shown.take?.(told);
    };
    follow(take, (text) => {
      pace.textContent = text;
      pace.className = "bad";
    }, () => {
      if (now) take(now);
      shown.again?.();
    });
    // At once: what the view that is left still writes would otherwise replace the address that people come back to.
    addEventListener("popstate", show);
    // Links, and what copies the address, find it written.
    document.addEventListener("click", write, { capture: true });
    // Drawings have the colours of when they were drawn; forms are left as people filled them.
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      write();
      if (location.hash.startsWith("#/study/")) show();
    });
    await show();
  } else {
    view.replaceChildren(h("p", {}, told.how_to_enter));
  }
} catch (error) {
  view.replaceChildren(h("p", { role: "alert", class: "bad" }, String(error)));
}
