// Describes pictures in words and as CSV.
import { count, counted, csv, withUnit } from "../lib/format.js";
import { emptyTexts } from "./legend.js";
import { mostDots } from "./picture.js";

/** Describes what a picture shows and omits. */
export function factsOf(view) {
  const { picture } = view;
  const { head, x, y, dots } = picture;
  if (head.nx !== undefined) return sliceFacts(view).join(" ");
  if (dots) {
    const without = counted(head.without, "other point");
    const rest = head.without > 0 ? ` ${without} without these values.` : "";
    return `${counted(head.points, "point")}, drawn one by one.${rest}`;
  }
  if (picture.labels) {
    const cut = head.isCut
      ? `the first ${count(head.points)} points`
      : counted(head.points, "point");
    return `Median and quartiles of ${cut} in ${counted(x.values.length, "bin")}.`;
  }
  const outside = head.outside > 0 ? `, ${count(head.outside)} outside` : "";
  const bins = `${counted(head.points, "point")} in ${counted(picture.values.length, "bin")}${outside}.`;
  const isMode = view.columnOf(view.field("z"))?.picture === "categories" && view.hasMap;
  const why = y.name ? ` More than ${count(mostDots)} points are grouped in bins.` : "";
  return bins + why + (isMode ? ` ${view.field("z")} is shown only for single points.` : "");
}

function sliceFacts({ picture: { head, x, y }, study }) {
  const size = [head.nx, ...(y.name ? [head.ny] : [])].map(count).join(" × ");
  const facts = [`${size} cells, ${count(head.solved)} solved.`];
  for (const [name, side] of Object.entries({ x, y })) {
    const of = head[name];
    if (!of || side.isWhole) continue;
    const all = count(of.last - of.first + 1);
    facts.push(`${count(side.values.length)} of ${all} values of ${side.name}, evenly spaced.`);
  }
  const blocks = study.blocks.length + study.blocks_left_out;
  if (blocks > 1) {
    const others = counted(study.points - study.blocks[head.block].points, "point");
    facts.push(`Block ${head.block + 1} of ${count(blocks)}; ${others} in others.`);
  }
  for (const { key, value, of } of head.at) {
    if (of > 1) facts.push(`${key} = ${withUnit(value, key, unitOfAxis(study, key))}.`);
  }
  return facts;
}

const unitOfAxis = ({ blocks }, key) =>
  blocks.flatMap((block) => block.axes).find((axis) => axis.key === key)?.unit ?? "";

export function sentenceOf({ x, y, z, head, dictionary, values, whyEmpty }, [column, row]) {
  const cell = row * x.values.length + column;
  const side = ({ name, unit, edges, values: all }, i) => {
    const text = (value) => withUnit(value, name, unit, edges ? 4 : 5);
    return `${name} ${edges ? `${text(edges[i])} to ${text(edges[i + 1])}` : text(all[i])}`;
  };
  const place = `${side(x, column)}, ${side(y, row)}`;
  const points = head.counts ? counted(head.counts[cell], "point") : "";
  const why = whyEmpty(cell);
  const value = z.isCategory
    ? dictionary[values[cell]]?.text
    : withUnit(values[cell], z.name, z.unit);
  const text = why ? (points ? "no points" : emptyTexts[why]) : value;
  return `${place}: ${z.name} ${text}${points && !why ? `, ${points}` : ""}`;
}

/** Returns the numbers of a picture as CSV in SI units, one line per cell or point. */
export function csvOf({ x, y, z, dots, dictionary, labels, values, whyEmpty, point }) {
  const text = (code) => (z.isCategory ? (dictionary[code]?.text ?? "") : (code ?? ""));
  if (dots) {
    const head = ["point", x.name, y.name, ...(dots.z ? [z.name] : [])];
    const row = (number, i) => [number, dots.x[i], dots.y[i], ...(dots.z ? [text(dots.z[i])] : [])];
    return csv([head, ...dots.points.map(row)]);
  }
  const nx = x.values.length;
  const upName = labels ? "share_below" : y.name;
  const up = (value) => (upName ? [value] : []);
  const rows = Array.from(values, (value, cell) => {
    const [column, row] = [cell % nx, Math.floor(cell / nx)];
    const shown = whyEmpty(cell) ? "" : text(value);
    return [x.values[column], ...up(y.values[row]), shown, point(column, row) ?? ""];
  });
  return csv([[x.name, ...up(upName), z.name, "point"], ...rows]);
}
