// The picture as files, the view as a link, and equivalent commands.
import { button, command, copyButton, h, saveFile, setChildren } from "../lib/dom.js";
import { dbFlag, quoted } from "../lib/format.js";
import { pngOf } from "../lib/png.js";
import { joined } from "./conditions.js";
import { csvOf } from "./describe.js";
import { spanOf } from "./legend.js";

/** Flags of `oblique plot` for the picture of a view. */
function plotFlags(view) {
  const is = (name) => view.is(name);
  const { head } = view.picture;
  const x = ["x", is("x")];
  const main = {
    map: [["map", is("z")], x, ["y", is("y")]],
    lines: [["lines", is("z")], x, ["by", is("y")]],
    scatter: [
      ["scatter", `${is("x")},${is("y")}`],
      ["colour", view.picture.z.isCategory ? "" : is("z")], // oblique plot colours only by numbers
    ],
    histogram: [["histogram", is("x")]],
  }[is("pic")];
  const isHistogram = is("pic") === "histogram";
  let range = isHistogram && is("x0") ? [is("x0"), is("x1")] : [];
  if (!isHistogram && is("z") && view.hasSpan) range = spanOf(view, view.picture);
  const held = view.block ? head.at.filter((one) => one.of > 1) : [];
  const isBlock = view.block && view.study.blocks.length > 1;
  return [
    ...main,
    ["block", isBlock ? String(Number(is("block")) + 1) : ""],
    ...held.map((one) => ["at", `${one.key}=${one.value}`]),
    ["where", joined(is("where"), ...(isHistogram ? [] : view.shownParts()))],
    ["range", range.join(":")],
  ].filter(([, value]) => value !== "");
}

function plotCommand(view) {
  const flags = plotFlags(view).map(([flag, value]) => `--${flag} ${quoted(value)}`);
  const isHistogram = view.is("pic") === "histogram";
  const logs = {
    xlog: "x",
    ...(!isHistogram && { ylog: "y" }),
    ...(view.hasMap && { zlog: "colour" }),
  };
  const isOn = ([name]) => view.is(name);
  const given = Object.entries(logs)
    .filter(isOn)
    .map(([, axis]) => `--log-${axis}`);
  const all = ["oblique plot", quoted(view.study.name), ...flags, ...given, "--out picture.svg"];
  return all.join(" ") + dbFlag(view.place.file);
}

function queryCommand(view) {
  const where = view.table.condition();
  const order = view.is("order");
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
