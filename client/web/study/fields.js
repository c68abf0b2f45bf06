// The parameters (fields) in the address of a study: picture and axes.

/** The axes of a grid whose values are neither expressions nor drawn from distributions. */
export const ownAxes = (block) =>
  block.kind === "grid" ? block.axes.filter((axis) => !axis.expression && !axis.distribution) : [];

export const varyingAxes = (block) => ownAxes(block).filter((axis) => axis.values > 1);

/** Returns value `i` of an axis, or undefined if the server did not list it. */
export function axisValue({ list, range }, i) {
  if (list || !range) return list?.[i];
  const { from, to, count, spacing } = range;
  if (i === 0 || count === 1) return from;
  if (i === count - 1) return to;
  const share = i / (count - 1);
  return spacing === "log" ? from * (to / from) ** share : from + share * (to - from);
}

/** Returns the column in queries that holds the values of an axis. */
export function columnOfAxis(key) {
  const link = /^length([1-9]\d*)$/.exec(key);
  return key === "E" ? "E_Pa" : link ? `lengths_m[${Number(link[1]) - 1}]` : key;
}

/** Maximum number of lines; with more values a map is clearer. */
const fewLines = 3;
const gridPictures = ["map", "lines"];
const pictures = [...gridPictures, "scatter", "histogram"];
const mainOutput = "fn_peak_N";

/** Returns the index of the grid with the most points, or -1 if the study has no grid. */
function largestGrid(blocks) {
  const size = (i) => (varyingAxes(blocks[i]).length > 0 ? blocks[i].points : -1);
  const best = blocks.reduce((most, _, i) => (size(i) > size(most) ? i : most), 0);
  return blocks.length > 0 && size(best) > 0 ? best : -1;
}

function usualAxes(keys) {
  const x = keys.includes("mu") ? "mu" : keys.at(-1);
  const others = keys.filter((key) => key !== x);
  return [x, others.includes("H") ? "H" : others[0]];
}

/**
 * Returns the columns of a study for pickers, [name, group]: those that vary, then main outputs.
 */
export function pickedColumns({ columns, usual_columns: usual, errors }) {
  const isDrawn = (name) => columns.some((one) => one.name === name && one.picture !== "none");
  const status = usual.indexOf("status");
  const varied = usual.slice(0, status).filter(isDrawn);
  const outputs = columns.filter((one) => one.kind === "output").map((one) => one.name);
  const isError = (name) => name.endsWith("_error") || name === "mode_same";
  const isOther = (name) => !usual.includes(name) && isDrawn(name) && (errors || !isError(name));
  return [
    ...varied.filter((name) => name !== "point").map((name) => [name, "varies"]),
    ...usual
      .slice(status)
      .filter(isDrawn)
      .map((name) => [name, "main outputs"]),
    ...outputs.filter(isOther).map((name) => [name, "other outputs"]),
  ];
}

/** Replaces missing and unsuitable fields of an address by defaults. */
export function fillIn(fields, study) {
  const is = (name) => fields.get(name) ?? "";
  const columnOf = (name) => study.columns.find((one) => one.name === name);
  const isNumber = (name) => columnOf(name)?.picture === "numbers";
  const grid = largestGrid(study.blocks);
  const isOfGrid = () => gridPictures.includes(is("pic"));
  if (!pictures.includes(is("pic")) || (is("pic") === "map" && grid < 0)) {
    choosePicture(fields, study.blocks[grid]);
  }
  if (grid < 0) fields.delete("block");
  if (isOfGrid() && grid >= 0) {
    fillInAxes(fields, study, grid);
  } else {
    const varied = pickedColumns(study)
      .filter(([name, group]) => group === "varies" && isNumber(name))
      .map(([name]) => name);
    const [x, y] = usualAxes(varied);
    const output = isNumber(is("z")) ? is("z") : mainOutput;
    if (!isNumber(is("x"))) fields.set("x", is("pic") === "histogram" ? output : (x ?? "mu"));
    if (is("pic") !== "scatter") fields.delete("y");
    else if (!isNumber(is("y"))) fields.set("y", y ?? (x ? mainOutput : "H"));
  }
  const mayHaveNone = is("pic") === "scatter" && fields.has("z");
  const fits = columnOf(is("z"))?.picture;
  if (fits === "numbers" || (fits === "categories" && ["map", "scatter"].includes(is("pic"))))
    return;
  if (!(mayHaveNone && is("z") === "")) fields.set("z", mainOutput);
}

function choosePicture(fields, block) {
  const axes = block ? varyingAxes(block) : [];
  const few = axes.length === 2 ? axes.find((axis) => axis.values <= fewLines) : undefined;
  const isChosen = ["x", "y", "z"].some((name) => fields.get(name));
  if (few && !isChosen) {
    fields.set("x", axes.find((axis) => axis !== few).key);
    fields.set("y", few.key);
  }
  const isLines = axes.length === 1 || (few && !isChosen);
  fields.set("pic", isLines ? "lines" : block ? "map" : "scatter");
}

function fillInAxes(fields, { blocks }, grid) {
  const is = (name) => fields.get(name) ?? "";
  const given = blocks[Number(is("block") || grid)];
  const block = given && varyingAxes(given).length > 0 ? given : blocks[grid];
  fields.set("block", String(blocks.indexOf(block)));
  const keys = varyingAxes(block).map((axis) => axis.key);
  const [x, y] = usualAxes(keys);
  if (!keys.includes(is("x"))) fields.set("x", x);
  if (!keys.includes(is("y")) || is("y") === is("x")) fields.delete("y");
  if (is("y") || is("pic") !== "map") return;
  const other = [y, ...keys].find((key) => key && key !== is("x"));
  if (other) fields.set("y", other);
  else fields.set("pic", "lines");
}
