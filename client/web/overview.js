// @ts-check
// Studies and workers, live.
import { h, save } from "/parts/dom.js";
import { count, csv_line, time_left } from "/parts/format.js";
import { change, json } from "/server.js";

const kStudiesAtOnce = 200;

/** What somebody looks at and nobody keeps: see server/web/page. */
const is_look = (/** @type {any} */ study) => /^look-[0-9a-f]{16}$/.test(study.name);

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

/** @param {any} study */
export function progress_of(study) {
  const settled = study.solved + study.failed;
  const share = study.points > 0 ? settled / study.points : 1;
  const percent = share >= 1 ? "100 %" : `${(Math.floor(share * 1000) / 10).toFixed(1)} %`;
  return h("span", { class: "share" }, h("progress", { max: Math.max(study.points, 1), value: settled,
    "aria-label": `${study.name}: settled points` }), percent);
}

/** @param {any[]} studies */
function studies_csv(studies) {
  const columns = ["id", "name", "state", "points", "solved", "failed", "points_per_s", "priority", "created_at", "submitted_by"];
  return [columns, ...studies.map((study) => columns.map((name) => study[name]))].map(csv_line).join("\r\n") + "\r\n";
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
  const numbers = h("dl", { class: "figures" });
  const studies = live_table("Studies", ["study", "state", "progress", "#points", "#failed", "#points/s", "#left", "waits for", ...(place.may_change ? ["change"] : [])]);
  const workers = live_table("Workers", ["worker", "state", "#threads", "#points/s", "#solved", "#losses", "solver"]);
  const no_studies = h("p", { class: "weak" }, "There is no study yet.");
  const no_workers = h("p", { class: "weak" }, "No worker is here: start oblique-worker.");
  const unlisted = h("p", { class: "weak" });
  const filter = h("input", { type: "search", oninput: () => draw(), "aria-label": "Studies whose name has" , placeholder: "name has …" });
  const file = h("button", { type: "button", onclick: () => save("studies.csv", "text/csv", studies_csv([...known.values()].filter((s) => !is_look(s)))) }, "CSV");
  const more = h("button", { type: "button", hidden: true, onclick: () => read(next_after) }, "More studies");
  root.append(numbers, said,
    h("section", {}, h("div", { class: "head" }, h("h2", {}, "Studies"), filter, place.may_change && h("a", { class: "button", href: "#/new" }, "Start a study"), file), studies.element, no_studies, more),
    h("section", {}, h("h2", {}, "Workers"), workers.element, no_workers, unlisted));

  /** @type {Map<number, any>} */
  const known = new Map();
  let next_after = 0;
  let states = "";
  let now = place.now();

  async function read(after = 0) {
    try {
      const page = await json(`/api/studies?limit=${kStudiesAtOnce}&after=${after}`);
      if (after === 0) known.clear();
      for (const study of page.studies) known.set(study.id, study);
      next_after = page.next_after;
      more.hidden = next_after === 0;
      draw();
    } catch (error) {
      say(String(/** @type {Error} */ (error).message), true);
    }
  }

  function draw() {
    const wanted = filter.value.toLowerCase();
    const rank = (/** @type {any} */ s) => (s.state === "running" ? 0 : s.state === "paused" ? 1 : 2);
    const lines = [...known.values()].filter((s) => !is_look(s) && s.name.toLowerCase().includes(wanted))
      .sort((a, b) => rank(a) - rank(b) || b.id - a.id);
    studies.element.hidden = lines.length === 0;
    no_studies.hidden = lines.length > 0;
    no_studies.textContent = known.size > 0 ? "No study is called so." : "There is no study yet.";
    studies.show(lines, (s) => [h("a", { href: `#/study/${s.id}` }, s.name), s.state, progress_of(s), count(s.points),
      s.failed > 0 ? h("span", { class: "bad" }, count(s.failed)) : "0", s.points_per_s > 0 ? count(s.points_per_s) : "",
      s.state === "running" ? time_left(s.left_s) : "", h("span", { class: "weak" }, s.state === "running" ? s.waits_for : ""),
      ...(place.may_change ? [study_buttons(s, say)] : [])]);
    const there = now?.workers ?? [];
    workers.element.hidden = there.length === 0;
    no_workers.hidden = there.length > 0 || !now;
    workers.show(there, (w) => [w.name, w.silent_s > 0 ? `${w.state}, silent for ${w.silent_s} s` : w.state, String(w.threads),
      count(w.points_per_s), count(w.solved_points), String(w.losses),
      h("span", { class: "weak" }, `${w.solver_version}, ${w.instruction_set}`)]);
    const hidden = (now?.workers_there ?? 0) - there.length;
    unlisted.textContent = hidden > 0 ? `${count(hidden)} more workers are not shown.` : "";
    if (now) {
      const figures = [["points/s", count(now.points_per_s)], ["points open", count(now.points_open)],
        ["at workers", count(now.points_leased)], ["workers", count(now.workers_there)], ["threads", count(now.threads)],
        ...Object.entries(now.studies_by_state).map(([state, n]) => [`studies ${state}`, count(Number(n))])];
      numbers.replaceChildren(...figures.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value))));
    }
  }

  read();
  return {
    take(told) {
      now = told;
      if (told.is_stopping) say("The server is stopping.");
      for (const study of told.studies) known.set(study.id, study);
      const seen = JSON.stringify(told.studies_by_state);
      if (seen !== states) read();
      states = seen;
      draw();
    },
  };
}
