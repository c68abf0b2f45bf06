// @ts-check
// Play, pause and scrub: first the fall in slow motion, then the contact in much slower motion.
import { h, named, picker } from "/parts/dom.js";
import { count, shown } from "/parts/format.js";
import { row_at } from "./trace.js";

/** Seconds that the whole contact takes to watch. */
const kLasts = [["3", "3 s"], ["8", "8 s"], ["20", "20 s"], ["60", "60 s"]];
const kFallLasts = 2;
const kScrubSteps = 1000;

/** @typedef {{row: number, is_falling: boolean}} Instant a row of the fall or of the contact */

/** @param {number} by */
const slower = (by) => (by < 1.05 ? "as fast as it is" : `${by < 10 ? shown(by, 2) : count(by)} times slower than it is`);

/** Which instant is watched when: places in it are seconds since release as they are watched, the fall first. */
class Film {
  /** Seconds that the contact takes to watch. */
  contact_lasts = 8;

  /** @param {Float64Array} times of the contact @param {Float64Array} fall_times before it, negative; none: it begins at touch */
  constructor(times, fall_times) {
    this.times = times;
    this.fall_times = fall_times;
    this.contact_s = times[times.length - 1] || 1e-9;
    this.fall_s = fall_times.length > 1 ? -fall_times[0] : 0;
    this.fall_lasts = this.fall_s > 0 ? kFallLasts : 0;
  }
  get lasts() {
    return this.fall_lasts + this.contact_lasts;
  }
  /** Time since touch [s]. @param {number} place */
  time_at(place) {
    return place < this.fall_lasts ? -this.fall_s * (1 - place / this.fall_lasts) : ((place - this.fall_lasts) / this.contact_lasts) * this.contact_s;
  }
  /** @param {number} t since touch [s] */
  place_of(t) {
    return t < 0 ? this.fall_lasts * (1 + t / this.fall_s) : this.fall_lasts + (t / this.contact_s) * this.contact_lasts;
  }
  /** @param {number} place @returns {Instant} */
  instant_at(place) {
    const is_falling = place < this.fall_lasts;
    return { row: row_at(is_falling ? this.fall_times : this.times, this.time_at(place)), is_falling };
  }
  /** The time as it is read and as it is spoken, and how fast it goes. @param {number} place */
  words_at(place) {
    const t = this.time_at(place);
    const ms = (t * 1e3).toFixed(0);
    const us = `${(t * 1e6).toFixed(1)} µs`;
    return place < this.fall_lasts
      ? { time: `${ms.replace("-", "\u2212")} ms`, spoken: `${(-t * 1e3).toFixed(0)} ms before touch`, speed: `falls, ${slower(this.fall_lasts / this.fall_s)}` }
      : { time: us, spoken: `${us} after touch`, speed: slower(this.contact_lasts / this.contact_s) };
  }
}

/**
 * @param {Float64Array} times of the contact @param {Float64Array} fall_times before it, negative; none: it begins at touch
 * @param {(at: Instant) => void} moved
 */
export function player(times, fall_times, moved) {
  const film = new Film(times, fall_times);
  let place = 0;
  let frame = 0;
  let before = 0;
  const play = h("button", { type: "button", class: "play", onclick: () => (frame ? pause() : go_on()) }, "Play");
  const touch = h("button", { type: "button", class: "touch", onclick: () => jump(film.fall_lasts) }, "To the touch");
  const scrub = h("input", { type: "range", min: 0, max: kScrubSteps, step: 1, value: 0, "aria-label": "Time, from release through the contact",
    oninput: () => jump((film.lasts * Number(scrub.value)) / kScrubSteps) });
  const out = h("output", {});
  const speed = h("span", { class: "weak speed" });
  const pace = picker(kLasts, String(film.contact_lasts), (text) => {
    const t = film.time_at(place);
    film.contact_lasts = Number(text);
    set(film.place_of(t));
  });
  const element = h("div", { class: "row player" }, play, film.fall_s > 0 && touch, h("span", { class: "scrub" }, scrub, out), named("contact lasts", pace), speed);

  function set(/** @type {number} */ to) {
    place = Math.min(Math.max(to, 0), film.lasts);
    const words = film.words_at(place);
    scrub.value = String(Math.round((kScrubSteps * place) / film.lasts));
    out.textContent = words.time;
    scrub.setAttribute("aria-valuetext", words.spoken);
    speed.textContent = words.speed;
    moved(film.instant_at(place));
  }
  function jump(/** @type {number} */ to) {
    pause();
    set(to);
  }
  function step(/** @type {number} */ now) {
    const passed = Math.min((now - before) / 1000, 0.1);
    before = now;
    set(place + passed);
    if (place >= film.lasts) pause();
    else if (frame) frame = requestAnimationFrame(step);
  }
  function go_on() {
    if (place >= film.lasts) place = 0;
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
      if (!matchMedia("(prefers-reduced-motion: reduce)").matches) go_on();
    },
    /** Somebody points at an instant of the contact elsewhere. @param {number} row */
    show: (row) => jump(film.place_of(times[row])),
    close() {
      pause();
      document.removeEventListener("visibilitychange", hide);
    } };
}
