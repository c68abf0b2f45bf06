// Shows the progress of a study, the reasons of failures, and its model.
import { json, retryMs, rows } from "../api.js";
import { h, setChildren } from "../lib/dom.js";
import { count, counted, withUnit } from "../lib/format.js";
import { completed, failedCondition, progressOf, studyButtons } from "../overview.js";
import { axisValue, columnOfAxis } from "./fields.js";

/**
 * Minimum number of elements per link for accurate results. With fewer, forces are off by more than
 * 0.2 %, and a tenth of the points get another mode (sequence of states).
 */
const enoughElements = 8;

/** Describes the values of an axis in short; `ends` is the range of sampled values. */
function valuesOf(axis, ends) {
  const { key, unit, values, distribution, expression } = axis;
  if (expression) return `${key} = ${expression}`;
  const text = (value) => withUnit(value, key, unit);
  if (distribution) return `${key} ${ends?.map(text).join(" to ") ?? ""} (${distribution})`;
  const listed = Array.from({ length: Math.min(values, 3) }, (_, i) => text(axisValue(axis, i)));
  if (values <= 3) return `${key} ${listed.join(", ")}`;
  return `${key} ${listed[0]} to ${text(axisValue(axis, values - 1))} (${count(values)})`;
}

/** Reads the range of each sampled axis in the results: {key: [least, most]}. */
async function drawnEnds({ id, blocks }, signal) {
  const keys = blocks[0]?.axes.filter((axis) => axis.distribution).map((axis) => axis.key) ?? [];
  if (keys.length === 0) return {};
  const ends = keys.map(columnOfAxis).map((column) => `min(${column}),max(${column})`);
  const [row] = (await rows(id, { select: ends.join(",") }, signal)).rows;
  return Object.fromEntries(keys.map((key, i) => [key, row.slice(2 * i, 2 * i + 2)]));
}

/** Creates a line with axes and mesh of a study. Opening it shows all keys of the model. */
export function modelLine(study, signal) {
  const { blocks, model } = study;
  const meshAxis = blocks
    .flatMap((block) => block.axes)
    .find((axis) => axis.key === "elements_per_link");
  const mesh = model.find((one) => one.key === "elements_per_link")?.value;
  const elements = meshAxis ? axisValue(meshAxis, 0) : mesh;
  const others = blocks.length > 1 ? `; ${counted(blocks.length - 1, "more block")}` : "";
  const note = elements < enoughElements ? " – not converged: see oblique converge" : "";
  const line = h("summary");
  const show = (ends) => {
    const axes = blocks[0]?.axes.map((axis) => valuesOf(axis, ends[axis.key])).join("; ");
    line.textContent = `${axes ?? "no points yet"}${others}; ${elements} elements a link${note}`;
  };
  show({});
  drawnEnds(study, signal).then(show, () => {});
  const textOf = ({ key, value, unit }) =>
    `${key} = ${[value]
      .flat()
      .map((one) => withUnit(one, key, unit))
      .join(", ")}`;
  return h("details.model", line, h("ul", ...model.map((one) => h("li", textOf(one)))));
}

/** Shows the reason of the first failure, with a link to all failed points. */
function failureLine(view) {
  const { id } = view.study;
  const element = h("p.failure", { hidden: true });
  let shownState = "";
  return {
    element,
    async show({ state, failed }) {
      element.hidden = failed === 0;
      const changed = `${state} ${failed}`;
      if (failed === 0 || changed === shownState) return;
      shownState = changed;
      const query = { select: "point,error", where: failedCondition, order: "point", limit: 1 };
      const answer = await rows(id, query, view.place.signal).catch(() => null);
      const [point, error] = answer?.rows[0] ?? [];
      if (error === undefined || changed !== shownState) return;
      const href = `#/study/${id}?where=${encodeURIComponent(failedCondition)}`;
      const text = failed === 1 ? "Show it in the table" : `Show all ${count(failed)}`;
      const why = `Point ${count(point)} failed: ${error.replace(/[.?!]?$/, ".")}`;
      setChildren(element, h("span.bad", why), " ", h("a", { href }, text));
    },
  };
}

/** Shows state, progress and buttons of a study; calls `moved` when points are completed. */
export function statusRow(view, moved) {
  const { study, place } = view;
  const status = h("div.row.standing");
  const buttons = h("div");
  const failure = failureLine(view);
  const element = h("div", h("div.row.standing", status, buttons), failure.element);
  let { state } = study;
  let done = null;
  let states = "";
  let askedAt = 0;

  function show(update) {
    const waitsFor = update.state === "running" && update.waits_for;
    const parts = [
      update.state,
      progressOf(update),
      counted(update.points, "point"),
      update.failed > 0 && h("span.bad", `${count(update.failed)} failed`),
      update.left_out > 0 && h("span.weak", `${count(update.left_out)} left out by where`),
      update.state === "running" &&
        update.waits_for &&
        h("span.weak", `waiting for ${update.waits_for}`),
    ];
    setChildren(status, ...parts.filter(Boolean).map((one) => h("span", one)));
    if (place.mayChange)
      setChildren(
        buttons,
        studyButtons(update, (...said) => view.say(...said)),
      );
    failure.show(update);
    // Points may have been completed while the view was loading.
    const hasMoved = done === null ? study.state === "running" : completed(update) !== done;
    ({ state } = update);
    done = completed(update);
    if (hasMoved) moved();
  }

  async function ask() {
    askedAt = performance.now();
    const page = await json(`api/studies?limit=1&after=${study.id - 1}`, place.signal).catch(
      () => null,
    );
    const update = page?.studies[0];
    if (update?.id === study.id) show(update);
  }

  ask();
  return {
    element,
    /** Takes the server's overview, which may not contain this study. */
    take(now) {
      const update = now.studies.find((one) => one.id === study.id);
      const byState = JSON.stringify(now.studies_by_state);
      const isLive = ["running", "paused"].includes(state);
      if (update) show(update);
      else if (byState !== states || (isLive && performance.now() - askedAt > retryMs)) ask();
      states = byState;
    },
  };
}
