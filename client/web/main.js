// Shows the view that the address of the page names. A view is a function that fills an element and
// returns its handlers: `take` receives the server's overview, `goTo` another address with the same
// path; `reconnected` and `close` are optional.
import { follow, retryMs, session } from "./api.js";
import { h } from "./lib/dom.js";
import { newStudyView } from "./newStudy.js";
import { overview } from "./overview.js";
import { pointView } from "./point/point.js";
import { studyView } from "./study/study.js";

const routes = [
  [/^\/study\/(\d+)\/point\/(\d+)$/, pointView],
  [/^\/study\/(\d+)$/, studyView],
  [/^\/new$/, newStudyView],
  [/^/, overview],
];

const main = document.getElementById("view");
const pace = document.getElementById("pace");
const trail = document.getElementById("trail");

let path = "";
let shown = {};
let now = null;
let rights = {};
let turn = 0;
let leaving = new AbortController();
/** The latest address of each view. */
const addresses = new Map();

/**
 * Minimum time between changes of the address, because browsers refuse more than a few hundred
 * changes in ten seconds.
 */
const writeEveryMs = 150;
let unwritten = "";
let timer = 0;
const pathOf = (address) => address.replace(/^#/, "").split("?", 1)[0] || "/";

function writeAddress() {
  const isShown = pathOf(unwritten) === pathOf(location.hash);
  if (unwritten && isShown) history.replaceState(null, "", unwritten);
  unwritten = "";
}

function writeSoon() {
  if (timer) return;
  writeAddress();
  timer = setTimeout(() => {
    timer = 0;
    if (unwritten) writeSoon();
  }, writeEveryMs);
}

/**
 * Writes the state of a view into its address. With `isStep`, the browser's Back undoes the change.
 */
function keep(of, fields, isStep) {
  const address = `#${of}${String(fields) && `?${fields}`}`;
  addresses.set(of, address);
  if (isStep) {
    writeAddress();
    if (address !== location.hash) history.pushState(null, "", address);
  } else {
    unwritten = address;
    writeSoon();
  }
}

function showTrail(parts) {
  const separated = parts.flatMap((part) => [h("span", { "aria-hidden": "true" }, "/"), part]);
  trail.replaceChildren(...separated);
  const last = parts.at(-1);
  document.title = last ? `${last.textContent ?? last} – oblique` : "oblique";
}

/** Returns functions and data that a view may use while it is shown. */
function placeOf(mine, own, fields, signal) {
  const whileShown =
    (act) =>
    (...given) =>
      mine === turn && act(...given);
  return {
    fields,
    signal,
    mayChange: rights.may_change,
    file: rights.file,
    now: () => now,
    trail: whileShown(showTrail),
    keep: whileShown((all, isStep = false) => keep(own, all, isStep)),
    last: (of) => addresses.get(of) ?? `#${of}`,
    go: (address) => {
      writeAddress();
      location.hash = address;
    },
  };
}

async function show() {
  unwritten = "";
  const fields = new URLSearchParams(location.hash.split("?", 2)[1] ?? "");
  const isSame = pathOf(location.hash) === path;
  path = pathOf(location.hash);
  addresses.set(path, location.hash);
  if (isSame && shown.goTo) {
    shown.goTo(fields);
    return;
  }
  const mine = ++turn;
  leaving.abort();
  leaving = new AbortController();
  shown.close?.();
  shown = {};
  const root = h("div");
  showTrail([]);
  main.replaceChildren(root);
  const [pattern, view] = routes.find(([one]) => one.test(path));
  const ids = pattern.exec(path).slice(1).map(Number);
  try {
    const made = await view(root, placeOf(mine, path, fields, leaving.signal), ...ids);
    if (mine !== turn) {
      made.close?.();
      return;
    }
    shown = made;
    if (mine > 1 && [document.body, null].includes(document.activeElement)) {
      main.focus({ preventScroll: true });
    }
    if (now) shown.take?.(now);
  } catch (error) {
    if (mine !== turn) return;
    const retry = () => mine === turn && show();
    if (error.isSilence) setTimeout(retry, retryMs);
    root.replaceChildren(
      h("p", { role: "alert", class: "bad" }, error.message),
      h("p", h("a", { href: "#/" }, "All studies")),
    );
  }
}

function say(text, isBad) {
  pace.textContent = text;
  pace.className = isBad ? "bad" : "";
}

function take(update) {
  now = update;
  say(
    update.database_fault || `${Math.round(update.points_per_s)} points/s`,
    update.database_fault,
  );
  shown.take?.(update);
}

async function begin() {
  rights = await session();
  if (!rights.may_look) {
    main.replaceChildren(h("p", rights.how_to_enter));
    return;
  }
  follow({
    take,
    say: (text) => say(text, true),
    reconnected: () => {
      if (now) take(now);
      shown.reconnected?.();
    },
  });
  addEventListener("popstate", show);
  // Writes the address before a click is handled, because the click may follow or copy a link.
  document.addEventListener("click", writeAddress, { capture: true });
  // A change of the colour scheme requires redrawing all canvases.
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    writeAddress();
    if (!path.startsWith("/study/")) return;
    shown.close?.();
    shown = {};
    show();
  });
  await show();
}

begin().catch((error) => {
  main.replaceChildren(h("p", { role: "alert", class: "bad" }, error.message));
});
