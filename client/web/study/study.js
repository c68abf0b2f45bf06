// @ts-check
// A study: what its address says, the picture, and what belongs to it.
import { h } from "/parts/dom.js";
import { in_words, json, Silence } from "/server.js";
import { ask, steps_to } from "./pictures.js";
import { fill_in, varying } from "./axes.js";
import { choice_of } from "./choice.js";
import { condition_fields, rounded } from "./conditions.js";
import { show_controls } from "./controls.js";
import { drawing_of } from "./drawing.js";
import { MapCanvas } from "./drawn/map.js";
import { marking_of } from "./marking.js";
import { refine_row } from "./refine.js";
import { standing_row } from "./standing.js";
import { row_table } from "./table.js";
import { show_takeaways } from "./take.js";

const kLookAgain_ms = 1500;
/** After the server did not answer. */
const kAskAgain_ms = 3000;

/** @typedef {import("./pictures.js").Picture} Picture */

/**
 * @param {HTMLElement} root @param {import("/main.js").Place} place @param {number} id
 * @returns {Promise<import("/main.js").View>}
 */
export async function study_view(root, place, id) {
  const study = await json(`/api/studies/${id}`);
  place.trail([study.name]);
  return new StudyView(root, place, study).begin();
}

export class StudyView {
  /** @param {HTMLElement} root @param {import("/main.js").Place} place @param {any} study */
  constructor(root, place, study) {
    this.root = root;
    this.place = place;
    this.study = study;
    this.fields = place.fields;
    /** @type {any[]} */
    this.columns = study.columns;
    this.numbers = this.columns.filter((c) => c.picture === "numbers");
    this.grids = study.blocks.map((/** @type {any} */ b, /** @type {number} */ i) => ({ b, i })).filter((/** @type {any} */ one) => varying(one.b).length > 0);
    /** @type {AbortController | null} */
    this.asked = null;
    /** @type {Picture | null} */
    this.picture = null;
    this.wants_more = false;
    /** Something that was asked for did not come. */
    this.is_stale = false;
    /** Who came back goes on at the map. */
    this.wants_focus = false;
    /** When the last refresh came to its end. */
    this.loaded_ms = 0;
    /** The timer of the next refresh; 0: none. */
    this.later = 0;
    this.is_refreshing = false;
    this.has_moved = false;
    this.is_closed = false;
    fill_in(this.fields, this.study);
  }

  is(/** @type {string} */ name) {
    return this.fields.get(name) ?? "";
  }
  /** @param {Record<string, string>} changes @param {boolean} [is_step] that people go back over */
  set(changes, is_step = false) {
    for (const [name, value] of Object.entries(changes)) {
      if (value === "") this.fields.delete(name);
      else this.fields.set(name, value);
    }
    this.place.keep(this.fields, is_step);
  }
  get block() {
    return this.study.blocks[Number(this.is("block"))];
  }
  get has_map() {
    return this.is("pic") === "map" || this.is("pic") === "gathered";
  }
  /** @param {number} point */
  address_of(point) {
    return `#/study/${this.study.id}/point/${point}`;
  }
  /** Numbers of the values at which the other axes are held. @returns {Map<string, number>} */
  places() {
    const held = this.is("at").split(",").filter((text) => text.includes("@")).map((one) => one.split("@"));
    return new Map(held.map(([key, number]) => [key, Number(number)]));
  }
  unit_of = (/** @type {string} */ key) => this.columns.find((c) => c.name === key)?.unit
    ?? [...this.study.blocks.flatMap((/** @type {any} */ b) => b.axes), ...this.study.model].find((/** @type {any} */ a) => a.key === key)?.unit ?? "";

  begin() {
    this.said = h("p", { role: "status", class: "said" });
    this.standing = standing_row(this, () => this.#look_again());
    this.conditions = condition_fields(this);
    this.controls = h("div", { class: "controls" });
    this.sliders = h("div", { class: "sliders" });
    this.colour_row = h("div", {});
    this.commands = h("div", { class: "commands" });
    this.map = new MapCanvas({
      hover: (cell) => this.choice.speak(cell ?? this.map.chosen),
      choose: (cell, point) => this.choice.choose(cell, point),
      open: (cell) => this.choice.open(cell),
      zoom: (part) => this.zoom(part),
      mark: (part, is_further) => this.marking.mark_part(part, is_further),
    });
    this.map.let_drag(this.is("drag") === "mark" ? "mark" : "zoom");
    this.drawing = drawing_of(this);
    this.marking = marking_of(this);
    this.choice = choice_of(this);
    this.refine = refine_row(this);
    this.table = row_table({ study: this.study.id, points: this.study.points, columns: () => this.row_columns(),
      where: () => this.is("where"), marked: () => this.is("mark"),
      all: () => this.is("all") !== "", keep_all: (all) => {
        this.set({ all: all ? "1" : "" });
        show_takeaways(this);
      },
      // People count pages from 1.
      page: () => Math.max(Math.floor(Number(this.is("page"))) || 1, 1) - 1, keep_page: (page) => this.set({ page: page > 0 ? String(page + 1) : "" }),
      order: () => this.is("order"), keep_order: (order) => { this.set({ order }); show_takeaways(this); },
      wrong: (error) => this.complain(error), chosen: (point) => this.choice.choose_point(point) });
    this.choice.speak(null);
    this.root.append(h("h2", { class: "name" }, this.study.name), this.standing.element, this.said, this.conditions.element,
      h("div", { class: "beside" },
        h("section", { class: "picture", "aria-label": "Picture" }, this.controls, this.sliders, this.map.element, this.drawing.lines_place,
          this.choice.spoken, this.choice.line, this.refine.element, this.drawing.legend, this.colour_row, this.drawing.told),
        this.table.element),
      h("section", {}, h("h2", {}, "Take it with you"), this.commands));
    show_controls(this);
    this.load();
    this.table.load();
    this.conditions.tell();
    return this;
  }

  /** Another view of the same study, as by the browser's Back. @param {URLSearchParams} fields */
  go_to(fields) {
    this.fields = fields;
    fill_in(this.fields, this.study);
    this.say("");
    this.map.let_drag(this.is("drag") === "mark" ? "mark" : "zoom");
    this.choice.none();
    show_controls(this);
    this.load();
    this.table.load();
    this.conditions.tell();
  }

  close() {
    this.is_closed = true;
    this.standing.close();
    this.stop_asking();
    this.table.close();
    this.conditions.close();
    this.map.close();
    this.drawing.end();
  }

  /** The server did not answer, and does again. */
  again() {
    if (!this.is_stale || this.is_closed) return;
    this.is_stale = false;
    this.say("");
    this.load();
    this.table.load();
    this.conditions.tell(true);
  }

  focus() {
    this.wants_focus = true;
  }

  /** @param {any} now */
  take(now) {
    this.standing.take(now);
  }

  /** Points were solved since. Where answers take longer than points one refresh ends before the next begins, or none would end. */
  #look_again() {
    if (this.is_closed) return;
    this.has_moved = true;
    if (this.later || this.is_refreshing) return;
    this.later = setTimeout(async () => {
      this.later = 0;
      this.has_moved = false;
      this.is_refreshing = true;
      await Promise.allSettled([this.load(true), this.conditions.tell(true), this.table.again()]);
      await this.marked;
      this.is_refreshing = false;
      this.loaded_ms = performance.now();
      if (this.has_moved) this.#look_again();
    }, Math.max(kLookAgain_ms - (performance.now() - this.loaded_ms), 0));
  }

  /** @param {string | (string | Node)[]} what */
  say(what, is_bad = false) {
    this.said.replaceChildren(...(typeof what === "string" ? [what] : what));
    this.said.className = is_bad ? "said bad" : "said";
  }
  /** What a condition is refused for stands beside its field, and is not said again. @param {any} error */
  async complain(error) {
    if (in_words(error) instanceof Silence) {
      if (!this.is_stale) setTimeout(() => this.again(), kAskAgain_ms);
      this.is_stale = true;
      this.say("The server does not answer: what is shown is what came last.", true);
      return;
    }
    if (error.status === 400 && await this.conditions.is_wrong()) return;
    this.say(String(error.message), true);
  }

  row_columns() {
    /** @type {string[]} */
    const usual = this.study.usual_columns;
    const outputs = usual.indexOf("status");
    const keys = new Set(usual.slice(0, outputs));
    if (/\b(error|status)\b/.test(`${this.is("where")} ${this.is("mark")}`)) keys.add("error");
    for (const key of [this.is("x"), this.is("y"), this.is("z")]) {
      if (this.columns.some((c) => c.name === key)) keys.add(key);
    }
    return [...new Set([...keys, ...usual.slice(outputs)])];
  }

  stop_asking() {
    clearTimeout(this.later);
    this.later = 0;
    this.has_moved = this.wants_more = false;
    this.asked?.abort();
    this.marking.stop();
  }

  /**
   * Asks for the picture. What is under way ends, because it would not be seen; what repeats itself waits for it, or it
   * would never end. Only the last of what is asked for meanwhile comes.
   */
  async load(waits = false) {
    if (this.asked) {
      this.wants_more = true;
      if (!waits) this.asked.abort();
      return;
    }
    this.asked = new AbortController();
    const { signal } = this.asked;
    const kind = this.is("pic");
    try {
      const begun = performance.now();
      for (const cells of steps_to(this)) {
        if (this.wants_more) break;  // the finer one would not be seen
        const picture = await ask(this, cells, signal);
        if (signal.aborted) break;
        this.loaded_ms = performance.now();
        this.show(picture, kind);
        this.root.dataset.pictureMs = String(Math.round(performance.now() - begun));
      }
      if (this.said.className.includes("bad")) this.say("");
    } catch (error) {
      if (!signal.aborted) this.complain(error);
    } finally {
      this.asked = null;
    }
    if (this.wants_more) {
      this.wants_more = false;
      this.load();
    }
  }

  /** @param {Picture} picture @param {string} kind what it was asked for as */
  show(picture, kind) {
    if (kind !== this.is("pic")) return;
    this.picture = picture;
    this.marking.forget();
    this.map.element.hidden = this.choice.spoken.hidden = this.choice.line.hidden = !this.has_map;
    this.drawing.draw();
    this.choice.again();
    if (this.wants_focus && this.has_map) this.map.top.focus({ preventScroll: true });
    this.wants_focus = false;
    this.refine.offer();
    this.marked = this.marking.load();
    show_takeaways(this);
  }

  /** @param {import("./drawn/map.js").Rectangle | null} part */
  zoom(part) {
    const { picture } = this;
    if (!picture) return;
    if (!part) {
      this.set({ x0: "", x1: "", y0: "", y1: "", ...(this.is("pic") === "lines" ? { from: "", to: "" } : {}) }, true);
    } else {
      const ends = (/** @type {import("./pictures.js").Side} */ side, /** @type {number[]} */ cells, /** @type {number[]} */ values) => (side.edges
        ? values : cells.map((i) => side.numbers?.[i] ?? 0)).sort((a, b) => a - b).map(String);
      const [x0, x1] = ends(picture.x, [part.from[0], part.to[0]], part.x);
      const [y0, y1] = ends(picture.y, [part.from[1], part.to[1]], part.y);
      this.set({ x0, x1, y0, y1 }, true);
    }
    this.map.choose(null);
    this.load();
  }

  /** @param {import("/parts/lines.js").Part | null} part of lines or of a histogram */
  zoom_lines(part) {
    const { picture } = this;
    if (!picture) return;
    if (!part) {
      this.zoom(null);
      return;
    }
    const { values, numbers, edges } = picture.x;
    if (edges) {
      const [from, to] = part.x.map((one) => rounded(one, edges[edges.length - 1] - edges[0]));
      if (to > from) this.set({ x0: String(from), x1: String(to) }, true);
    } else {
      const inside = [...values.keys()].filter((i) => values[i] >= part.x[0] && values[i] <= part.x[1]).map((i) => numbers?.[i] ?? 0);
      if (inside.length < 2) return;  // one value is no line
      const wide = part.y ? part.y[1] - part.y[0] : 0;
      this.set({ x0: String(Math.min(...inside)), x1: String(Math.max(...inside)),
        ...(part.y ? { from: String(rounded(part.y[0], wide)), to: String(rounded(part.y[1], wide)) } : {}) }, true);
    }
    this.load();
  }
}
