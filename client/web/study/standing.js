// @ts-check
// How far a study is, and what may be done with it.
import { h } from "/parts/dom.js";
import { count } from "/parts/format.js";
import { json, rows } from "/server.js";
import { completed, kFailed, progress_of, study_buttons } from "/overview.js";

/** Of a study that events do not tell of. */
const kAskAgain_ms = 3000;

/** Why points failed, by the first of them, and the way to all of them. @param {import("./study.js").StudyView} view */
function failure_line(view) {
  const { id } = view.study;
  const why = h("span", { class: "bad" });
  const all = h("a", { href: `#/study/${id}?where=${encodeURIComponent(kFailed)}`, onclick: (/** @type {MouseEvent} */ event) => {
    if (event.ctrlKey || event.metaKey || event.shiftKey) return;  // a view of its own
    event.preventDefault();
    view.marking.change({ where: kFailed, mark: "" });
    view.table.element.scrollIntoView();
  } });
  const element = h("p", { class: "failure", hidden: true }, why, " ", all);
  /** What the study was like when it was asked why. */
  let asked = "";
  let failed = 0;
  return { element,
    /** @param {any} told the study, as events tell of it */
    async show(told) {
      element.hidden = told.failed === 0;
      all.textContent = told.failed === 1 ? "Show it in the table" : `Show all ${count(told.failed)} that failed`;
      const stands = `${told.state} ${told.failed < failed}`;  // those that are tried again may fail in another way
      failed = told.failed;
      if (failed === 0) asked = "";
      if (failed === 0 || stands === asked) return;
      asked = stands;
      const first = await rows(id, { select: "point,error", where: kFailed, order: "point", limit: 1 }).then((told) => told.rows[0], () => null);
      if (first && stands === asked) why.textContent = `Point ${count(first[0])} failed: ${first[1]}${/[.?!]$/.test(first[1]) ? "" : "."}`;
      else if (stands === asked) asked = ""; // with the next that is told
    } };
}

/** @param {import("./study.js").StudyView} view @param {(settled: string) => void} moved other points are settled than before */
export function standing_row(view, moved) {
  const how_far = h("div", { class: "row standing" });
  // They stay what they are while the study goes on, under the finger that presses one and with the focus.
  const buttons = h("div", {});
  const failure = failure_line(view);
  const element = h("div", {}, h("div", { class: "row standing" }, how_far, buttons), failure.element);
  let stood = "";
  let offered = "";
  let settled = "";
  let state = "";
  /** By the last event, which has not all where many studies run or are paused. */
  let is_listed = false;
  let states = "";
  let later = 0;
  let is_closed = false;
  /** @param {any} told */
  function offer(told) {
    const what = JSON.stringify([told.state, told.failed > 0]);
    if (what === offered || !view.place.may_change) return;
    offered = what;
    const had_focus = buttons.contains(document.activeElement);
    buttons.replaceChildren(study_buttons(told, (text, is_bad = false) => view.say(text, is_bad)));
    if (had_focus) buttons.querySelector("button")?.focus();
  }
  /** @param {any} told */
  const show = (told) => {
    const text = JSON.stringify([told.state, told.solved, told.failed, told.left_out, told.waits_for]);
    if (text === stood) return;
    stood = text;
    state = told.state;
    wait();
    how_far.replaceChildren(told.state, progress_of(told), `${count(told.points)} ${told.points === 1 ? "point" : "points"}`,
      told.failed > 0 ? h("span", { class: "bad" }, `${count(told.failed)} failed`) : "",
      told.left_out > 0 ? h("span", { class: "weak" }, `${count(told.left_out)} left out by where`) : "",
      told.state === "running" && told.waits_for ? h("span", { class: "weak" }, `waits for ${told.waits_for}`) : "");
    failure.show(told);
    offer(told);
    const now = `${completed(told)}`;
    if (now === settled) return;
    if (settled !== "" || view.study.state === "running") moved(now);  // points may have come while the view was opened
    settled = now;
  };
  const ask = () => json(`/api/studies?limit=1&after=${view.study.id - 1}`).then((page) => {
    if (page.studies[0]?.id === view.study.id) show(page.studies[0]);
  }, () => {});
  /** Asks again, if nobody else tells. */
  function wait() {
    if (is_closed || later || is_listed || ["done", "cancelled"].includes(state)) return;
    later = setTimeout(async () => {
      if (!document.hidden) await ask();
      later = 0;
      wait();
    }, kAskAgain_ms);
  }
  ask();
  return { element,
    /** @param {any} now the overview */
    take(now) {
      const told = now.studies.find((/** @type {any} */ one) => one.id === view.study.id);
      const by_state = JSON.stringify(now.studies_by_state);
      if (told) show(told);
      else if (is_listed || by_state !== states) ask(); // it ended, or began
      is_listed = !!told;
      states = by_state;
      wait();
    },
    close() {
      is_closed = true;
      clearTimeout(later);
    } };
}
