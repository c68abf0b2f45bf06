// @ts-check
// Studies and workers, as tables.

/** @param {string} name @param {string | Node} content @param {string} [kind] */
function cell(name, content, kind) {
  const made = document.createElement(name);
  made.append(content);
  if (kind) made.className = kind;
  return made;
}

/** @param {number} value */
export function count(value) {
  return Math.round(value).toLocaleString("en").replaceAll(",", "\u202f");
}

/** @param {number | null} seconds */
export function time_left(seconds) {
  if (seconds === null) return "";
  if (seconds < 90) return `${Math.ceil(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return seconds < 172800 ? `${(seconds / 3600).toFixed(1)} h` : `${Math.round(seconds / 86400)} days`;
}

/** @param {string} title @param {string[]} heads @param {HTMLElement[][]} rows @param {string} none */
function table(title, heads, rows, none) {
  const section = document.createElement("section");
  section.append(cell("h2", title));
  if (rows.length === 0) {
    section.append(cell("p", none, "weak"));
    return section;
  }
  const made = document.createElement("table");
  const head = made.createTHead().insertRow();
  heads.forEach((text, i) => {
    const th = cell("th", text, rows[0][i].className === "number" ? "number" : "");
    th.setAttribute("scope", "col");
    head.append(th);
  });
  const body = made.createTBody();
  rows.forEach((cells) => body.insertRow().append(...cells));
  const scroll = cell("div", made, "scroll");
  scroll.tabIndex = 0; // so that the keyboard scrolls it
  section.append(scroll);
  return section;
}

/** @param {any} study */
function study_row(study) {
  const bar = document.createElement("progress");
  bar.max = Math.max(study.points, 1);
  bar.value = study.solved + study.failed;
  bar.setAttribute("aria-label", `${study.name}: settled points`);
  return [cell("td", study.name), cell("td", study.state), cell("td", bar),
    cell("td", count(study.points), "number"), cell("td", count(study.solved), "number"),
    cell("td", study.failed > 0 ? count(study.failed) : "", study.failed > 0 ? "number bad" : "number"),
    cell("td", study.points_per_s > 0 ? count(study.points_per_s) : "", "number"),
    cell("td", time_left(study.left_s), "number"), cell("td", String(study.priority), "number"),
    cell("td", study.waits_for, "weak")];
}

/** @param {any} worker */
function worker_row(worker) {
  return [cell("td", worker.name), cell("td", worker.state), cell("td", String(worker.threads), "number"),
    cell("td", count(worker.points_per_s), "number"), cell("td", count(worker.solved_points), "number"),
    cell("td", `${worker.solver_version}, ${worker.instruction_set}`, "weak")];
}

/** @param {HTMLElement} view @param {HTMLElement} pace @param {any} now */
export function overview(view, pace, now) {
  const done = now.studies_by_state.done ?? 0;
  pace.textContent = now.database_fault
    || `${count(now.points_per_s)} points/s, ${count(now.points_open)} open, ${count(done)} studies done`;
  view.replaceChildren(
    table("Studies", ["name", "state", "progress", "points", "solved", "failed", "points/s", "left", "priority",
      "waits for"], now.studies.map(study_row), "No study runs."),
    table("Workers", ["name", "state", "threads", "points/s", "solved", "solver"], now.workers.map(worker_row),
      "No worker is here: start oblique-worker."));
}
