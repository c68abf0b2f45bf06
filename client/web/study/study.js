// @ts-check
// A study: a picture of any output over any axes, what it means, and the rows beside it.
import { copied, h, named, picker, save, tick } from "/parts/dom.js";
import { palette } from "/parts/colours.js";
import { count, heading, shown } from "/parts/format.js";
import { json } from "/server.js";
import { progress_of, study_buttons } from "/overview.js";
import { axis_value, own_axes, usual_axes, usual_block, varying } from "./axes.js";
import { plot_command, query_command } from "./command.js";
import { categories, colour_bar, colour_controls, gaps } from "./legend.js";
import { MapCanvas } from "./map.js";
import { bins, slice } from "./picture.js";
import { row_table } from "./table.js";

const kMostCells = 512; // a side of a picture
const kBins = 64;
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

class StudyView {
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
    this.loaded_ms = 0;
    this.settled = "";
    this.#fill_in();
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

  /** What the address leaves open. */
  #fill_in() {
    const usual = usual_block(this.study.blocks);
    if (!this.is("pic")) this.fields.set("pic", usual >= 0 ? (varying(this.study.blocks[usual]).length > 1 ? "map" : "lines") : "gathered");
    if (this.is("pic") === "map" || this.is("pic") === "lines") {
      const wanted = Number(this.is("block") || usual);
      const block = this.study.blocks[wanted];
      if (block && varying(block).length > 0) {
        this.fields.set("block", String(wanted));
        const keys = varying(block).map((a) => a.key);
        const [x, y] = usual_axes(block);
        if (!keys.includes(this.is("x"))) this.fields.set("x", x);
        if (this.is("y") && !keys.includes(this.is("y"))) this.fields.delete("y");
        if (this.is("y") === this.is("x")) this.fields.delete("y");
        if (!this.is("y") && this.is("pic") === "map") {
          const other = [y, ...keys].find((key) => key && key !== this.is("x"));
          if (other) this.fields.set("y", other);
          else this.fields.set("pic", "lines");
        }
      }
    } else {
      const has = (/** @type {string} */ name) => this.numbers.some((c) => c.name === name);
      if (!has(this.is("x"))) this.fields.set("x", this.is("pic") === "histogram" ? "fn_peak_N" : "mu");
      if (this.is("pic") === "gathered" && !has(this.is("y"))) this.fields.set("y", "H");
    }
    const is_there = this.columns.some((c) => c.name === this.is("z") && c.picture !== "none");
    if (!is_there && !(this.is("pic") === "gathered" && this.fields.has("z"))) this.fields.set("z", "fn_peak_N");
    if (this.is("pic") !== "map" && this.columns.find((c) => c.name === this.is("z"))?.picture === "categories") this.fields.set("z", "fn_peak_N");
  }

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
          this.spoken, this.choice, this.legend, this.colour_row, this.facts),
        this.table.element),
      h("section", {}, h("h2", {}, "Take it with you"), this.commands));
    this.#controls();
    this.load();
    this.table.load();
    return this;
  }

  close() {
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
    if (settled !== this.settled) {
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

  #controls() {
    const kind = this.is("pic");
    const again = (/** @type {Record<string, string>} */ changes) => {
      this.set({ ...changes, x0: "", x1: "", y0: "", y1: "" });
      this.#fill_in();
      this.place.keep(this.fields);
      this.map.choose(null);
      this.choice.replaceChildren();
      this.#controls();
      this.load();
      this.table.load();
    };
    const kinds = [...(this.grids.some((/** @type {any} */ g) => varying(g.b).length > 1) ? [["map", "map"]] : []),
      ...(this.grids.length > 0 ? [["lines", "lines"]] : []), ["gathered", "gathered points"], ["histogram", "histogram"]];
    const on_grid = kind === "map" || kind === "lines";
    const axes = on_grid ? varying(this.block).map((a) => [a.key, heading(a.key, a.unit)])
      : this.numbers.map((c) => [c.name, heading(c.name, c.unit)]);
    const outputs = this.columns.filter((c) => c.picture === "numbers" || (kind === "map" && c.picture === "categories"))
      .map((c) => [c.name, heading(c.name, c.unit)]);
    const parts = [named("picture", picker(kinds, kind, (pic) => again({ pic, y: "", from: "", to: "" })))];
    if (kind !== "histogram") {
      parts.push(named(kind === "gathered" ? "colour" : "output", picker(kind === "gathered" ? [["", "number of points"], ...outputs] : outputs, this.is("z"), (z) => {
        if (z === "") this.fields.set("z", "");
        again({ ...(z === "" ? {} : { z }), from: "", to: "" });
      })));
    }
    if (on_grid && this.grids.length > 1) {
      parts.push(named("block", picker(this.grids.map((/** @type {any} */ g) => [String(g.i), `${g.i + 1}: ${varying(g.b).map((a) => `${a.values} ${a.key}`).join(" × ")}`]),
        this.is("block"), (block) => again({ block, at: "" }))));
    }
    parts.push(named(kind === "histogram" ? "of" : "across", picker(axes, this.is("x"), (x) => again({ x, ...(x === this.is("y") ? { y: on_grid ? this.is("x") : "" } : {}) }))));
    if (kind !== "histogram" && axes.length > 1) {
      parts.push(named(kind === "lines" ? "a line for each" : "upwards", picker(kind === "lines" ? [["", "none"], ...axes.filter(([k]) => k !== this.is("x"))] : axes,
        this.is("y"), (y) => again({ y, ...(y === this.is("x") ? { x: this.is("y") } : {}) }))));
    }
    const redraw = (/** @type {Record<string, string>} */ changes) => {
      this.set(changes);
      if (kind === "map") this.#show();
      else this.load();
    };
    parts.push(h("div", { class: "ticks" }, tick(`log ${this.is("x")}`, this.is("xlog") !== "", (is) => redraw({ xlog: is ? "1" : "" })),
      kind === "histogram" ? null : tick(kind === "lines" ? "log output" : `log ${this.is("y")}`, this.is("ylog") !== "", (is) => redraw({ ylog: is ? "1" : "" }))));
    this.controls.replaceChildren(...parts);
    this.#sliders(on_grid);
    const has_bar = (kind === "map" || kind === "gathered") && this.columns.find((c) => c.name === this.is("z"))?.picture !== "categories";
    this.colour_row.replaceChildren(...(has_bar ? [colour_controls({ from: this.is("from"), to: this.is("to"), is_log: this.is("zlog") !== "", palette: this.is("pal") || "viridis" },
      (changed) => {
        this.set(/** @type {any} */ (changed));
        if ("from" in changed && "to" in changed) this.#controls();
        this.#show();
      })] : []));
  }

  /** Numbers of the values at which the other axes are held. @returns {Map<string, number>} */
  #at() {
    const places = new Map();
    for (const one of this.is("at").split(",").filter((text) => text.includes("@"))) {
      const [key, number] = one.split("@");
      places.set(key, Number(number));
    }
    return places;
  }

  #sliders(/** @type {boolean} */ on_grid) {
    const others = on_grid ? varying(this.block).filter((a) => a.key !== this.is("x") && a.key !== this.is("y")) : [];
    const places = this.#at();
    this.sliders.replaceChildren(...others.map((axis) => {
      const number = Math.min(places.get(axis.key) ?? 0, axis.values - 1);
      const out = h("output", { "data-axis": axis.key }, this.#held(axis, number));
      const slider = h("input", { type: "range", min: 0, max: axis.values - 1, step: 1, value: number, "aria-label": `${axis.key}, held at`,
        "aria-valuetext": this.#held(axis, number), oninput: () => {
          const now = this.#at();
          now.set(axis.key, Number(slider.value));
          out.textContent = this.#held(axis, Number(slider.value));
          slider.setAttribute("aria-valuetext", out.textContent);
          this.set({ at: [...now].map(([key, n]) => `${key}@${n}`).join(",") });
          this.load();
        } });
      return h("div", { class: "slider" }, h("span", {}, axis.key), slider, out);
    }));
  }

  /** @param {any} axis @param {number} number */
  #held(axis, number) {
    const value = axis_value(axis, number);
    return value === undefined ? `value ${number + 1} of ${count(axis.values)}` : `${shown(value)} ${axis.unit === "1" ? "" : axis.unit}`;
  }

  /** What the server is asked for. */
  #question() {
    const kind = this.is("pic");
    const zoom = Object.fromEntries(["x0", "x1", "y0", "y1"].filter((name) => this.is(name)).map((name) => [name, this.is(name)]));
    if (kind === "map" || kind === "lines") {
      const keys = own_axes(this.block).map((a) => a.key);
      const at = [...this.#at()].filter(([key]) => keys.includes(key) && key !== this.is("x") && key !== this.is("y")).map(([key, n]) => `${key}@${n}`).join(",");
      return { z: this.is("z"), x: this.is("x"), ...(this.is("y") ? { y: this.is("y") } : {}), ...(at ? { at } : {}), block: this.is("block"),
        nx: kMostCells, ny: kind === "lines" ? kMostLines : kMostCells, ...zoom };
    }
    return { x: this.is("x"), nx: kBins, ...(this.is("xlog") ? { xlog: 1 } : {}), ...zoom,
      ...(kind === "gathered" ? { y: this.is("y"), ny: kBins, ...(this.is("ylog") ? { ylog: 1 } : {}), ...(this.is("z") ? { z: this.is("z") } : {}) } : {}) };
  }

  /** Asks for the picture; what is asked for meanwhile comes after it, and only the last of that. */
  async load() {
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
      if (signal.aborted) return;
      this.loaded_ms = performance.now();
      if (kind === this.is("pic")) this.#show();
      this.root.dataset.pictureMs = String(Math.round(performance.now() - begun));
      this.said.textContent = "";
    } catch (error) {
      if (signal.aborted) return;
      this.said.textContent = String(/** @type {Error} */ (error).message);
      this.said.className = "said bad";
    } finally {
      this.asked = null;
    }
    if (this.wants_more) {
      this.wants_more = false;
      this.load();
    }
  }

  #show() {
    const picture = this.picture;
    if (!picture) return;
    const kind = this.is("pic");
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
      if (!this.map.chosen && this.is("cell")) this.#choose_point(Number(this.is("cell")));
    } else {
      this.#draw_lines(picture);
    }
    this.#tell_facts(picture);
    this.#tell_commands();
  }

  /** @param {import("./picture.js").Picture} picture @returns {import("./map.js").Look} */
  #look(picture) {
    let from = this.is("from") === "" ? picture.least ?? 0 : Number(this.is("from"));
    let to = this.is("to") === "" ? picture.most ?? 1 : Number(this.is("to"));
    if (to < from) [from, to] = [to, from];
    return { colours: palette(this.is("pal") || "viridis"), from, to, z_log: this.is("zlog") !== "" && from > 0,
      x_log: this.is("xlog") !== "", y_log: this.is("ylog") !== "" };
  }

  /** @param {import("./picture.js").Picture} picture */
  async #draw_lines(picture) {
    const { line_plot } = await import("/parts/lines.js");
    if (picture !== this.picture) return;
    const order = Array.from(picture.x.values.keys()).sort((a, b) => picture.x.values[a] - picture.x.values[b]);
    const nx = picture.x.values.length;
    const as_bars = this.is("pic") === "histogram";
    const series = Array.from(picture.y.values.keys()).map((row) => ({
      label: picture.y.name ? `${picture.y.name} = ${shown(picture.y.values[row])}` : picture.z.name,
      values: order.map((i) => {
        const value = as_bars ? picture.head.counts[i] : picture.values[row * nx + i];
        return Number.isFinite(value) && !(this.is("ylog") && value <= 0) ? value : null;
      }) }));
    const xs = order.map((i) => picture.x.values[i]);
    this.lines?.close();
    this.lines = line_plot({ title: as_bars ? `How often values of ${picture.x.name} are met` : `${picture.z.name} over ${picture.x.name}`,
      x: { name: picture.x.name, unit: picture.x.unit, values: xs, is_log: this.is("xlog") !== "" && xs[0] > 0 },
      y: { name: as_bars ? "points" : picture.z.name, unit: as_bars ? "" : picture.z.unit, is_log: this.is("ylog") !== "" && !as_bars }, series, as_bars, height: 380 });
    this.lines_place.replaceChildren(this.lines.element);
  }

  /** What is shown of how much. @param {import("./picture.js").Picture} picture */
  #tell_facts(picture) {
    const parts = [];
    if (picture.head.nx !== undefined) {
      const whole = (/** @type {any} */ side, /** @type {any} */ told) => told && !side.is_whole;
      parts.push(`${count(picture.head.nx)}${picture.y.name ? ` × ${count(picture.head.ny)}` : ""} cells, ${count(picture.head.solved)} solved.`);
      for (const [side, told] of [[picture.x, picture.head.x], [picture.y, picture.head.y]]) {
        if (whole(side, told)) parts.push(`Of ${count(told.last - told.first + 1)} values of ${side.name}, ${count(side.values.length)} are shown, evenly chosen${this.is("pic") === "lines" ? "" : ": zoom in for the others"}.`);
      }
      for (const one of picture.head.at.filter((/** @type {any} */ a) => a.of > 1)) parts.push(`${one.key} = ${shown(one.value)}.`);
    } else {
      parts.push(`${count(picture.head.points)} points in ${count(picture.values.length)} bins${picture.head.outside > 0 ? `, ${count(picture.head.outside)} outside` : ""}.`);
    }
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
      h("div", { class: "row" }, h("button", { type: "button", onclick: () => this.#save_cells() }, "Picture's numbers as CSV"),
        h("button", { type: "button", onclick: () => navigator.clipboard?.writeText(location.href) }, "Copy the link")));
  }

  #save_cells() {
    const picture = /** @type {import("./picture.js").Picture} */ (this.picture);
    const nx = picture.x.values.length;
    const lines = [[picture.x.name, ...(picture.y.name ? [picture.y.name] : []), picture.z.name, "point"].join(",")];
    for (let cell = 0; cell < picture.values.length; ++cell) {
      const column = cell % nx;
      const row = Math.floor(cell / nx);
      const value = picture.why_empty(cell) ? "" : picture.z.is_category ? picture.dictionary[picture.values[cell]].text : picture.values[cell];
      lines.push([picture.x.values[column], ...(picture.y.name ? [picture.y.values[row]] : []), value, picture.point(column, row) ?? ""].join(","));
    }
    save("picture.csv", "text/csv", lines.join("\r\n") + "\r\n");
  }

  /** What a cell shows, in words. @param {[number, number]} cell */
  #sentence([column, row]) {
    const picture = /** @type {import("./picture.js").Picture} */ (this.picture);
    const cell = row * picture.x.values.length + column;
    const why = picture.why_empty(cell);
    const text = why ? { missing: "not solved", failed: "failed", left_out: picture.head.counts ? "no points" : "left out", none: "no value" }[why]
      : picture.z.is_category ? picture.dictionary[picture.values[cell]].text
        : `${shown(picture.values[cell])} ${picture.z.unit}`;
    const side = (/** @type {any} */ s, /** @type {number} */ i) => `${s.name} ${shown(s.values[i])}${s.unit && s.unit !== "1" ? ` ${s.unit}` : ""}`;
    const many = picture.head.counts ? `, ${count(picture.head.counts[cell])} points` : "";
    return `${side(picture.x, column)}, ${side(picture.y, row)}: ${picture.z.name} ${text}${many}`;
  }

  /** @param {[number, number] | null} cell */
  #speak(cell) {
    this.spoken.textContent = cell && this.picture ? this.#sentence(cell) : "Point at a cell, or move with the arrow keys.";
  }

  /** @param {[number, number]} cell */
  #choose(cell) {
    this.#speak(cell);
    const point = this.picture?.point(...cell) ?? null;
    this.choice.replaceChildren();
    if (point === null) return;
    this.choice.append(h("a", { class: "button", href: `#/study/${this.study.id}/point/${point}` }, `Open point ${count(point)}`),
      h("span", { class: "weak" }, " or press Enter, or click twice"));
    this.table.choose(point);
    this.set({ cell: String(point) });
  }

  /** @param {[number, number]} cell */
  #open(cell) {
    const point = this.picture?.point(...cell) ?? null;
    if (point !== null) location.hash = `#/study/${this.study.id}/point/${point}`;
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
