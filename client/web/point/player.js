// @ts-check
// Play, pause and scrub through the time of a contact.
import { h, named, picker } from "/parts/dom.js";
import { row_at } from "./trace.js";

/** Seconds that the whole contact takes to watch. */
const kLasts = [["3", "3 s"], ["8", "8 s"], ["20", "20 s"], ["60", "60 s"]];

/** @param {Float64Array} times @param {(row: number) => void} moved */
export function player(times, moved) {
  const end = times[times.length - 1] || 1e-9;
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  let t = 0;
  let lasts = 8;
  let frame = 0;
  let before = 0;
  const play = h("button", { type: "button", class: "play", onclick: () => (frame ? pause() : go_on()) }, "Play");
  const scrub = h("input", { type: "range", min: 0, max: 1000, step: 1, value: 0, "aria-label": "Time in the contact", oninput: () => {
    pause();
    set((end * Number(scrub.value)) / 1000);
  } });
  const out = h("output", {});
  const speed = h("span", { class: "weak" });
  const tell_speed = () => {
    speed.textContent = `${Math.round(lasts / end).toLocaleString("en").replaceAll(",", "\u202f")} times slower than it is`;
  };
  const element = h("div", { class: "row player" }, play, h("span", { class: "scrub" }, scrub, out),
    named("contact lasts", picker(kLasts, String(lasts), (text) => {
      lasts = Number(text);
      tell_speed();
    })), speed);

  function set(/** @type {number} */ to) {
    t = Math.min(Math.max(to, 0), end);
    scrub.value = String(Math.round((1000 * t) / end));
    out.textContent = `${(t * 1e6).toFixed(1)} µs`;
    scrub.setAttribute("aria-valuetext", out.textContent);
    moved(row_at(times, t));
  }
  function step(/** @type {number} */ now) {
    const passed = Math.min((now - before) / 1000, 0.1);
    before = now;
    set(t + (passed * end) / lasts);
    if (t >= end) pause();
    else if (frame) frame = requestAnimationFrame(step);
  }
  function go_on() {
    if (t >= end) t = 0;
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
  tell_speed();
  return { element,
    begin() {
      set(0);
      // Who wants little motion starts it by hand.
      if (!calm) go_on();
    },
    /** Somebody points at an instant elsewhere. @param {number} row */
    show(row) {
      pause();
      set(times[row]);
    },
    close() {
      pause();
      document.removeEventListener("visibilitychange", hide);
    } };
}
