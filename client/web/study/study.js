// @ts-check
// A study: a picture of any output over any axes, what it means, and the rows beside it.
import { copied, h, save } from "/parts/dom.js";
import { palette } from "/parts/colours.js";
import { count } from "/parts/format.js";
import { json } from "/server.js";
import { progress_of, study_buttons } from "/overview.js";
import { fill_in, own_axes, varying } from "./axes.js";
import { plot_command, query_command } from "./command.js";
import { show_controls } from "./controls.js";
import { categories, colour_bar, gaps } from "./legend.js";
import { finer, keep } from "./look.js";
import { MapCanvas } from "./map.js";
import { bins, slice } from "./picture.js";
import { row_table } from "./table.js";
import { cells_csv, facts, sentence } from "./words.js";

const kMostCells = 512; // a side of a picture
const kMostBins = 96;
const kMostLines = 8;
const kLookAgain_ms = 1500;

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
    /** @type {import("./picture.js").Picture | null} */
    this.picture = null;
    /** @type {any} */
    this.lines = null;
    /** While what the study lacks is solved: its end, and the study that has it. @type {{stop: AbortController, id: number} | null} */
    this.looking = null;
    this.loaded_ms = 0;
    this.settled = "";
    fill_in(this.fields, this.study);
  }

  is(/** @type {string} */ name) {
    return this.fields.get(name) ?? "";
  }
  /** @param {Record<string, string>} changes */
  set(changes) {
    for (const [name, value] of Object.entries(changes)) {
      if (value === "") this.fields.delete(name);
      else this.fields.set(name, value);
    }
    this.place.keep(this.fields);
  }
  get block() {
    return this.study.blocks[Number(this.is("block"))];
  }
  unit_of = (/** @type {string} */ key) => this.columns.find((c) => c.name === key)?.unit
    ?? this.study.blocks.flatMap((/** @type {any} */ b) => b.axes).find((/** @type {any} */ a) => a.key === key)?.unit ?? "";

  begin() {
    this.said = h("p", { role: "status", class: "said" });
    this.spoken = h("p", { class: "reading", "aria-live": "polite" }, "Point at a cell, or move with the arrow keys.");
    this.standing = h("div", { class: "row standing" });
    this.controls = h("div", { class: "controls" });
    this.sliders = h("div", { class: "sliders" });
    this.legend = h("div", { class: "colours" });
    this.colour_row = h("div", {});
    this.commands = h("div", { class: "commands" });
    this.facts = h("p", { class: "weak facts" });
    this.choice = h("p", { class: "choice" });
    this.solving = h("div", { class: "row" });
    this.lines_place = h("div", {});
    this.map = new MapCanvas({
      hover: (cell) => this.#speak(cell ?? this.map.chosen),
      choose: (cell) => this.#choose(cell),
      open: (cell) => this.#open(cell),
      zoom: (from, to) => this.#zoom(from, to),
    });
    this.table = row_table({ study: this.study.id, points: this.study.points, columns: () => this.#row_columns(),
      where: () => this.is("where"), keep_where: (where) => { this.set({ where }); this.#tell_commands(); },
      order: () => this.is("order"), keep_order: (order) => { this.set({ order }); this.#tell_commands(); }, may_say: () => {},
      chosen: (point) => this.#choose_point(point) });
    this.root.append(h("h2", { class: "name" }, this.study.name), this.standing, this.said,
      h("div", { class: "beside" },
        h("section", { class: "picture", "aria-label": "Picture" }, this.controls, this.sliders, this.map.element, this.lines_place,
          this.spoken, this.choice, this.solving, this.legend, this.colour_row, this.facts),
        this.table.element),
      h("section", {}, h("h2", {}, "Take it with you"), this.commands));
    show_controls(this);
    this.load();
    this.table.load();
    return this;
  }

  close() {
    this.looking?.stop.abort();
    this.asked?.abort();
    this.table.close();
    this.map.close();
    this.lines?.close();
    clearTimeout(this.later);
  }

  /** @param {any} now */
  take(now) {
    const told = now.studies.find((/** @type {any} */ s) => s.id === this.study.id);
    if (!told && this.standing.childElementCount > 0 && this.settled === "") return;
    if (told) {
      this.#stand(told);
    } else {
      json(`/api/studies?limit=1&after=${this.study.id - 1}`).then((page) => {
        if (page.studies[0]?.id === this.study.id) this.#stand(page.studies[0]);
      }, () => {});
    }
    const settled = told ? `${told.solved + told.failed}` : "";
    if (settled !== this.settled && !this.looking) {
      this.settled = settled;
      const wait = Math.max(kLookAgain_ms - (performance.now() - this.loaded_ms), 0);
      clearTimeout(this.later);
      this.later = setTimeout(() => this.load(), wait);
    }
  }

  /** @param {any} told */
  #stand(told) {
    const text = JSON.stringify([told.state, told.solved, told.failed]);
    if (text === this.stood) return;
    this.stood = text;
    this.standing.replaceChildren(told.state, progress_of(told), `${count(told.points)} points`,
      told.failed > 0 ? h("span", { class: "bad" }, `${count(told.failed)} failed`) : "",
      told.state === "running" && told.waits_for ? h("span", { class: "weak" }, `waits for ${told.waits_for}`) : "",
      this.place.may_change ? study_buttons(told, (text_, is_bad = false) => {
        this.said.textContent = text_;
        this.said.className = is_bad ? "said bad" : "said";
      }) : "");
  }

  #row_columns() {
    const keys = new Set(["point", "H", "mu", "e"]);
    for (const key of [this.is("x"), this.is("y"), this.is("z")]) {
      if (this.columns.some((c) => c.name === key)) keys.add(key);
    }
    keys.add("mode");
    return [...keys];
  }

  /** Numbers of the values at which the other axes are held. @returns {Map<string, number>} */
  places() {
    const places = new Map();
    for (const one of this.is("at").split(",").filter((text) => text.includes("@"))) {
      const [key, number] = one.split("@");
      places.set(key, Number(number));
    }
    return places;
  }

  /** What the server is asked for. */
  #question() {
    const kind = this.is("pic");
    const zoom = Object.fromEntries(["x0", "x1", "y0", "y1"].filter((name) => this.is(name)).map((name) => [name, this.is(name)]));
    if (kind === "map" || kind === "lines") {
      const keys = own_axes(this.block).map((a) => a.key);
      const at = [...this.places()].filter(([key]) => keys.includes(key) && key !== this.is("x") && key !== this.is("y")).map(([key, n]) => `${key}@${n}`).join(",");
      return { z: this.is("z"), x: this.is("x"), ...(this.is("y") ? { y: this.is("y") } : {}), ...(at ? { at } : {}), block: this.is("block"),
        nx: kMostCells, ny: kind === "lines" ? kMostLines : kMostCells, ...zoom };
    }
    // A few points a bin.
    const bins_a_side = Math.round(Math.min(Math.max(Math.sqrt(this.study.points / 3), 6), kMostBins));
    return { x: this.is("x"), nx: kind === "histogram" ? Math.min(bins_a_side * 2, 64) : bins_a_side, ...(this.is("xlog") ? { xlog: 1 } : {}), ...zoom,
      ...(kind === "gathered" ? { y: this.is("y"), ny: bins_a_side, ...(this.is("ylog") ? { ylog: 1 } : {}), ...(this.is("z") ? { z: this.is("z") } : {}) } : {}) };
  }

  /** Asks for the picture; what is asked for meanwhile comes after it, and only the last of that. */
  async load() {
    this.looking?.stop.abort();
    this.looking = null;
    if (this.asked) {
      this.wants_more = true;
      return;
    }
    this.asked = new AbortController();
    const { signal } = this.asked;
    const kind = this.is("pic");
    try {
      const begun = performance.now();
      const ask = kind === "map" || kind === "lines" ? slice : bins;
      this.picture = await ask(this.study.id, /** @type {any} */ (this.#question()), signal, this.unit_of);
      this.picture_kind = kind;
      if (signal.aborted || this.looking) return;
      this.loaded_ms = performance.now();
      this.show();
      this.root.dataset.pictureMs = String(Math.round(performance.now() - begun));
      this.said.textContent = "";
    } catch (error) {
      if (!signal.aborted) this.#complain(error);
    } finally {
      this.asked = null;
    }
    if (this.wants_more) {
      this.wants_more = false;
      this.load();
    }
  }

  /** @param {boolean} [is_naming] somebody writes into a field beside the picture */
  show(is_naming = false) {
    const picture = this.picture;
    const kind = this.is("pic");
    if (!picture || kind !== this.picture_kind) return;
    const is_map = kind === "map" || kind === "gathered";
    this.map.element.hidden = !is_map;
    this.spoken.hidden = !is_map;
    this.lines?.close();
    this.lines = null;
    this.lines_place.replaceChildren();
    this.legend.replaceChildren();
    if (is_map) {
      const look = this.#look(picture);
      this.map.show(picture, look);
      this.legend.append(picture.z.is_category ? categories(picture) : colour_bar(picture, look), gaps(picture));
      const chosen = this.map.chosen;
      if (chosen && chosen[0] < picture.x.values.length && chosen[1] < picture.y.values.length) this.#choose(chosen);
      else if (this.is("cell") && !this.looking) this.#choose_point(Number(this.is("cell")));
    } else {
      import("./drawn_lines.js").then(({ drawn_lines }) => {
        if (picture !== this.picture) return;
        this.lines?.close();
        this.lines = drawn_lines(picture, { as_bars: kind === "histogram", x_log: this.is("xlog") !== "", y_log: this.is("ylog") !== "" });
        this.lines_place.replaceChildren(this.lines.element);
      });
    }
    this.#tell_facts(picture);
    this.#tell_commands();
    if (!is_naming) this.#offer_solving();
  }

  #offer_solving() {
    const may = this.place.may_change && this.is("pic") === "map";
    this.solving.replaceChildren();
    if (!may) return;
    if (!this.looking) {
      this.solving.append(h("button", { type: "button", class: "finer", onclick: () => this.#solve() }, "Solve what lies between"));
      return;
    }
    const { id } = this.looking;
    const name = h("input", { type: "text", placeholder: "name", "aria-label": "Name under which it is kept", size: 12 });
    this.solving.append(h("button", { type: "button", onclick: () => this.load() }, "Back to the study"), ...(id ? [name,
      h("button", { type: "button", onclick: async () => {
        try {
          const kept = await keep(this.looking?.id ?? id, name.value.trim());
          this.said.replaceChildren("Kept as ", h("a", { href: `#/study/${kept.id}` }, kept.name));
          this.said.className = "said";
        } catch (error) {
          this.#complain(error);
        }
      } }, "Keep it as a study")] : []));
  }

  #complain(/** @type {any} */ error) {
    this.said.textContent = String(error.message);
    this.said.className = "said bad";
  }

  /** Solves the picture finer than the study has it, or a part of it. @param {[number, number]} [from] @param {[number, number]} [to] */
  async #solve(from, to) {
    const picture = this.picture;
    if (!picture) return;
    this.looking?.stop.abort();
    this.asked?.abort();
    const looking = this.looking = { stop: new AbortController(), id: 0 };
    const ends = (/** @type {import("./picture.js").Side} */ side, /** @type {number} */ i, /** @type {string} */ log) => {
      const values = from && to ? [side.values[from[i]], side.values[to[i]]] : [...side.values];
      return { from: Math.min(...values), to: Math.max(...values), is_log: this.is(log) !== "" && Math.min(...values) > 0 };
    };
    const ranges = { [picture.x.name]: ends(picture.x, 0, "xlog"), [picture.y.name]: ends(picture.y, 1, "ylog") };
    const held = Object.fromEntries(picture.head.at.map((/** @type {any} */ one) => [one.key, one.value]));
    this.map.choose(null);
    this.choice.replaceChildren();
    try {
      const near = this.near ?? picture.head.first_point;
      this.near = near;
      for await (const step of finer({ study: this.study.id, block: this.block, near, z: this.is("z"), ranges, held }, looking.stop.signal, this.unit_of)) {
        if (looking.stop.signal.aborted) return;
        looking.id = step.id;
        this.picture = step.picture;
        this.root.dataset.side = String(step.is_whole ? step.side : 0);
        this.picture_kind = "map";
        this.show(document.activeElement instanceof HTMLInputElement && this.solving.contains(document.activeElement));
      }
    } catch (error) {
      if (!looking.stop.signal.aborted) this.#complain(error);
    }
  }

  /** The study that has the points of the picture. */
  get shown_study() {
    return this.looking?.id || this.study.id;
  }

  /** @param {import("./picture.js").Picture} picture @returns {import("./map.js").Look} */
  #look(picture) {
    let from = this.is("from") === "" ? picture.least ?? 0 : Number(this.is("from"));
    let to = this.is("to") === "" ? picture.most ?? 1 : Number(this.is("to"));
    if (to < from) [from, to] = [to, from];
    return { colours: palette(this.is("pal") || "viridis"), from, to, z_log: this.is("zlog") !== "" && from > 0,
      x_log: this.is("xlog") !== "", y_log: this.is("ylog") !== "" };
  }

  /** What is shown of how much. @param {import("./picture.js").Picture} picture */
  #tell_facts(picture) {
    const parts = facts(picture, this.is("pic"));
    if (this.is("x0") || this.is("y0")) {
      this.facts.replaceChildren(parts.join(" "), " ", h("button", { type: "button", onclick: () => this.#zoom(null) }, "Show all"));
    } else {
      this.facts.textContent = parts.join(" ") + (this.is("pic") === "map" ? " Drag over the map to zoom in." : "");
    }
  }

  #tell_commands() {
    const picture = this.picture;
    if (!picture) return;
    const at = (picture.head.at ?? []).filter((/** @type {any} */ a) => a.of > 1).map((/** @type {any} */ a) => `${a.key}=${a.value}`);
    const inside = [];
    for (const [side, name] of /** @type {[import("./picture.js").Side, string][]} */ ([[picture.x, "x"], [picture.y, "y"]])) {
      if (this.is(`${name}0`) === "") continue;
      const ends = side.edges ? [side.edges[0], side.edges.at(-1)] : [Math.min(...side.values), Math.max(...side.values)];
      inside.push(`${side.name} >= ${ends[0]}`, `${side.name} <= ${ends[1]}`);
    }
    this.commands.replaceChildren(
      h("p", {}, "The picture, as SVG:"), copied("the command of the picture", plot_command(this.study.name, this.fields, at, inside)),
      h("p", {}, "The rows:"), copied("the command of the rows", query_command(this.study.name, this.#row_columns(), this.is("where"), this.is("order"))),
      h("p", { class: "weak" }, "Add --db FILE or --server ADDRESS where the database is not oblique.db. The address of this view is a link to it."),
      h("div", { class: "row" }, h("button", { type: "button", onclick: () => save("picture.csv", "text/csv", cells_csv(picture)) }, "Picture's numbers as CSV"),
        h("button", { type: "button", onclick: () => navigator.clipboard?.writeText(location.href) }, "Copy the link")));
  }

  /** @param {[number, number] | null} cell */
  #speak(cell) {
    this.spoken.textContent = cell && this.picture ? sentence(this.picture, cell) : "Point at a cell, or move with the arrow keys.";
  }

  /** @param {[number, number]} cell */
  #choose(cell) {
    this.#speak(cell);
    const point = this.picture?.point(...cell) ?? null;
    this.choice.replaceChildren();
    if (point === null) return;
    this.choice.append(h("a", { class: "button", href: `#/study/${this.shown_study}/point/${point}` }, `Open point ${count(point)}`),
      h("span", { class: "weak" }, " or press Enter, or click twice"));
    if (this.looking) return;
    this.table.choose(point);
    this.set({ cell: String(point) });
  }

  /** @param {[number, number]} cell */
  #open(cell) {
    const point = this.picture?.point(...cell) ?? null;
    if (point !== null) location.hash = `#/study/${this.shown_study}/point/${point}`;
  }

  /** Marks the cell of a point, where the picture shows it. @param {number} point */
  #choose_point(point) {
    const picture = this.picture;
    this.table.choose(point);
    if (!picture?.head.x?.stride) return;
    for (let row = 0; row < picture.y.values.length; ++row) {
      const offset = point - /** @type {number} */ (picture.point(0, row));
      const column = offset / picture.head.x.stride;
      const found = (picture.x.numbers ?? []).indexOf(column + (picture.x.numbers?.[0] ?? 0));
      if (Number.isInteger(column) && found >= 0) {
        this.map.choose([found, row]);
        this.#choose([found, row]);
        return;
      }
    }
    this.map.choose(null);
    this.choice.replaceChildren(h("a", { class: "button", href: `#/study/${this.study.id}/point/${point}` }, `Open point ${count(point)}`),
      h("span", { class: "weak" }, " (it lies outside this picture)"));
  }

  /** @param {[number, number] | null} from @param {[number, number]} [to] */
  #zoom(from, to) {
    const picture = this.picture;
    if (!picture) return;
    if (this.looking && from && to) {
      this.#solve(from, to);
      return;
    }
    if (!from || !to) {
      this.set({ x0: "", x1: "", y0: "", y1: "" });
    } else {
      const ends = (/** @type {import("./picture.js").Side} */ side, /** @type {number} */ a, /** @type {number} */ b) => (side.edges
        ? [side.edges[Math.min(a, b)], side.edges[Math.max(a, b) + 1]]
        : [Math.min(side.numbers?.[a] ?? 0, side.numbers?.[b] ?? 0), Math.max(side.numbers?.[a] ?? 0, side.numbers?.[b] ?? 0)]).map(String);
      const [x0, x1] = ends(picture.x, from[0], to[0]);
      const [y0, y1] = ends(picture.y, from[1], to[1]);
      this.set({ x0, x1, y0, y1 });
    }
    this.map.choose(null);
    this.load();
  }
}
