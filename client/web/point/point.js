// @ts-check
// A point: its numbers, its contact over time, and the finger moving.
import { copied, h, save, save_file } from "/parts/dom.js";
import { count, of_file, quoted, shown, with_unit } from "/parts/format.js";
import { line_plot } from "/parts/lines.js";
import { png_of } from "/parts/png.js";
import { completed } from "/overview.js";
import { json, rows } from "/server.js";
import { finger } from "./finger.js";
import { loop_plot } from "./loop.js";
import { player } from "./player.js";
import { trace_of } from "./trace.js";

const kProvenance = ["status", "error", "solver_version", "integrator", "instruction_set", "elements_per_link", "tolerance", "dt_s", "steps",
  "wall_s", "closure", "worker_name", "worker_id", "attempt", "solved_at", "reused_from", "model_id"];

/** A list, which a row has as JSON. @param {string} text */
function list_of(text) {
  try {
    return JSON.parse(text);
  } catch {
    return ` ${text}`;  // an error may begin as a list does
  }
}

/** @param {any} value */
function text_of(value) {
  if (value === null || value === undefined) return "–";
  if (typeof value === "number") return shown(value, 7);
  if (typeof value === "string" && value.startsWith("[")) return text_of(list_of(value));
  if (Array.isArray(value)) return value.map((one) => (Array.isArray(one) ? `[${one.map(text_of).join(", ")}]` : text_of(one))).join(", ");
  return String(value);
}

/** Browsers break lines behind hyphens, also in numbers with an exponent and in instants. @param {string} text */
const in_one_piece = (text) => text.split(/(\S*\d(?:e-|T)\d\S*)/).map((part, i) => (i % 2 === 1 ? h("span", { class: "whole" }, part) : part));

/** @param {string} caption @param {[string, string, string, string][]} lines */
function table(caption, lines) {
  return h("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": caption }, h("table", { class: "values" },
    h("caption", {}, caption), h("thead", {}, h("tr", {}, ...["name", "value", "unit", "meaning"].map((head) => h("th", { scope: "col" }, head)))),
    h("tbody", {}, ...lines.map(([name, value, unit, meaning]) => h("tr", {}, h("th", { scope: "row" }, name),
      h("td", { class: "value" }, ...in_one_piece(value)), h("td", {}, unit), h("td", { class: "weak meaning" }, meaning))))));
}

/** @param {any} row @param {any[]} columns */
function point_numbers(row, columns) {
  const of = (/** @type {(column: any) => boolean} */ wanted) => columns.filter((c) => c.name in row && wanted(c))
    .map((c) => /** @type {[string, string, string, string]} */ ([c.name, text_of(row[c.name]), c.unit === "1" ? "" : c.unit, c.meaning]));
  const is_origin = (/** @type {any} */ c) => kProvenance.includes(c.name);
  return h("section", {}, h("h2", {}, "Numbers"),
    table("Outputs", of((c) => c.kind === "output" && !is_origin(c) && row[c.name] !== null)),
    table("Where they come from", of(is_origin)),
    table("Inputs and model", of((c) => c.kind === "input" && !is_origin(c))));
}

/** A point with its row, whose values are those that were solved. @param {any} whole the study @param {number} point @param {AbortSignal} signal */
async function told_of(whole, point, signal) {
  const select = whole.columns.map((/** @type {any} */ one) => one.name).join(",");
  const [told, { columns, rows: [values] }] = await Promise.all([json(`/api/studies/${whole.id}/points/${point}`, signal),
    rows(whole.id, { select, where: `point = ${point}` }, signal)]);
  const row = values ? Object.fromEntries(columns.map((/** @type {string} */ name, /** @type {number} */ i) => [name, values[i]])) : null;
  return { ...told, ...(row && { H: row.H, mu: row.mu, e: row.e, left_out: false }), row };
}

/** What is known of a point without its time histories. @param {any} told @param {any[]} columns */
function known_of(told, columns) {
  const { row } = told;
  const facts = [["H", `${shown(told.H)} m`], ["mu", shown(told.mu)], ["e", shown(told.e)],
    ...(row && row.status === "solved" ? [["F_n peak", with_unit(row.fn_peak_N, "N")], ["F_t peak", with_unit(row.ft_peak_N, "N")],
      ["contact", `${shown(row.duration_s * 1e6, 4)} µs`], ["stick", `${shown(row.stick_total_s * 1e6, 4)} µs`], ["mode", row.mode]] : [])];
  const standing = told.fault || (told.left_out ? "The study's filter leaves this point out." : "")
    || (!row ? "This point is not solved yet." : row.error ? `It failed: ${row.error}` : "");
  return { facts: [h("dl", { class: "figures" }, ...facts.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value)))),
    standing ? h("p", { class: row?.error ? "bad" : "weak" }, standing) : ""],
  numbers: row ? [point_numbers(row, columns)] : [] };
}

/**
 * @param {HTMLElement} root @param {import("/main.js").Place} place @param {number} study @param {number} point
 * @returns {Promise<import("/main.js").View>}
 */
export async function point_view(root, place, study, point) {
  const { signal } = place;
  const whole = await json(`/api/studies/${study}`, signal);
  const ask = () => told_of(whole, point, signal);
  place.trail([h("a", { href: place.last(`/study/${study}`) }, whole.name), `point ${count(point)}`]);
  let told = await ask();
  const said = h("p", { role: "status", class: "said" }, "A worker solves this point again.");
  const [facts, numbers] = [h("div", {}), h("div", {})];
  function show_known() {
    const known = known_of(told, whole.columns);
    facts.replaceChildren(...known.facts);
    numbers.replaceChildren(...known.numbers);
  }
  show_known();
  const pictures = h("section", { "aria-label": "The contact over time" }, said);
  const other = (/** @type {number} */ number) => `#/study/${study}/point/${number}`;
  const neighbours = h("div", { class: "row" },
    point > 0 && h("a", { class: "button", href: other(point - 1) }, "Previous point"),
    point + 1 < whole.points && h("a", { class: "button", href: other(point + 1) }, "Next point"));
  root.replaceChildren(h("h2", { class: "name" }, `${told.name}, point ${count(point)}`),
    neighbours, facts, pictures, numbers, h("section", {}, ...things_to_take(study, point, told.name, of_file(place.file))));
  /** @type {{close: () => void}[]} */
  const parts = [];
  trace_of(study, point, signal, (text, is_bad) => {
    said.textContent = text;
    said.className = is_bad ? "said bad" : "said";
  }).then((trace) => {
    if (signal.aborted) return;
    parts.push(...show_trace(pictures, trace, `${told.name}-${point}`));
  }).catch((error) => {
    if (signal.aborted) return;
    said.className = "said bad";
    said.textContent = `No time histories: ${error.message}`;
  });
  return { take: look_again(study, () => told, async () => {
    told = await ask();
    if (told.row) show_known();
  }), close: () => parts.forEach((part) => part.close()) };
}

/**
 * Hears how far the study is, and looks whether the point was solved since.
 * @param {number} study @param {() => any} told @param {() => Promise<void>} ask
 */
function look_again(study, told, ask) {
  /** How many points had been settled when it was asked last. @type {number | null} */
  let settled = null;
  let is_asking = false;
  return async (/** @type {any} */ now) => {
    const one = now.studies.find((/** @type {any} */ each) => each.id === study);
    const stands = one ? completed(one) : -1;  // those that ended are not told of
    if (told().row || is_asking || stands === settled) return;
    is_asking = true;
    try {
      await ask();
      settled = stands;
    } catch { /* it is asked again when the next overview comes */ }
    is_asking = false;
  };
}

/** @param {number} study @param {number} point @param {string} name of the study @param {string} from of which file commands read it */
function things_to_take(study, point, name, from) {
  return [h("h2", {}, "Take it with you"),
    h("p", {}, "Its pictures, as oblique plot draws them:"), copied("the command of the picture", `oblique plot ${quoted(name)} --point ${point} --out picture.svg${from}`),
    h("p", {}, "Its time histories:"), copied("the command of the trace", `oblique trace ${quoted(name)} ${point} --out trace.csv${from}`),
    h("p", {}, "Its row:"), copied("the command of the row", `oblique query ${quoted(name)} --where 'point = ${point}'${from}`),
    h("a", { class: "button", download: `${name}-${point}-row.csv`, href: `/api/studies/${study}/rows?${new URLSearchParams({ where: `point = ${point}`, format: "csv" })}` }, "Row as CSV")];
}

/** @param {import("./trace.js").Trace} trace @param {string} name */
function save_trace(trace, name) {
  const columns = trace.head.columns.filter((/** @type {any} */ c) => c.numbers === 1);
  const values = columns.map((/** @type {any} */ c) => trace.column(c.name));
  const lines = [[...columns.map((/** @type {any} */ c) => c.name), "state"].join(",")];
  for (let i = 0; i < trace.rows; ++i) lines.push([...values.map((/** @type {Float64Array} */ v) => v[i]), trace.state(i)].join(","));
  save(name, "text/csv", lines.join("\r\n") + "\r\n");
}

/** @param {HTMLElement} place @param {import("./trace.js").Trace} trace @param {string} name of files */
function show_trace(place, trace, name) {
  const times = trace.column("t_s");
  const micro = times.map((t) => t * 1e6);
  const spans = [...trace.phases, ...trace.sticks].map((one) => ({ from: one.from * 1e6, to: one.to * 1e6, ink: one.kind, is_band: one.kind === "stick" }));
  const change = (/** @type {string} */ name) => {
    const values = trace.column(name);
    return values.map((v) => v - values[0]);
  };
  const t = { name: "t", unit: "µs", values: micro };
  const moved = (/** @type {number} */ i) => watch.show(i);
  const [kinetic, strain, gravity] = ["kinetic_J", "strain_J", "gravity_J"].map(change);
  const plots = [
    line_plot({ title: "Forces on the tip", x: t, y: { name: "force", unit: "N" }, spans, moved,
      series: [{ label: "F_n", values: trace.column("fn_N") }, { label: "F_t", values: trace.column("ft_N") }] }),
    line_plot({ title: "Velocities", x: t, y: { name: "velocity", unit: "m/s" }, spans, moved,
      series: [{ label: "tip, normal", values: trace.column("vn_m_s") }, { label: "tip, along the ground", values: trace.column("vt_m_s") },
        { label: "P", values: trace.column("vP_m_s"), colour: 3 }] }),
    line_plot({ title: "Deformation of the contact", x: t, y: { name: "deformation", unit: "µm" }, spans, moved,
      series: [{ label: "normal", values: trace.column("uy_m").map((v) => v * 1e6) }, { label: "tangential", values: trace.column("ux_m").map((v) => v * 1e6) }] }),
    line_plot({ title: "Energies, less those at touch", x: t, y: { name: "energy", unit: "J" }, spans, moved,
      series: [{ label: "kinetic", values: kinetic }, { label: "strain", values: strain }, { label: "gravity", values: gravity },
        { label: "sum", values: kinetic.map((v, i) => v + strain[i] + gravity[i]), colour: 7 }] }),
  ];
  const loops = [
    loop_plot("Normal force over deformation", { name: "pressed by", unit: "µm", values: trace.column("uy_m").map((v) => -v * 1e6) },
      { name: "F_n", unit: "N", values: trace.column("fn_N") }, 0),
    loop_plot("Tangential force over deformation", { name: "u_x", unit: "µm", values: trace.column("ux_m").map((v) => v * 1e6) },
      { name: "F_t", unit: "N", values: trace.column("ft_N") }, 1),
  ];
  const body = finger(trace);
  const all = [...plots, ...loops];
  const watch = player(times, trace.fall.rows > 0 ? trace.fall.column("t_s") : new Float64Array(0), (at) => {
    body.stand_at(at);
    all.forEach((part) => part.point_at(at.is_falling ? 0 : at.row));
  });
  const key = h("ul", { class: "legend" }, ...[["compression", "compression"], ["restitution", "restitution"], ["stick", "stick: the bar below"]]
    .map(([ink, text]) => h("li", {}, h("span", { class: `shade ink-${ink}` }), text)));
  place.replaceChildren(h("h2", {}, trace.fall.rows > 0 ? "The fall and the contact" : "The contact"), body.element, watch.element, key,
    h("div", { class: "two" }, ...plots.map((plot) => plot.element), ...loops.map((loop) => loop.element)),
    h("p", {}, h("button", { type: "button", onclick: () => save_trace(trace, `${name}.csv`) }, "Time histories as CSV"), " ",
      h("button", { type: "button", onclick: async () => save_file(`${name}.png`, await png_of([...plots, ...loops].map((plot) => plot.figure()))) }, "Plots as PNG"), " ",
      h("span", { class: "weak" }, `${count(trace.rows)}${trace.rows < trace.head.instants ? ` of ${count(trace.head.instants)}` : ""} instants${trace.rows < trace.head.instants ? ", evenly chosen, and the extremes of the forces" : ""}, solved again by ${trace.head.worker}, solver ${trace.head.solver_version}, ${trace.head.instruction_set}.`)));
  watch.begin();
  return [...all, body, watch];
}
