// The view of a study: picture, points, filter, selection and chosen point.
import { json, retryMs } from "../api.js";
import { CategoryLooks } from "../lib/colours.js";
import { Chart } from "../lib/chart.js";
import { button, h, labelled, setChildren, statusLine } from "../lib/dom.js";
import { count, heading, shownUnit, withUnit } from "../lib/format.js";
import { addressOf, conditionOf, joined, rounded, shownPart } from "./conditions.js";
import { controlsOf } from "./controls.js";
import { factsOf, sentenceOf } from "./describe.js";
import { showExports } from "./exports.js";
import { fillIn, pickedColumns } from "./fields.js";
import { legendOf, spanOf } from "./legend.js";
import { MapCanvas } from "./map.js";
import { askPicture, askSelected, stepsTo } from "./picture.js";
import { refineRow } from "./refine.js";
import { modelLine, statusRow } from "./status.js";
import { PointTable } from "./table.js";

const refreshEveryMs = 1500;

/** Colours and patterns of categories, by study and column; kept while the page is open. */
const looksOfColumns = new Map();

function looksOf(study, column) {
  const key = `${study.id} ${column}`;
  if (!looksOfColumns.has(key)) looksOfColumns.set(key, new CategoryLooks());
  return looksOfColumns.get(key);
}

export async function studyView(root, place, id) {
  const study = await json(`api/studies/${id}`, place.signal);
  place.trail([study.name]);
  return new StudyView(root, place, study);
}

/** Creates the fields for filter and selection, which also show the server's errors. */
function conditionFields(view) {
  const field = (name, text, placeholder, help) => {
    const said = h("p", { role: "status", class: "bad said", id: `said-${name}` });
    const take = ({ target }) => view.change({ [name]: target.value.trim() });
    const settings = { placeholder, spellcheck: false, autocomplete: "off", onchange: take };
    const input = h("input", { type: "search", "aria-describedby": said.id, ...settings });
    return { said, input, label: labelled(text, input, help) };
  };
  const language = "A condition of the query language, as of oblique query --where";
  const where = field(
    "where",
    "Filter",
    "mu > 0.5 AND fn_peak_N > 20",
    `${language}: other points are not shown`,
  );
  const mark = field(
    "mark",
    "Select",
    "drag with Shift, or enter a condition",
    `${language}: these points are marked`,
  );
  const keep = () =>
    view.change({ where: joined(view.field("where"), view.field("mark")), mark: "" });
  const buttons = h(
    "span.buttons",
    button("Use selection as filter", keep),
    button("Clear", () => view.change({ mark: "" })),
  );
  const fields = { where, mark };
  return {
    element: h(
      "div.conditions",
      h("div", where.label, where.said),
      h("div.marks", h("div.row", mark.label, buttons), mark.said),
    ),
    show() {
      for (const [name, { input }] of Object.entries(fields)) input.value = view.field(name);
      buttons.hidden = !view.field("mark");
      this.say("where", "");
      this.say("mark", "");
    },
    say(name, fault) {
      fields[name].said.textContent = fault;
      fields[name].input.setAttribute("aria-invalid", String(fault !== ""));
    },
  };
}

/** Returns the contents for a chart of lines or bars, in shown units. */
function linesOf(view, picture) {
  const { x, y, z, head, labels } = picture;
  const isBars = view.field("pic") === "histogram";
  const isLog = view.field("ylog") !== "" && !isBars;
  const [[xUnit, xFactor], [zUnit, zFactor]] = [x, z].map((one) => shownUnit(one.name, one.unit));
  const order = orderOf(x);
  const valuesOf = (row) =>
    order.map((i) => {
      const value = isBars ? head.counts[i] : picture.values[row * x.values.length + i] * zFactor;
      return Number.isFinite(value) && !(isLog && value <= 0) ? value : null;
    });
  const labelOf = (value) => (y.name ? `${y.name} = ${withUnit(value, y.name, y.unit)}` : z.name);
  const series = Array.from(y.values, (value, row) => ({
    label: isBars ? "all" : (labels?.[row] ?? labelOf(value)),
    values: valuesOf(row),
  }));
  const { counts, cells } = view.selected ?? {};
  if (isBars && counts) series.push({ label: "selected", values: order.map((i) => counts[i]) });
  else if (cells) {
    const isIn = (row, k) => cells[row * order.length + order[k]] > 0;
    const thick = ({ label, values }, row) => ({
      label: `${label} (selected)`,
      values: values.map((value, k) => (isIn(row, k) ? value : null)),
      look: row,
      isThick: true,
    });
    series.push(...series.map(thick));
  }
  const values = order.map((i) => x.values[i] * xFactor);
  const ends = x.edges ? [x.edges[0], x.edges.at(-1)].map((end) => end * xFactor) : undefined;
  const inUnits = (part) =>
    part && {
      x: part.x.map((value) => value / xFactor),
      y: isBars ? null : (part.y?.map((value) => value / zFactor) ?? null),
    };
  return {
    title: isBars ? `Distribution of ${x.name}` : `${z.name} over ${x.name}`,
    x: {
      label: heading(x.name, x.unit),
      name: x.name,
      unit: xUnit,
      values,
      ends,
      isLog: view.field("xlog") !== "" && values[0] > 0,
    },
    y: {
      label: isBars ? "points" : heading(z.name, z.unit),
      unit: isBars ? "" : zUnit,
      isLog,
      ends: view.hasSpan && !isBars ? spanOf(view, picture).map((end) => end * zFactor) : undefined,
    },
    series,
    isBars,
    dragSelects: view.field("drag") === "select",
    height: 380,
    zoom: (part) => view.zoom(inUnits(part)),
    select: (part) => view.selectPart(inUnits(part)),
  };
}

const orderOf = ({ values }) => [...values.keys()].sort((a, b) => values[a] - values[b]);

export class StudyView {
  picture = null;
  /** The selected cells or points of the picture, as askSelected returns them. */
  selected = null;
  #asked = null;
  #askedSelected = null;
  #wantsMore = false;
  #isStale = false;
  #isOld = false;
  #isRefreshing = false;
  #chart = null;

  constructor(root, place, study) {
    Object.assign(this, { root, place, study, fields: place.fields });
    this.columns = pickedColumns(study);
    fillIn(this.fields, study);
    ({ element: this.said, say: this.say } = statusLine());
    this.status = statusRow(this, () => this.#refresh());
    this.conditions = conditionFields(this);
    this.controls = controlsOf(this);
    this.legend = h("div.colours");
    this.map = new MapCanvas({
      hover: (cell) => this.#speak(cell ?? this.map.chosen),
      choose: (cell, point) => this.choose(point ?? this.picture.point(...cell), cell),
      open: () => this.field("cell") && place.go(this.pointAddress(this.field("cell"))),
      zoom: (part) => this.zoom(part),
      select: (part) => this.selectPart(part),
    });
    this.lines = h("div");
    this.reading = h("p.reading", { "aria-live": "polite" });
    this.choice = h("p.choice");
    this.facts = h("p.weak.facts");
    this.refine = refineRow(this);
    this.table = new PointTable(this);
    this.exports = h("div.commands");
    const picture = h(
      "section.picture",
      { "aria-label": "Picture" },
      this.controls.element,
      this.legend,
      this.map.element,
      this.lines,
      this.reading,
      this.choice,
      this.facts,
      this.refine.element,
    );
    root.append(
      h("h2.name", study.name),
      this.status.element,
      this.said,
      this.conditions.element,
      h("div.beside", picture, this.table.element),
      h("section", h("h2", "Export"), this.exports),
    );
    this.#showAddress();
    // The server answers in order, so this request is sent after those for picture and table.
    this.status.element.after(modelLine(study, place.signal));
  }

  field(name) {
    return this.fields.get(name) ?? "";
  }

  /** Changes fields of the address. With `isStep`, the browser's Back undoes the change. */
  set(changes, isStep = false) {
    for (const [name, value] of Object.entries(changes)) {
      if (value === "") this.fields.delete(name);
      else this.fields.set(name, value);
    }
    this.place.keep(this.fields, isStep);
  }

  /** The block that a picture of a grid shows; undefined if the picture is not of a grid. */
  get block() {
    const isOfGrid = ["map", "lines"].includes(this.field("pic")) && this.field("block") !== "";
    return isOfGrid ? this.study.blocks[Number(this.field("block"))] : undefined;
  }
  get hasMap() {
    return ["map", "scatter"].includes(this.field("pic"));
  }
  /** Whether the address gives a range for the colours or for the axis of lines. */
  get hasSpan() {
    return ["from", "to"].some(
      (end) => this.field(end) !== "" && Number.isFinite(Number(this.field(end))),
    );
  }
  /** Returns a Map from the key of each fixed axis to the index of its selected value. */
  places() {
    const held = this.field("at")
      .split(",")
      .filter((one) => one.includes("@"));
    return new Map(held.map((one) => one.split("@")).map(([key, number]) => [key, Number(number)]));
  }
  columnOf(name) {
    return this.study.columns.find((one) => one.name === name);
  }
  unitOf(name) {
    const keys = [...this.study.blocks.flatMap((block) => block.axes), ...this.study.model];
    return (this.columnOf(name) ?? keys.find(({ key }) => key === name))?.unit ?? "";
  }
  pointAddress(point) {
    return `#/study/${this.study.id}/point/${point}`;
  }
  /** Returns the conditions on x and y for the zoomed part of the picture. */
  shownParts() {
    if (!this.picture) return [];
    return ["x", "y"].map((name) => shownPart(this.picture[name], this.field(`${name}0`) !== ""));
  }

  /** Shows the picture that another address of the same study describes. */
  goTo(fields) {
    this.fields = fields;
    fillIn(this.fields, this.study);
    this.say("");
    this.#showAddress();
  }
  #showAddress() {
    this.map.dragSelects = this.field("drag") === "select";
    this.conditions.show();
    this.controls.show();
    this.load();
    this.table.load();
  }
  take(now) {
    this.status.take(now);
  }
  reconnected() {
    if (!this.#isStale || this.place.signal.aborted) return;
    this.#isStale = false;
    this.say("");
    this.load();
    this.table.load();
  }
  close() {
    this.#asked?.abort();
    this.#askedSelected?.abort();
    this.table.close();
    this.map.close();
    this.#chart?.close();
  }

  /** Shows an error. The server's error about a condition appears beside the condition's field. */
  complain(error, condition = "") {
    if (error.isSilence) {
      if (!this.#isStale) setTimeout(() => this.reconnected(), retryMs);
      this.#isStale = true;
      this.say("The server does not answer. The last answer is shown.", true);
    } else if (error.status === 400 && condition && this.field(condition)) {
      this.conditions.say(condition, error.message);
    } else {
      this.say(error.message, true);
    }
  }

  /** Loads picture and table again after new results. Only one refresh runs at a time. */
  async #refresh() {
    this.#isOld = true;
    if (this.#isRefreshing) return;
    this.#isRefreshing = true;
    while (this.#isOld && !this.place.signal.aborted) {
      await new Promise((resolve) => setTimeout(resolve, refreshEveryMs));
      this.#isOld = false;
      await Promise.allSettled([
        this.load({ waits: true, isRefresh: true }),
        this.table.load(true),
      ]);
    }
    this.#isRefreshing = false;
  }

  /**
   * Loads the picture. With `waits`, the running request is completed first; otherwise it is
   * cancelled, so that pictures appear while a slider moves.
   */
  async load({ waits = false, isRefresh = false } = {}) {
    if (this.#asked && waits) {
      this.#wantsMore = true;
      return;
    }
    this.#asked?.abort();
    const asked = (this.#asked = new AbortController());
    this.#wantsMore = false;
    const begun = performance.now();
    try {
      for (const cells of stepsTo(this, isRefresh)) {
        const picture = await askPicture(this, cells, asked.signal);
        if (asked.signal.aborted || this.place.signal.aborted) return;
        this.#show(picture);
        this.root.dataset.pictureMs = Math.round(performance.now() - begun);
        if (this.#wantsMore) break;
      }
      this.conditions.say("where", "");
      if (this.said.className.includes("bad")) this.say("");
    } catch (error) {
      if (asked.signal.aborted) return;
      this.complain(error, "where");
    }
    this.#asked = null;
    if (this.#wantsMore) await this.load();
    else await this.#loadSelected();
  }

  #show(picture) {
    this.picture = picture;
    this.selected = null;
    looksOf(this.study, picture.z.name).assign(picture.dictionary);
    this.map.element.hidden = this.reading.hidden = this.choice.hidden = !this.hasMap;
    this.draw();
    this.#showChoice();
    this.refine.offer();
    this.table.load(); // the table loads only if its query has changed
  }

  draw() {
    const { picture } = this;
    if (!picture) return;
    if (this.hasMap) {
      this.#chart?.close();
      this.#chart = null;
      this.lines.replaceChildren();
      this.map.show(picture, this.#look(), this.selected);
    } else {
      this.#drawLines();
    }
    setChildren(this.legend, ...(this.hasMap ? legendOf(this, this.#look()) : []));
    const isPart =
      this.field("x0") || this.field("y0") || (this.field("pic") === "lines" && this.hasSpan);
    const showAll = isPart && button("Show all", () => this.zoom(null));
    setChildren(this.facts, factsOf(this), showAll && " Zoomed. ", showAll);
    showExports(this);
  }
  #look() {
    const [from, to] = spanOf(this, this.picture);
    const looks = looksOf(this.study, this.picture.z.name);
    return {
      from,
      to,
      zLog: this.field("zlog") !== "" && from > 0,
      xLog: this.field("xlog") !== "",
      yLog: this.field("ylog") !== "",
      categories: this.picture.dictionary.map(({ text }) => looks.of(text)),
    };
  }
  #drawLines() {
    const lines = linesOf(this, this.picture);
    if (!this.#chart?.update(lines)) {
      const hadFocus = this.lines.contains(document.activeElement);
      this.#chart?.close();
      this.#chart = new Chart(lines);
      this.lines.replaceChildren(this.#chart.element);
      if (hadFocus) this.#chart.place.focus({ preventScroll: true });
    }
  }
  figure() {
    const title = this.study.name;
    if (this.hasMap) return { title, canvas: this.map.base, legend: this.legend };
    return { ...this.#chart.figure(), title: `${title}: ${this.#chart.lines.title}` };
  }

  change(conditions) {
    this.set({ ...conditions, page: "" }, true);
    this.say("");
    this.conditions.show();
    this.table.load();
    if ("where" in conditions) this.load();
    else this.#loadSelected();
  }
  /** Selects the points that meet a condition; null selects none. */
  select(condition) {
    if ((condition ?? "") !== this.field("mark")) this.change({ mark: condition ?? "" });
  }
  /** Selects the points in a part of the picture; null selects none. */
  selectPart(part) {
    const { picture, study, hasMap } = this;
    this.select(part && picture ? conditionOf(study.blocks, picture, part, hasMap) : null);
  }
  async #loadSelected() {
    this.#askedSelected?.abort();
    const { picture } = this;
    const condition = this.field("mark");
    if (!picture || (!condition && !this.selected)) return;
    const { signal } = (this.#askedSelected = new AbortController());
    try {
      const selected = condition ? await askSelected(this, picture, condition, signal) : null;
      if (signal.aborted || picture !== this.picture) return;
      this.selected = selected;
      this.conditions.say("mark", "");
      this.draw();
      this.root.dataset.selected = condition;
    } catch (error) {
      if (!signal.aborted) this.complain(error, "mark");
    }
  }

  /** Zooms to a part of the picture; null shows all of it. */
  zoom(part) {
    const { picture } = this;
    if (!picture) return;
    const zoomed = { x0: "", x1: "", y0: "", y1: "", page: "" };
    const isLines = this.field("pic") === "lines";
    if (!part && isLines) Object.assign(zoomed, { from: "", to: "" });
    if (part) {
      [zoomed.x0, zoomed.x1] = addressOf(picture.x, part.x);
      if (!this.hasMap && zoomed.x0 === zoomed.x1) return; // a single value gives no line
      if (this.hasMap) [zoomed.y0, zoomed.y1] = addressOf(picture.y, part.y);
      const width = part.y ? part.y[1] - part.y[0] : 0;
      if (isLines && part.y)
        [zoomed.from, zoomed.to] = part.y.map((end) => String(rounded(end, width)));
    }
    this.set(zoomed, true);
    this.load();
    this.table.load();
  }

  #speak(cell) {
    const isThere =
      cell && this.picture && !this.picture.dots && cell[0] < this.picture.x.values.length;
    this.reading.textContent = isThere ? sentenceOf(this.picture, cell) : "";
  }
  /** Chooses a point: marks it in picture and table, and shows a link that opens it. */
  choose(point, cell = this.#cellOf(point)) {
    this.map.choose(cell, this.picture?.dots ? point : null);
    this.#speak(cell);
    this.set({ cell: point === null ? "" : String(point) });
    this.table.choose(point);
    const link = (text) => h("a.button", { href: this.pointAddress(point) }, text);
    setChildren(this.choice, point !== null && link(`Open point ${count(point)}`));
  }
  #showChoice() {
    if (this.field("cell")) this.choose(Number(this.field("cell")));
    else if (!this.map.chosen || this.picture.x.edges) this.choose(null, null);
  }
  /** Returns the cell of a point in the picture, or null. */
  #cellOf(point) {
    const { picture } = this;
    if (!picture || point === null) return null;
    const { x, y, head } = picture;
    if (!head.x?.stride) return null;
    for (let row = 0; row < y.values.length; ++row) {
      const column = (point - picture.point(0, row)) / head.x.stride + x.numbers[0];
      const found = x.numbers.indexOf(column);
      if (found >= 0) return [found, row];
    }
    return null;
  }
}
