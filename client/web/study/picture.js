// Reads the data of a picture: slices, bins, single points and medians, all in one form.
import { numbers, rows } from "../api.js";
import { countAsOne, endsOf, quantile, scale } from "../lib/scale.js";
import { joined, within } from "./conditions.js";
import { ownAxes } from "./fields.js";

/**
 * The form of a picture. It has sides x and y. A side has name, unit (SI), values, isWhole
 * (`values` omits no value between its ends), and either edges (of bins) or numbers (indices of the
 * values on their axis). The picture also has z {name, unit, isCategory}; `least` and `most`, the
 * range of z; values, row by row (for categories, indices into the dictionary [{text, cells}]); the
 * head of the server's answer; point(column, row); whyEmpty(cell), which returns "" or one of
 * emptyKinds; and dots {points, x, y, z} for single points, or labels for lines.
 */

/** Kinds of cells without a value, in the order of their bits in the server's answer. */
export const emptyKinds = ["missing", "failed", "left_out", "none", "filtered"];

/** Maximum number of points that are drawn one by one; more points are grouped in bins. */
export const mostDots = 20_000;
const mostCells = 256; // along each axis
const firstCells = 96;
const mostLines = 8;
const mostBins = 96;
const mostForMedians = 100_000;

const ask = (study, kind, query, signal) =>
  numbers(`api/studies/${study}/${kind}?${new URLSearchParams(query)}`, signal);

/** Returns the axis indices of the values in an answer: `shown`, evenly from `first` to `last`. */
function numbersOf({ first, last }, shown) {
  const steps = Math.max(shown - 1, 1);
  const number = (i) => first + Math.floor((2 * i * (last - first) + steps) / (2 * steps));
  return Array.from({ length: shown }, (_, i) => number(i));
}

/** Reads a slice: one output over one or two axes of a grid. */
async function slice(view, query, signal) {
  const { head, bytes, begin } = await ask(view.study.id, "slice", query, signal);
  const { nx, ny } = head;
  const cellsBegin = begin + 8 * (nx + (head.y ? ny : 0));
  const isCategory = head.z.kind === "categories";
  const values = new (isCategory ? Uint16Array : Float32Array)(bytes, cellsBegin, nx * ny);
  const bits = isCategory ? null : new Uint32Array(bytes, cellsBegin, nx * ny);
  const [least, most] = isCategory ? [null, null] : endsOf(values);
  const side = (of, all) => ({
    name: of?.key ?? "",
    unit: view.unitOf(of?.key),
    values: all,
    numbers: of ? numbersOf(of, all.length) : [0],
    isWhole: of?.all_lines ?? true,
  });
  const x = side(head.x, new Float64Array(bytes, begin, nx));
  const ys = head.y ? new Float64Array(bytes, begin + 8 * nx, ny) : new Float64Array(1);
  const y = side(head.y, ys);
  const strides = [head.x.stride, head.y?.stride ?? 0];
  const whyEmpty = (cell) => {
    if (bits) return Number.isNaN(values[cell]) ? emptyKinds[bits[cell] & 7] : "";
    return emptyKinds[0xffff - values[cell]] ?? "";
  };
  return {
    x,
    y,
    z: { name: head.z.name, unit: head.z.unit, isCategory },
    values,
    dictionary: head.dictionary ?? [],
    least,
    most,
    head,
    point: (i, j) => head.first_point + x.numbers[i] * strides[0] + y.numbers[j] * strides[1],
    whyEmpty,
  };
}

/** Creates a picture axis of equal bins, or of one bin around a single value. */
function binSide(name, unit, least, most, bins, isLog) {
  if (countAsOne(least, most)) {
    const half = Math.abs(least) * 0.05 || 0.5;
    return {
      name,
      unit,
      values: Float64Array.of(least),
      edges: [least - half, least + half],
      isWhole: true,
    };
  }
  const { value } = scale(least, most, isLog);
  const edges = Array.from({ length: bins + 1 }, (_, i) => value(i / bins));
  [edges[0], edges[bins]] = [least, most];
  const values = Float64Array.from({ length: bins }, (_, i) => value((i + 0.5) / bins));
  return { name, unit, values, edges, isWhole: true };
}

const noSide = { name: "", unit: "", values: new Float64Array(1), isWhole: true };

/** Returns the bin that contains a value. */
function binOf({ edges, values }, value, isLog) {
  const place = scale(edges[0], edges.at(-1), isLog).place(value);
  return Math.min(Math.max(Math.floor(place * values.length), 0), values.length - 1);
}

/**
 * Reads bins over one or two columns: the number of points in each, or the mean of a third column.
 */
async function bins(view, query, signal) {
  const { head, bytes, begin } = await ask(view.study.id, "bins", query, signal);
  const side = (of) =>
    of ? binSide(of.column, of.unit, of.least, of.most, of.bins, of.log) : noSide;
  const [x, y] = [side(head.x), side(head.y)];
  const cells = head.x.bins * (head.y?.bins ?? 1);
  const counts = new Uint32Array(bytes, begin, cells);
  const values = head.z
    ? new Float32Array(bytes, begin + 4 * cells, cells)
    : Float32Array.from(counts, (n) => (n > 0 ? n : NaN));
  const [least, most] = endsOf(values);
  return {
    x,
    y,
    z: {
      name: head.z ? `mean of ${head.z}` : "points",
      unit: view.unitOf(head.z),
      isCategory: false,
    },
    values,
    dictionary: [],
    least,
    most,
    head: { ...head, counts },
    point: () => null,
    whyEmpty: (cell) => (Number.isNaN(values[cell]) ? "left_out" : ""),
  };
}

/** Returns the categories, most frequent first, and the index of the category of each value. */
function categoriesOf(values) {
  const cells = new Map();
  for (const text of values) if (text !== null) cells.set(text, (cells.get(text) ?? 0) + 1);
  const dictionary = [...cells]
    .map(([text, number]) => ({ text, cells: number }))
    .sort((a, b) => b.cells - a.cells);
  const places = new Map(dictionary.map(({ text }, i) => [text, i]));
  return { dictionary, codes: values.map((text) => places.get(text) ?? null) };
}

/** Reads single points; returns null if there are more than mostDots. */
async function dots(view, signal) {
  const [xName, yName, zName] = ["x", "y", "z"].map((name) => view.field(name));
  const isLog = { x: view.field("xlog") !== "", y: view.field("ylog") !== "" };
  const select = ["point", xName, yName, ...(zName ? [zName] : [])].join(",");
  const query = { select, where: shownWhere(view), limit: mostDots + 1 };
  const answer = await rows(view.study.id, query, signal);
  if (answer.rows.length > mostDots) return null;
  const fits = (value, log) => typeof value === "number" && (!log || value > 0);
  const found = answer.rows.filter((row) => fits(row[1], isLog.x) && fits(row[2], isLog.y));
  const column = (i) => found.map((row) => row[i]);
  const isCategory = view.columnOf(zName)?.picture === "categories";
  const { dictionary, codes } = isCategory ? categoriesOf(column(3)) : { dictionary: [] };
  const all = {
    points: column(0),
    x: column(1),
    y: column(2),
    z: zName ? (codes ?? column(3)) : null,
  };
  const side = (name, column) => {
    const [least, most] = endsOf(all[name]);
    const end = (which, usual) => Number(view.field(name + which) || (usual ?? 0));
    const [from, to] = [end("0", least), end("1", most)];
    return binSide(column, view.unitOf(column), from, to, 1, isLog[name]);
  };
  const [x, y] = [side("x", xName), side("y", yName)];
  const [least, most] = isCategory ? [null, null] : endsOf(all.z ?? []);
  return {
    x,
    y,
    z: { name: zName || "points", unit: view.unitOf(zName), isCategory },
    values: [],
    dictionary,
    least,
    most,
    head: { points: found.length, without: answer.rows.length - found.length },
    dots: all,
    point: () => null,
    whyEmpty: () => "",
  };
}

/** Reads median and quartiles of an output in bins over a column. */
async function medians(view, signal) {
  const [x, z] = [view.field("x"), view.field("z")];
  const where = joined(shownWhere(view), `${z} IS NOT NULL`);
  const query = { select: `${x},${z}`, where, order: "point", limit: mostForMedians };
  const answer = await rows(view.study.id, query, signal);
  const isLog = view.field("xlog") !== "";
  const found = answer.rows.filter(([value]) => typeof value === "number" && (!isLog || value > 0));
  const [least, most] = endsOf(found.map(([value]) => value));
  const number = Math.min(Math.max(Math.round(Math.sqrt(found.length) / 2), 4), 40);
  const side = binSide(x, view.unitOf(x), least ?? 0, most ?? 0, number, isLog);
  const inBins = Array.from(side.values, () => []);
  for (const [value, output] of found) inBins[binOf(side, value, isLog)].push(output);
  for (const all of inBins) all.sort((a, b) => a - b);
  const shares = [0.5, 0.25, 0.75];
  const line = (share) => inBins.map((all) => (all.length > 0 ? quantile(all, share) : NaN));
  const values = Float64Array.from(shares.flatMap(line));
  const [low, high] = endsOf(values);
  return {
    x: side,
    y: { ...noSide, values: Float64Array.from(shares) },
    z: { name: z, unit: view.unitOf(z), isCategory: false },
    values,
    dictionary: [],
    least: low,
    most: high,
    head: { points: found.length, isCut: answer.rows.length === mostForMedians },
    labels: ["median", "25 % lie below", "75 % lie below"],
    point: () => null,
    whyEmpty: (cell) => (Number.isNaN(values[cell]) ? "left_out" : ""),
  };
}

/** Returns one condition for the filter and the zoomed part of a picture whose axes are columns. */
function shownWhere(view) {
  const part = (name) => within(view.field(name), view.field(`${name}0`), view.field(`${name}1`));
  return joined(view.field("where"), part("x"), view.field("pic") === "scatter" ? part("y") : "");
}

const given = (view, ...names) =>
  Object.fromEntries(
    names.filter((name) => view.field(name)).map((name) => [name, view.field(name)]),
  );

function sliceQuery(view, cells) {
  const keys = ownAxes(view.block).map((axis) => axis.key);
  const isHeld = ([key]) => keys.includes(key) && ![view.field("x"), view.field("y")].includes(key);
  const at = [...view.places()].filter(isHeld).map(([key, number]) => `${key}@${number}`);
  return {
    ...given(view, "z", "x", "y", "block", "x0", "x1", "y0", "y1", "where"),
    ...(at.length > 0 ? { at: at.join(",") } : {}),
    nx: cells,
    ny: view.field("pic") === "lines" ? mostLines : cells,
  };
}

function binsQuery(view) {
  const isScatter = view.field("pic") === "scatter";
  // Chooses the number of bins so that each has a few points.
  const side = Math.round(Math.min(Math.max(Math.sqrt(view.study.points / 3), 6), mostBins));
  const z = view.columnOf(view.field("z"))?.picture === "numbers" ? ["z"] : [];
  return {
    ...given(view, "x", "xlog", "x0", "x1", "where"),
    nx: isScatter ? side : Math.min(side * 2, 64),
    ...(isScatter ? { ny: side, ...given(view, "y", "ylog", "y0", "y1", ...z) } : {}),
  };
}

async function scatter(view, signal) {
  const first = view.study.points <= mostDots ? await dots(view, signal) : null;
  if (first) return first;
  const gathered = await bins(view, binsQuery(view), signal);
  return (gathered.head.points <= mostDots && (await dots(view, signal))) || gathered;
}

/**
 * Returns the maximum numbers of cells per side, in the order of loading. A large map is first
 * loaded with fewer cells.
 */
export function stepsTo(view, isRefresh) {
  if (view.field("pic") !== "map" || isRefresh) return [mostCells];
  const sides = ownAxes(view.block).filter((axis) =>
    [view.field("x"), view.field("y")].includes(axis.key),
  );
  const cells = sides.reduce((all, axis) => all * Math.min(axis.values, mostCells), 1);
  return cells > 4 * firstCells ** 2 ? [firstCells, mostCells] : [mostCells];
}

/** Reads the picture that the address of a view describes. */
export function askPicture(view, cells, signal) {
  if (view.field("pic") === "scatter") return scatter(view, signal);
  if (view.field("pic") === "histogram") return bins(view, binsQuery(view), signal);
  return view.block ? slice(view, sliceQuery(view, cells), signal) : medians(view, signal);
}

/**
 * Finds the cells, bins or dots of a picture that contain points which meet a further condition.
 * Returns {cells, counts, points}.
 */
export async function askSelected(view, picture, condition, signal) {
  const where = joined(view.field("where"), condition);
  if (picture.labels) return { cells: new Uint8Array(picture.values.length) };
  if (picture.dots) {
    const query = {
      select: "point",
      where: joined(shownWhere(view), condition),
      limit: mostDots + 1,
    };
    const answer = await rows(view.study.id, query, signal);
    return { cells: null, points: new Set(answer.rows.map(([point]) => point)) };
  }
  if (picture.head.counts) {
    const ends = {};
    for (const name of ["x", "y"].filter((one) => picture.head[one])) {
      ends[`${name}0`] = picture.head[name].least;
      ends[`${name}1`] = picture.head[name].most;
    }
    const { head } = await bins(view, { ...binsQuery(view), ...ends, where }, signal);
    return { cells: head.counts.map((number) => Math.min(number, 1)), counts: head.counts };
  }
  const side = Math.max(picture.x.values.length, picture.y.values.length);
  const update = await slice(view, { ...sliceQuery(view, side), where }, signal);
  const isOut = (cell) => ["missing", "left_out", "filtered"].includes(update.whyEmpty(cell));
  return { cells: Uint8Array.from(picture.values, (_, cell) => (isOut(cell) ? 0 : 1)) };
}
