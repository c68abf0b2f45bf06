// The view of studies and workers, updated live.
import { json, post, retryMs } from "./api.js";
import { button, h, setChildren, statusLine } from "./lib/dom.js";
import { count, counted, timeLeft } from "./lib/format.js";

const pageSize = 1000;
const mostRead = 10_000;
const mostShown = 200;

export const failedCondition = "error IS NOT NULL";

const changes = {
  running: ["pause", "cancel"],
  paused: ["resume", "cancel"],
  cancelled: ["resume"],
  done: [],
};

/** Creates the buttons that change the state of a study; `say` shows the result. */
export function studyButtons({ id, name, state, failed }, say) {
  const change = async (what) => {
    if (what === "cancel" && !confirm(`Cancel ${name}? Solved points stay.`)) return;
    try {
      const { study, retried } = await post(`api/studies/${id}/${what}`);
      say(
        `${study.name}: ${what === "retry" ? `${counted(retried, "point")} tried again` : study.state}`,
      );
    } catch (error) {
      say(error.message, true);
    }
  };
  const wanted = [...(changes[state] ?? []), ...(failed > 0 ? ["retry"] : [])].map((what) =>
    button(what, () => change(what), { "aria-label": `${what} ${name}`, "data-change": what }),
  );
  return h("span.buttons", ...wanted);
}

/** Returns the number of points that are solved, failed or left out by a filter. */
export const completed = (study) => study.solved + study.failed + study.left_out;

export function progressOf(study) {
  const share = study.points > 0 ? completed(study) / study.points : 1;
  const percent = share >= 1 ? "100" : (Math.floor(share * 1000) / 10).toFixed(1);
  const bar = h("progress", {
    max: Math.max(study.points, 1),
    value: completed(study),
    "aria-label": `${study.name}: completed points`,
  });
  return h("span.share", bar, `${percent} %`);
}

/** Creates a table whose rows can be updated. Headings of numeric columns begin with #. */
function liveTable(caption, heads) {
  const kind = (i) => (heads[i].startsWith("#") ? "number" : "");
  const head = (name, i) => h("th", { scope: "col", class: kind(i) }, name.replace("#", ""));
  const body = h("tbody");
  const element = h(
    "div.scroll.live",
    { tabIndex: 0, role: "region", "aria-label": caption },
    h("table", h("thead", h("tr", ...heads.map(head))), body),
  );
  const row = (cells) =>
    h(
      "tr",
      ...cells.map((cell, i) =>
        h(i > 0 ? "td" : "th", { class: kind(i), scope: i > 0 ? null : "row" }, cell),
      ),
    );
  return {
    element,
    show(rows) {
      element.hidden = rows.length === 0;
      setChildren(body, ...rows.map(row));
    },
  };
}

const studyHeads = ["study", "state", "progress", "#points", "#failed", "#points/s", "#time left"];

function studyCells(study, place, say) {
  const { id, name, state, points, failed, points_per_s, left_s, waits_for } = study;
  const isRunning = state === "running";
  const href = `#/study/${id}?where=${encodeURIComponent(failedCondition)}`;
  return [
    h("a", { href: `#/study/${id}` }, name),
    state,
    progressOf(study),
    count(points),
    failed > 0 ? h("a.bad", { href, title: "show the failed points" }, count(failed)) : "0",
    points_per_s > 0 ? count(points_per_s) : "",
    isRunning ? timeLeft(left_s) : "",
    h("span.weak", isRunning ? waits_for : ""),
    ...(place.mayChange ? [studyButtons(study, say)] : []),
  ];
}

const workerHeads = ["worker", "state", "#threads", "#points/s", "#solved", "#losses", "solver"];

const workerCells = (worker) => [
  worker.name,
  worker.silent_s > 0 ? `${worker.state}, silent for ${worker.silent_s} s` : worker.state,
  String(worker.threads),
  count(worker.points_per_s),
  count(worker.solved_points),
  String(worker.losses),
  h("span.weak", `${worker.solver_version}, ${worker.instruction_set}`),
];

/** Returns the studies whose name contains a text: running ones first, then the newest. */
function inOrder(studies, text) {
  const rank = { running: 0, paused: 1 };
  return studies
    .filter(({ name }) => name.toLowerCase().includes(text.toLowerCase()))
    .sort((a, b) => (rank[a.state] ?? 2) - (rank[b.state] ?? 2) || b.id - a.id);
}

/** Reads all studies, page by page. */
async function readStudies(signal) {
  const found = new Map();
  for (let after = 0; found.size < mostRead;) {
    const page = await json(`api/studies?limit=${pageSize}&after=${after}`, signal);
    for (const study of page.studies) found.set(study.id, study);
    after = page.next_after;
    if (after === 0) break;
  }
  return found;
}

export function overview(root, place) {
  const { element: said, say } = statusLine();
  const load = h("p.weak.load");
  const filter = h("input", {
    type: "search",
    value: place.fields.get("name") ?? "",
    placeholder: "name contains …",
    "aria-label": "Filter studies by name",
    oninput: () => {
      place.keep(new URLSearchParams(filter.value ? { name: filter.value } : {}));
      draw();
    },
  });
  const studyTable = liveTable("Studies", [
    ...studyHeads,
    "waiting for",
    ...(place.mayChange ? ["change"] : []),
  ]);
  const workerTable = liveTable("Workers", workerHeads);
  const [studyNote, workerNote] = [h("p.weak"), h("p.weak")];
  root.append(
    said,
    h(
      "div.head",
      h("h2", "Studies"),
      filter,
      place.mayChange && h("a.button", { href: "#/new" }, "New study"),
    ),
    studyTable.element,
    studyNote,
    h("h2", "Workers"),
    load,
    workerTable.element,
    workerNote,
  );

  let studies = new Map();
  let now = place.now();
  let fault = "";
  let states = "";
  let isReading = false;
  let wantsAnother = false;
  let readAt = -Infinity;

  function draw() {
    const matching = inOrder([...studies.values()], filter.value);
    studyTable.show(matching.slice(0, mostShown).map((study) => studyCells(study, place, say)));
    const hidden = matching.length - mostShown;
    const none = studies.size > 0 ? "No study has this name." : "There are no studies yet.";
    const isEmpty = matching.length === 0 && readAt > 0;
    studyNote.textContent =
      hidden > 0 ? `${count(hidden)} more: filter by name.` : isEmpty ? none : "";
    if (!now) return;
    workerTable.show(now.workers.map(workerCells));
    const others = now.workers_there - now.workers.length;
    const noWorker = now.workers_there > 0 ? "" : "No worker is connected: start oblique-worker.";
    workerNote.textContent = others > 0 ? `${count(others)} more: see oblique workers.` : noWorker;
    load.textContent =
      now.points_open > 0
        ? `${counted(now.points_open, "point")} open, ${count(now.points_leased)} at ` +
          `${counted(now.workers_there, "worker")} with ${counted(now.threads, "thread")}`
        : "";
  }

  /** Reads all studies again. A call during a read causes one more read after it. */
  async function read() {
    wantsAnother = true;
    if (isReading) return;
    isReading = true;
    while (wantsAnother && !place.signal.aborted) {
      wantsAnother = false;
      try {
        studies = await readStudies(place.signal);
        for (const study of now?.studies ?? []) studies.set(study.id, study);
        if (fault && said.textContent === fault) say("");
        fault = "";
      } catch (error) {
        if (place.signal.aborted) return;
        say((fault = error.message), true);
        setTimeout(read, retryMs);
      }
      readAt = performance.now();
      draw();
    }
    isReading = false;
  }

  read();
  return {
    take(update) {
      now = update;
      if (update.is_stopping) say("The server is stopping.");
      for (const study of update.studies) studies.set(study.id, study);
      // An update contains only some studies. All studies are read when the state of a study
      // changes, or every few seconds.
      const isOld = update.unlisted > 0 && performance.now() - readAt > retryMs;
      const changed = JSON.stringify(update.studies_by_state);
      if (changed !== states || isOld) read();
      states = changed;
      draw();
    },
    goTo(fields) {
      filter.value = fields.get("name") ?? "";
      draw();
    },
    reconnected: read,
  };
}
