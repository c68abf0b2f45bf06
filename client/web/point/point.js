// The view of one point: time histories, moving finger, and all numbers.
import { json, rows, rowsPath } from "../api.js";
import { Chart } from "../lib/chart.js";
import { button, command, h, saveFile, statusLine } from "../lib/dom.js";
import { count, counted, csv, dbFlag, quoted, shown, withUnit } from "../lib/format.js";
import { pngOf } from "../lib/png.js";
import { completed } from "../overview.js";
import { fingerOf } from "./finger.js";
import { loadTrace } from "./trace.js";

const mainNumbers = [
  "H",
  "mu",
  "e",
  "fn_peak_N",
  "ft_peak_N",
  "duration_s",
  "stick_total_s",
  "mode",
];
const origin =
  "status solver_version integrator instruction_set elements_per_link tolerance dt_s steps wall_s closure solved_at".split(
    " ",
  );
const hidden = "study study_id point model_id worker_id worker_name attempt reused_from".split(" ");

/** Parses a list that a row contains as JSON. */
function listOf(text) {
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}

function textOf(value, { name, unit }) {
  const list = typeof value === "string" && value.startsWith("[") ? listOf(value) : value;
  if (!Array.isArray(list)) return withUnit(value, name, unit, 7);
  const text = (one) =>
    Array.isArray(one)
      ? `[${one.map(text).join(", ")}]`
      : String(typeof one === "number" ? shown(one, 6) : one);
  return `${list.map(text).join(", ")} ${unit}`;
}

/** Reads the point; if it has a result, also its row. */
async function readPoint(study, point, signal) {
  const select = study.columns.map((column) => column.name).join(",");
  const [update, answer] = await Promise.all([
    json(`api/studies/${study.id}/points/${point}`, signal),
    rows(study.id, { select, where: `point = ${point}` }, signal),
  ]);
  const values = answer.rows[0];
  const row = values && Object.fromEntries(answer.columns.map((name, i) => [name, values[i]]));
  return { ...update, row };
}

/** Shows the main numbers, or the reason why there are none. */
function mainFacts({ row, fault, left_out: isLeftOut, ...point }, columns) {
  const source = row ?? point;
  const known = mainNumbers.filter((name) => source[name] !== undefined && source[name] !== null);
  const figure = (name) => {
    const column = columns.find((one) => one.name === name);
    const title = column.meaning;
    return h("div", { title }, h("dt", name), h("dd", withUnit(source[name], name, column.unit)));
  };
  let state = fault;
  if (!fault && isLeftOut && !row) state = "The study's filter leaves this point out.";
  else if (!fault && !row) state = "This point is not solved yet.";
  else if (row?.error) state = `The point failed: ${row.error}`;
  return [
    h("dl.figures", ...known.map(figure)),
    state && h("p", { class: row?.error ? "bad" : "weak" }, state),
  ].filter(Boolean);
}

/** Shows all numbers of a row in groups; tooltips give their meaning. */
function allNumbers(row, columns) {
  const list = (title, names) => {
    const entry = (column) =>
      h(
        "div",
        { title: column.meaning },
        h("dt", column.name),
        h("dd", textOf(row[column.name], column)),
      );
    const found = names.filter(({ name }) => row[name] !== null && row[name] !== undefined);
    return [h("h3", title), h("dl.values", ...found.map(entry))];
  };
  const shownColumns = columns.filter(({ name }) => !hidden.includes(name));
  const isOrigin = ({ name }) => origin.includes(name);
  const of = (kind) => shownColumns.filter((column) => column.kind === kind && !isOrigin(column));
  return [
    h("h2", "Numbers"),
    ...list("Outputs", of("output")),
    ...list("Inputs and model", of("input")),
    ...list("Solver", shownColumns.filter(isOrigin)),
  ];
}

/** Creates charts of the time histories, forces first. Calls `moved` with the row at the cursor. */
function chartsOf(trace, moved) {
  const micro = (name) => trace.column(name).map((value) => value * 1e6);
  const change = (name) => {
    const values = trace.column(name);
    return values.map((value) => value - values[0]);
  };
  const [kinetic, strain, gravity] = ["kinetic_J", "strain_J", "gravity_J"].map(change);
  const x = { label: "t [µs]", name: "t", unit: "µs", values: micro("t_s") };
  const spans = trace.spans.map(({ from, to, kind }) => ({
    from: from * 1e6,
    to: to * 1e6,
    ink: kind,
    isBand: kind === "stick",
  }));
  const chart = (title, name, unit, series) => {
    const lines = Object.entries(series).map(([label, values], look) => ({ label, values, look }));
    return new Chart({
      title,
      x,
      y: { label: `${name} [${unit}]`, unit },
      series: lines,
      spans,
      moved,
    });
  };
  return [
    chart("Forces on the tip", "force", "N", {
      F_n: trace.column("fn_N"),
      F_t: trace.column("ft_N"),
    }),
    chart("Velocities", "velocity", "m/s", {
      "tip, normal": trace.column("vn_m_s"),
      "tip, tangential": trace.column("vt_m_s"),
      P: trace.column("vP_m_s"),
    }),
    chart("Deformation of the contact", "deformation", "µm", {
      "compression −u_y": micro("uy_m").map((value) => -value),
      "tangential u_x": micro("ux_m"),
    }),
    chart("Energy change since touch", "energy", "J", {
      kinetic,
      strain,
      gravity,
      sum: kinetic.map((value, i) => value + strain[i] + gravity[i]),
    }),
  ];
}

function saveTrace(trace, name) {
  const columns = trace.head.columns.filter((column) => column.numbers === 1);
  const values = columns.map((column) => trace.column(column.name));
  const head = [...columns.map((column) => column.name), "state"];
  const row = (_, i) => [...values.map((column) => column[i]), trace.state(i)];
  saveFile(`${name}.csv`, csv([head, ...Array.from({ length: trace.rows }, row)]));
}

/** Shows the time histories of a trace; returns the objects that the caller must close. */
function showTrace(place, trace, name) {
  const charts = chartsOf(trace, (row) => finger.show(row));
  const finger = fingerOf(trace, (row) => charts.forEach((chart) => chart.pointAt(row)));
  const [forces, ...others] = charts.map((chart) => chart.element);
  const shades = {
    compression: "compression",
    restitution: "restitution",
    stick: "stick (bar at the bottom)",
  };
  const key = Object.entries(shades).map(([kind, text]) =>
    h("li", h("span", { class: `shade ink-${kind}` }), text),
  );
  const savePng = async () =>
    saveFile(`${name}.png`, await pngOf(charts.map((chart) => chart.figure())));
  const { rows: shownRows, head } = trace;
  const thinned = shownRows < head.instants ? ` of ${count(head.instants)}, evenly spaced` : "";
  place.replaceChildren(
    h("div.row", finger.player, h("ul.legend", ...key)),
    h("div.two", forces, finger.tip, others[0], finger.whole, others[1], others[2]),
    h(
      "div.row",
      button("Time histories as CSV", () => saveTrace(trace, name)),
      button("Plots as PNG", savePng),
      h("span.weak", `${counted(shownRows, "instant")}${thinned}, solved again by ${head.worker}`),
    ),
  );
  finger.begin();
  return [...charts, finger];
}

function commandsOf(study, point, file) {
  const name = quoted(study.name);
  const at = dbFlag(file);
  const href = rowsPath(study.id, { where: `point = ${point}`, format: "csv" });
  return [
    h("h2", "Export"),
    command("the pictures", `oblique plot ${name} --point ${point} --out picture.svg${at}`),
    command("the time histories", `oblique trace ${name} ${point} --out trace.csv${at}`),
    command("the row", `oblique query ${name} --where 'point = ${point}'${at}`),
    h("a.button", { download: `${study.name}-${point}.csv`, href }, "Row as CSV"),
  ];
}

export async function pointView(root, place, id, point) {
  const { signal } = place;
  const study = await json(`api/studies/${id}`, signal);
  const back = h("a", { href: place.last(`/study/${id}`) }, study.name);
  place.trail([back, `point ${count(point)}`]);
  let update = await readPoint(study, point, signal);
  const { element: said, say } = statusLine();
  const [facts, numbers] = [h("div"), h("div")];
  const pictures = h("section", { "aria-label": "Time histories" }, said);
  const other = (number, text) => h("a.button", { href: `#/study/${id}/point/${number}` }, text);
  const open = [];
  let done = null;
  let isAsking = false;

  function show() {
    facts.replaceChildren(...mainFacts(update, study.columns));
    numbers.replaceChildren(...(update.row ? allNumbers(update.row, study.columns) : []));
  }
  show();
  root.replaceChildren(
    h(
      "div.head",
      h("h2.name", `${study.name}, point ${count(point)}`),
      point > 0 && other(point - 1, "Previous point"),
      point + 1 < study.points && other(point + 1, "Next point"),
    ),
    facts,
    pictures,
    numbers,
    h("section.commands", ...commandsOf(study, point, place.file)),
  );
  loadTrace(id, point, signal, say)
    .then((trace) => open.push(...showTrace(pictures, trace, `${study.name}-${point}`)))
    .catch((error) => signal.aborted || say(`No time histories: ${error.message}`, true));
  return {
    /** Reads an unsolved point again whenever points of its study are completed. */
    async take(now) {
      const listed = now.studies.find((one) => one.id === id);
      const completedNow = listed ? completed(listed) : -1;
      if (update.row || isAsking || completedNow === done) return;
      isAsking = true;
      try {
        update = await readPoint(study, point, signal);
        if (update.row) show();
        done = completedNow;
      } catch {
        // the point is read again with the next overview
      }
      isAsking = false;
    },
    close: () => open.forEach((part) => part.close()),
  };
}
