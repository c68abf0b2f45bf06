// @ts-check
// When a map is solved though nobody pressed a button: where it lacks cells, or is zoomed in until few are left.
import { own_axes } from "../axes.js";
import { tick } from "/parts/dom.js";

/** People go on zooming; the last place counts. */
const kSettled_ms = 350;
/** With fewer values along an axis a map is coarse. */
const kFew = 16;
/** As the finest that is solved: larger pictures keep their own cells, unless most are empty. */
const kFinest = 129;
const kMostElements = 24;
const kLeastTolerance = 1e-6;

/** @typedef {import("../study.js").StudyView} View */

/** Whether a map of points takes moments: models with fine meshes and small steps are solved when somebody says so. @param {View} view */
function is_cheap({ study, block }) {
  const value = (/** @type {string} */ key) => study.model.find((/** @type {any} */ one) => one.key === key)?.value;
  const is_changed = own_axes(block).some((axis) => ["links", "elements_per_link", "integrator", "dt", "dt_fall", "tolerance"].includes(axis.key));
  return !is_changed && value("integrator") === "explicit" && value("links") * value("elements_per_link") <= kMostElements && value("dt") === 0
    && value("dt_fall") === 0 && value("tolerance") >= kLeastTolerance;
}

/** A study that runs fills its cells itself. @param {View} view @param {any} now the overview */
function is_running({ study }, now) {
  const told = now.studies.find((/** @type {any} */ one) => one.id === study.id);
  return told ? told.state === "running" : study.state === "running" && now.unlisted > 0;
}

/** Whether what a map shows of its study is less than what is solved in moments. @param {View} view */
export function is_lacking(view) {
  const { picture } = view;
  if (!picture || picture.head.missing === undefined) return false;
  const sides = [picture.x.values.length, picture.y.values.length];
  const is_zoomed = ["x0", "x1", "y0", "y1"].some((name) => view.is(name) !== "");
  return (is_zoomed && Math.min(...sides) < kFew)
    || (picture.head.missing > 0 && (Math.max(...sides) <= kFinest || 2 * picture.head.missing > picture.values.length));
}

/** @param {View} view @param {() => void} solve @param {() => boolean} is_on whether it is solved already */
export function unasked(view, solve, is_on) {
  const element = tick("solve what is not there", true, (is) => {
    view.set({ solve: is ? "" : "off" });
    offer();
  });
  const box = element.querySelector("input");
  element.title = "where a map lacks cells, or is zoomed in until few are left";
  let timer = 0;

  function look() {
    timer = 0;
    if (is_on() || view.is("solve") === "off" || !is_lacking(view)) return;
    const now = view.place.now();
    if (!now || document.hidden) timer = setTimeout(look, kSettled_ms);
    else if (now.threads > 0 && !is_running(view, now)) solve();
  }
  /** The study's own picture is shown. */
  function offer() {
    stop();
    const may = view.place.may_change && view.is("pic") === "map" && is_cheap(view);
    element.hidden = !may || is_on();
    box.checked = view.is("solve") !== "off";
    if (!element.hidden && box.checked) timer = setTimeout(look, kSettled_ms);
  }
  function stop() {
    clearTimeout(timer);
    timer = 0;
  }
  return { element, offer, stop };
}
