// Exports the picture as files, the view as a link, and both as equivalent commands.
import { button, command, copyButton, h, saveFile, setChildren } from "../lib/dom.js";
import { dbFlag, quoted } from "../lib/format.js";
import { pngOf } from "../lib/png.js";
import { joined } from "./conditions.js";
import { csvOf } from "./describe.js";
import { spanOf } from "./legend.js";

/** Returns the flags of `oblique plot` for the picture of a view. */
function plotFlags(view) {
  const field = (name) => view.field(name);
  const { head } = view.picture;
  const x = ["x", field("x")];
  const main = {
    map: [["map", field("z")], x, ["y", field("y")]],
    lines: [["lines", field("z")], x, ["by", field("y")]],
    scatter: [
      ["scatter", `${field("x")},${field("y")}`],
      // `oblique plot` can colour only by numbers.
      ["colour", view.picture.z.isCategory ? "" : field("z")],
    ],
    histogram: [["histogram", field("x")]],
  }[field("pic")];
  const isHistogram = field("pic") === "histogram";
  let range = isHistogram && field("x0") ? [field("x0"), field("x1")] : [];
  if (!isHistogram && field("z") && view.hasSpan) range = spanOf(view, view.picture);
  const held = view.block ? head.at.filter((one) => one.of > 1) : [];
  const isBlock = view.block && view.study.blocks.length > 1;
  return [
    ...main,
    ["block", isBlock ? String(Number(field("block")) + 1) : ""],
    ...held.map((one) => ["at", `${one.key}=${one.value}`]),
    ["where", joined(field("where"), ...(isHistogram ? [] : view.shownParts()))],
    ["range", range.join(":")],
  ].filter(([, value]) => value !== "");
}

function plotCommand(view) {
  const flags = plotFlags(view).map(([flag, value]) => `--${flag} ${quoted(value)}`);
  const isHistogram = view.field("pic") === "histogram";
  const logs = {
    xlog: "x",
    ...(!isHistogram && { ylog: "y" }),
    ...(view.hasMap && { zlog: "colour" }),
  };
  const isOn = ([name]) => view.field(name);
  const given = Object.entries(logs)
    .filter(isOn)
    .map(([, axis]) => `--log-${axis}`);
  const all = ["oblique plot", quoted(view.study.name), ...flags, ...given, "--out picture.svg"];
  return all.join(" ") + dbFlag(view.place.file);
}

function queryCommand(view) {
  const where = view.table.condition();
  const order = view.field("order");
  const parts = [
    "oblique query",
    quoted(view.study.name),
    `--select ${view.table.columns().join(",")}`,
  ];
  if (where) parts.push(`--where ${quoted(where)}`);
  if (order) parts.push(`--order ${quoted(order)}`);
  return parts.join(" ") + dbFlag(view.place.file);
}

export function showExports(view) {
  const savePng = async () => saveFile(`${view.study.name}.png`, await pngOf([view.figure()]));
  const saveCsv = () => saveFile(`${view.study.name}.csv`, csvOf(view.picture));
  setChildren(
    view.exports,
    h(
      "div.row.files",
      button("PNG", () => savePng().catch((error) => view.complain(error)), {
        title: "the picture as shown",
      }),
      button("CSV", saveCsv, { title: "the numbers of the picture" }),
      copyButton("Copy link", () => location.href, { title: "the address of this view" }),
    ),
    h("p", "Commands for this picture and table:"),
    command("the picture", plotCommand(view)),
    command("the table", queryCommand(view)),
  );
}
