// @ts-check
// Studies and workers, live.
import { copied, h } from "/parts/dom.js";
import { count, of_file, time_left } from "/parts/format.js";
import { change, json } from "/server.js";

/** How many studies are listed at once. */
const kAtOnce = 200;
const kMostAtOnce = 1000;
/** After no answer, and of studies that events do not tell of. */
const kAskAgain_ms = 3000;

/** The condition that points meet which failed. */
export const kFailed = "error IS NOT NULL";

/** What may be asked of a study in a state. @type {Record<string, string[]>} */
const kChanges = { running: ["pause", "cancel"], paused: ["resume", "cancel"], cancelled: ["resume"], done: [] };

/**
 * Buttons for what may be done with a study.
 * @param {any} study @param {(sentence: string, is_bad?: boolean) => void} say
 */
export function study_buttons(study, say) {
  const wanted = [...(kChanges[study.state] ?? []), ...(study.failed > 0 ? ["retry"] : [])];
  return h("span", { class: "buttons" }, ...wanted.map((what) => h("button", { type: "button",
    "aria-label": `${what} ${study.name}`, "data-change": what, onclick: async () => {
      if (what === "cancel" && !confirm(`Cancel ${study.name}? What is solved stays.`)) return;
      try {
        const { study: after, retried } = await change(`/api/studies/${study.id}/${what}`);
        say(`${after.name}: ${what === "retry" ? `${count(retried)} points are tried again` : `now ${after.state}`}`);
      } catch (error) {
        say(String(/** @type {Error} */ (error).message), true);
      }
    } }, what)));
}

/** A table whose rows are kept by key, so that what has the focus keeps it. @param {string} caption @param {string[]} heads */
function live_table(caption, heads) {
  const body = h("tbody");
  const table = h("table", {}, h("caption", { class: "unseen" }, caption),
    h("thead", {}, h("tr", {}, ...heads.map((head) => h("th", { scope: "col", class: head.startsWith("#") ? "number" : "" }, head.replace("#", ""))))), body);
  /** @type {Map<number, {told: string, row: HTMLTableRowElement}>} */
  const kept = new Map();
  /** Changes the cells that say something else, so that a button stays under the finger that presses it. @param {HTMLTableRowElement} row @param {any[]} contents */
  const update = (row, contents) => contents.forEach((content, i) => {
    const made = h(i === 0 ? "th" : "td", { class: heads[i].startsWith("#") ? "number" : "", scope: i === 0 ? "row" : undefined }, content);
    const old = row.cells[i];
    if (!old) {
      row.append(made);
    } else if (old.outerHTML !== made.outerHTML) {
      const had_focus = old.contains(document.activeElement);
      old.replaceWith(made);
      if (had_focus) made.querySelector("a, button")?.focus();
    }
  });
  return {
    element: h("div", { class: "scroll live", tabIndex: 0, role: "region", "aria-label": caption }, table),
    /** @param {any[]} lines @param {(line: any) => any[]} cells */
    show(lines, cells) {
      const rows = lines.map((line) => {
        const told = JSON.stringify(line);
        let known = kept.get(line.id);
        if (!known) kept.set(line.id, known = { told: "", row: h("tr") });
        if (known.told !== told) update(known.row, cells(line));
        known.told = told;
        return known.row;
      });
      if (rows.length !== body.rows.length || rows.some((row, i) => row !== body.rows[i])) {
        const focused = /** @type {HTMLElement | null} */ (document.activeElement);
        body.replaceChildren(...rows);
        if (focused && body.contains(focused)) focused.focus();
      }
      const there = new Set(lines.map((line) => line.id));
      for (const id of kept.keys()) if (!there.has(id)) kept.delete(id);
    },
  };
}

/** Points that are solved, failed or left out by a filter. @param {any} study */
export const completed = (study) => study.solved + study.failed + study.left_out;

/** @param {any} study */
export function progress_of(study) {
  const settled = completed(study);
  const share = study.points > 0 ? settled / study.points : 1;
  const percent = share >= 1 ? "100 %" : `${(Math.floor(share * 1000) / 10).toFixed(1)} %`;
  return h("span", { class: "share" }, h("progress", { max: Math.max(study.points, 1), value: settled,
    "aria-label": `${study.name}: settled points` }), percent);
}

/** Running ones first, then the latest. @param {any[]} studies @param {string} name what names have in them */
function in_order(studies, name) {
  const rank = (/** @type {any} */ s) => (s.state === "running" ? 0 : s.state === "paused" ? 1 : 2);
  return studies.filter((s) => s.name.toLowerCase().includes(name.toLowerCase())).sort((a, b) => rank(a) - rank(b) || b.id - a.id);
}

/** The server as a whole. @param {any} now */
function figures(now) {
  const all = [["points/s", count(now.points_per_s)], ["points open", count(now.points_open)],
    ["at workers", count(now.points_leased)], ["workers", count(now.workers_there)], ["threads", count(now.threads)],
    ...Object.entries(now.studies_by_state).map(([state, n]) => [`studies ${state}`, count(Number(n))])];
  return all.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value)));
}

function workers_section() {
  const table = live_table("Workers", ["worker", "state", "#threads", "#points/s", "#solved", "#losses", "solver"]);
  const none = h("p", { class: "weak" }, "No worker is here: start oblique-worker.");
  const unlisted = h("p", { class: "weak" });
  return { element: h("section", {}, h("h2", {}, "Workers"), table.element, none, unlisted),
    /** @param {any} now the overview, or null */
    draw(now) {
      const there = now?.workers ?? [];
      table.element.hidden = there.length === 0;
      none.hidden = there.length > 0 || !now;
      table.show(there, (w) => [w.name, w.silent_s > 0 ? `${w.state}, silent for ${w.silent_s} s` : w.state, String(w.threads),
        count(w.points_per_s), count(w.solved_points), String(w.losses),
        h("span", { class: "weak" }, `${w.solver_version}, ${w.instruction_set}`)]);
      const hidden = (now?.workers_there ?? 0) - there.length;
      unlisted.textContent = hidden > 0 ? `${count(hidden)} more workers are not shown: oblique workers lists all.` : "";
    } };
}

/** A row of the table of studies. @param {any} study @param {any[]} changes what may be done with it */
function cells_of(study, changes) {
  const is_running = study.state === "running";
  return [h("a", { href: `#/study/${study.id}` }, study.name), study.state, progress_of(study), count(study.points),
    study.failed > 0 ? h("a", { class: "bad", href: `#/study/${study.id}?where=${encodeURIComponent(kFailed)}`, title: "which, and why" }, count(study.failed)) : "0",
    study.points_per_s > 0 ? count(study.points_per_s) : "",
    is_running ? time_left(study.left_s) : "", h("span", { class: "weak" }, is_running ? study.waits_for : ""), ...changes];
}

/** Why no study is shown. @param {number} read how many studies were @param {boolean} has_more */
const none_text = (read, has_more) => (read === 0 ? "There is no study yet." : has_more ? `Of the ${count(read)} studies that were read none is called so.` : "No study is called so.");

/** @param {number} unlisted studies of which events do not tell */
const unlisted_text = (unlisted) => (unlisted > 0
  ? `${count(unlisted)} more ${unlisted === 1 ? "study runs or is" : "studies run or are"} paused than are followed live; numbers of those come every ${kAskAgain_ms / 1000} s.` : "");

/** The commands that say the same. @param {string} file that they are to read; empty: they ask the server */
const commands_section = (file) => h("section", {}, h("h2", {}, "The same on a command line"), copied("the command of the studies", `oblique studies${of_file(file)}`),
  ...(file ? [] : [copied("the command of the workers", "oblique workers")]),
  h("p", { class: "weak" }, file ? "Add --format csv for a table in a file." : "Add --server ADDRESS where the server is elsewhere, and --format csv for a file."));

/** The first so many studies. @param {number} wanted @returns {Promise<{found: Map<number, any>, next_after: number}>} next_after 0: these are all */
async function first_studies(wanted) {
  const found = new Map();
  let next_after = 0;
  do {
    const page = await json(`/api/studies?limit=${Math.min(wanted - found.size, kMostAtOnce)}&after=${next_after}`);
    for (const study of page.studies) found.set(study.id, study);
    next_after = page.next_after;
  } while (next_after !== 0 && found.size < wanted);
  return { found, next_after };
}

/** Studies: as many as somebody wants to see, and those that events tell of. One reading ends before the next begins, so that no older answer replaces a newer one. */
class StudyList {
  /** @param {() => void} changed @param {(error: any) => void} failed it did not come */
  constructor(changed, failed) {
    this.changed = changed;
    this.failed = failed;
    /** @type {Map<number, any>} */
    this.known = new Map();
    /** Those of the last event. @type {any[]} */
    this.told = [];
    this.was_read = false;
    this.has_more = false;
    this.wanted = kAtOnce;
    this.is_reading = false;
    this.wants_another = false;
  }

  /** @param {any[]} studies of an event */
  take(studies) {
    this.told = studies;
    for (const study of studies) this.known.set(study.id, study);
  }

  more() {
    this.wanted += kAtOnce;
    return this.read();
  }

  /** Reads again, as far as was read before. */
  async read() {
    this.wants_another = true;
    if (this.is_reading) return;
    this.is_reading = true;
    try {
      while (this.wants_another) {
        this.wants_another = false;
        await this.#read_once();
        this.changed();
      }
    } catch (error) {
      this.failed(error);
    }
    this.is_reading = false;
  }

  async #read_once() {
    const { found, next_after } = await first_studies(this.wanted);
    // What an event told of stays when it has ended, though it lies beyond.
    const beyond = next_after === 0 ? [] : [...this.known.keys()].filter((id) => id > next_after);
    if (beyond.length > 0) {
      const page = await json(`/api/studies?limit=${kMostAtOnce}&after=${Math.min(...beyond) - 1}`);
      for (const study of page.studies) if (this.known.has(study.id)) found.set(study.id, study);
    }
    this.was_read = true;
    this.has_more = next_after !== 0;
    this.known = found;
    this.take(this.told);
  }
}

/**
 * @param {import("/main.js").Place} place @param {StudyList} list @param {(text: string, is_bad?: boolean) => void} say
 * @param {() => void} filtered another part of their names is wanted
 */
function studies_section(place, list, say, filtered) {
  const table = live_table("Studies", ["study", "state", "progress", "#points", "#failed", "#points/s", "#left", "waits for", ...(place.may_change ? ["change"] : [])]);
  const none = h("p", { class: "weak" }, none_text(0, false));
  const unlisted = h("p", { class: "weak" });
  const filter = h("input", { type: "search", value: place.fields.get("name") ?? "", "aria-label": "Studies whose name has", placeholder: "name has …", oninput: () => {
    place.keep(new URLSearchParams(filter.value ? { name: filter.value } : {}));
    filtered();
  } });
  const more = h("button", { type: "button", hidden: true, onclick: () => list.more() }, "More studies");
  const start = place.may_change && h("a", { class: "button", href: "#/new" }, "Start a study");
  return { element: h("section", {}, h("div", { class: "head" }, h("h2", {}, "Studies"), filter, start), table.element, none, unlisted, more),
    /** @param {any} now the overview, or null */
    draw(now) {
      const known = [...list.known.values()];
      const lines = in_order(known, filter.value);
      table.element.hidden = lines.length === 0;
      none.hidden = lines.length > 0 || !list.was_read;
      none.textContent = none_text(known.length, list.has_more);
      table.show(lines, (one) => cells_of(one, place.may_change ? [study_buttons(one, say)] : []));
      more.hidden = !list.has_more;
      unlisted.textContent = unlisted_text(now?.unlisted ?? 0);
    },
    /** @param {URLSearchParams} fields */
    go_to(fields) {
      filter.value = fields.get("name") ?? "";
    } };
}

/**
 * @param {HTMLElement} root @param {import("/main.js").Place} place
 * @returns {import("/main.js").View}
 */
export function overview(root, place) {
  const said = h("p", { role: "status", class: "said" });
  const say = (/** @type {string} */ text, is_bad = false) => {
    said.textContent = text;
    said.className = is_bad ? "said bad" : "said";
  };
  let now = place.now();
  let states = "";
  let later = 0;
  let is_closed = false;
  /** Why studies did not come. */
  let fault = "";
  const list = new StudyList(() => {
    if (fault && said.textContent === fault) say("");
    fault = "";
    draw();
    read_later();
  }, (error) => {
    say(fault = String(error.message), true);
    read_later();
  });
  const numbers = h("dl", { class: "figures" });
  const studies = studies_section(place, list, say, draw);
  const workers = workers_section();
  root.append(numbers, said, studies.element, workers.element, commands_section(place.file));

  /** What events do not tell of is asked for, and what did not come is asked for again. */
  function read_later() {
    if (is_closed || later || !(fault || now?.unlisted > 0)) return;
    later = setTimeout(() => {
      later = 0;
      if (document.hidden) read_later();
      else list.read();
    }, kAskAgain_ms);
  }
  function draw() {
    studies.draw(now);
    workers.draw(now);
    if (now) numbers.replaceChildren(...figures(now));
  }

  list.read();
  return {
    take(told) {
      now = told;
      if (told.is_stopping) say("The server is stopping.");
      list.take(told.studies);
      const seen = JSON.stringify(told.studies_by_state);
      if (seen !== states) list.read();
      states = seen;
      read_later();
      draw();
    },
    go_to(fields) {
      studies.go_to(fields);
      draw();
    },
    again: () => list.read(),
    close() {
      is_closed = true;
      clearTimeout(later);
    },
  };
}
