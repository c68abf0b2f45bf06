// @ts-check
// Play, pause and scrub: first the fall in slow motion, then the contact in much slower motion.
import { h, named, picker } from "/parts/dom.js";
import { count, shown } from "/parts/format.js";
import { row_at } from "./trace.js";

/** Seconds that the whole contact takes to watch. */
const kLasts = [["3", "3 s"], ["8", "8 s"], ["20", "20 s"], ["60", "60 s"]];
const kFallLasts = 2;
const kScrubSteps = 1000;

/**
 * @typedef {{row: number, is_falling: boolean}} Instant a row of the fall or of the contact
 * @param {Float64Array} times of the contact @param {Float64Array} fall_times before it, negative; none: it begins at touch
 * @param {(at: Instant) => void} moved
 */
export function player(times, fall_times, moved) {
  const end = times[times.length - 1] || 1e-9;
  const fall = fall_times.length > 1 ? -fall_times[0] : 0;
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  /** Seconds since release as they are watched, the fall first. */
  let watched = 0;
  let lasts = 8;
  let frame = 0;
  let before = 0;
  const fall_lasts = fall > 0 ? kFallLasts : 0;
  const play = h("button", { type: "button", class: "play", onclick: () => (frame ? pause() : go_on()) }, "Play");
  const touch = h("button", { type: "button", class: "touch", onclick: () => {
    pause();
    set(fall_lasts);
  } }, "To the touch");
  const scrub = h("input", { type: "range", min: 0, max: kScrubSteps, step: 1, value: 0, "aria-label": "Time, from release through the contact", oninput: () => {
    pause();
    set(((fall_lasts + lasts) * Number(scrub.value)) / kScrubSteps);
  } });
  const out = h("output", {});
  const speed = h("span", { class: "weak speed" });
  const element = h("div", { class: "row player" }, play, fall > 0 && touch, h("span", { class: "scrub" }, scrub, out),
    named("contact lasts", picker(kLasts, String(lasts), (text) => {
      const time = time_of();
      lasts = Number(text);
      show_time(time);
    })), speed);

  /** Time since touch [s]. */
  const time_of = () => (watched < fall_lasts ? -fall * (1 - watched / fall_lasts) : ((watched - fall_lasts) / lasts) * end);
  const show_time = (/** @type {number} */ t) => set(t < 0 ? fall_lasts * (1 + t / fall) : fall_lasts + (t / end) * lasts);
  const slower = (/** @type {number} */ by) => (by < 1.05 ? "as fast as it is" : `${by < 10 ? shown(by, 2) : count(by)} times slower than it is`);

  function set(/** @type {number} */ to) {
    watched = Math.min(Math.max(to, 0), fall_lasts + lasts);
    const t = time_of();
    const is_falling = watched < fall_lasts;
    scrub.value = String(Math.round((kScrubSteps * watched) / (fall_lasts + lasts)));
    out.textContent = is_falling ? `${(t * 1e3).toFixed(0).replace("-", "\u2212")} ms` : `${(t * 1e6).toFixed(1)} µs`;
    scrub.setAttribute("aria-valuetext", is_falling ? `${(-t * 1e3).toFixed(0)} ms before touch` : `${out.textContent} after touch`);
    speed.textContent = is_falling ? `falls, ${slower(fall_lasts / fall)}` : slower(lasts / end);
    moved({ row: row_at(is_falling ? fall_times : times, t), is_falling });
  }
  function step(/** @type {number} */ now) {
    const passed = Math.min((now - before) / 1000, 0.1);
    before = now;
    set(watched + passed);
    if (watched >= fall_lasts + lasts) pause();
    else if (frame) frame = requestAnimationFrame(step);
  }
  function go_on() {
    if (watched >= fall_lasts + lasts) watched = 0;
    before = performance.now();
    play.textContent = "Pause";
    frame = requestAnimationFrame(step);
  }
  function pause() {
    cancelAnimationFrame(frame);
    frame = 0;
    play.textContent = "Play";
  }
  const hide = () => { if (document.hidden) pause(); };
  document.addEventListener("visibilitychange", hide);
  return { element,
    begin() {
      set(0);
      // Who wants little motion starts it by hand.
      if (!calm) go_on();
    },
    /** Somebody points at an instant of the contact elsewhere. @param {number} row */
    show(row) {
      pause();
      show_time(times[row]);
    },
    close() {
      pause();
      document.removeEventListener("visibilitychange", hide);
    } };
}
