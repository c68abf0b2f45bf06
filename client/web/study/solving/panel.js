// @ts-check
// What the study lacks is solved while somebody looks: offered, shown as it becomes finer, kept. The address says what it is of.
import { h } from "/parts/dom.js";
import { Refusal } from "/server.js";
import { wanted_of } from "../asked/between.js";
import { finer } from "../asked/look.js";
import { varying } from "../axes.js";
import { between_of, ends_fields } from "./ends.js";
import { keeping } from "./keeping.js";
import { is_lacking, unasked } from "./unasked.js";

const kSettled_ms = 100;

/** @typedef {import("../study.js").StudyView} View */

/** @param {View} view */
export const solving_panel = (view) => new SolvingPanel(view);

class SolvingPanel {
  /** @param {View} view */
  constructor(view) {
    this.view = view;
    /** @type {AbortController | null} */
    this.stop = null;
    /** The study that the server made of it; 0: none. */
    this.id = 0;
    /** Cells a side of the picture. */
    this.side = 0;
    /** Of what the last picture was. */
    this.shown = "";
    /** What is solved, as a recipe has it. @type {any} */
    this.block = null;
    /** The view that was solved last. @type {{x: string, y: string, between: string} | null} */
    this.solved = null;
    this.begin = h("button", { type: "button", class: "finer", hidden: true, onclick: () => this.solve(null) }, "Solve what lies between");
    this.back = h("button", { type: "button", hidden: true, onclick: () => this.#go_back() }, "Back to the study");
    this.ends = ends_fields(view, (between) => this.#solve_between(between, true));
    this.keeping = keeping(view, () => ({ id: this.id, side: this.side, is_of: `${this.shown} ${this.side}` }));
    this.unasked = unasked(view, () => this.#solve_between(between_of(view, null), false), () => this.is_on);
    this.element = h("div", {}, this.ends.element, h("div", { class: "row solving" }, this.begin, this.unasked.element, this.back, this.keeping.name, this.keeping.button), this.keeping.told);
  }

  get is_on() {
    return this.stop !== null;
  }
  /** The name under which what is shown was kept; empty: it was not. */
  get kept_as() {
    return this.keeping.kept_as;
  }

  end() {
    this.stop?.abort();
    this.stop = this.block = this.solved = null;
    this.id = this.side = 0;
    this.shown = "";
    this.unasked.stop();
    this.view.drawing.tell_coming(0, 0);
  }

  offer() {
    this.begin.hidden = !this.view.place.may_change || this.view.is("pic") !== "map" || this.is_on;
    this.back.hidden = !this.is_on;
    this.ends.show();
    this.keeping.offer();
    this.unasked.offer();
    if (!this.is_on) this.keeping.told.replaceChildren();
  }

  /** Solves the picture finer than the study has it, or a part of it. @param {import("../drawn/brush.js").Rectangle | null} part */
  solve(part) {
    if (this.view.picture) this.#solve_between(between_of(this.view, part), true);
  }

  /** @param {string} between @param {boolean} is_step that people go back over */
  #solve_between(between, is_step) {
    this.view.set({ between, cell: "" }, is_step);
    this.view.choice.none();
    this.view.load();
  }

  /** The study's own cells stay until somebody asks for others. */
  async #go_back() {
    this.view.show_own(true);
    await this.view.load();
    if (!is_lacking(this.view)) return;
    this.view.set({ solve: "off" });
    this.offer();
  }

  /** Solves what the address says; another output is drawn from the same points. */
  async go_on() {
    const { view } = this;
    const was_on = this.is_on;
    view.stop_asking();
    this.unasked.stop();
    this.stop?.abort();
    view.drawing.tell_coming(0, 0);
    this.stop = new AbortController();
    const { signal } = this.stop;
    this.offer();
    try {
      if (!view.place.may_change) throw new Refusal(403, "What a study lacks is solved for those who may change studies.");
      const wanted = await wanted_of(view.study, view.fields, signal);
      const what = JSON.stringify([view.is("block"), wanted.ranges, wanted.held]);
      if (what !== this.shown) {
        // A slider that is dragged has many places.
        if (was_on) await new Promise((go) => setTimeout(go, kSettled_ms));
        if (signal.aborted) return;
        this.shown = what;
        this.side = this.id = 0;
        this.offer();
      }
      for await (const { id, side, block, is_whole, picture } of finer(wanted, this.side, signal, view.unit_of, (finer_side, share) => view.drawing.tell_coming(finer_side, share))) {
        if (signal.aborted) return;
        view.drawing.tell_coming(0, 0);
        Object.assign(this, { id, side, block, solved: { x: view.is("x"), y: view.is("y"), between: view.is("between") } });
        picture.held = varying(view.block).filter((axis) => axis.key in wanted.held).map((axis) => ({ key: axis.key, value: wanted.held[axis.key] }));
        view.root.dataset.side = String(is_whole ? side : 0);
        view.show(picture, "map");
      }
    } catch (error) {
      if (!signal.aborted) await this.#give_up(error);
    }
  }

  /** What is refused goes out of the address: what was solved before it is shown again, or the study. @param {any} error */
  async #give_up(error) {
    const { view, solved } = this;
    if (!error.status) {
      this.end();
      this.offer();
    } else if (solved && solved.x === view.is("x") && solved.y === view.is("y") && solved.between !== view.is("between")) {
      view.set({ between: solved.between });
      this.go_on();
      this.ends.refuse(String(error.message));
      return;
    } else {
      this.end();
      view.show_own(false);
      await view.load();
    }
    view.complain(error);
  }
}
