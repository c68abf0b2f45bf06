// @ts-check
// A point: its numbers, its contact over time, and the finger moving.
import { copied, h, named, picker, save } from "/parts/dom.js";
import { file_link, file_sayer } from "/parts/file_link.js";
import { count, of_file, quoted, shown, with_unit } from "/parts/format.js";
import { line_plot } from "/parts/lines.js";
import { completed } from "/overview.js";
import { json } from "/server.js";
import { wanted_of } from "/study/asked/between.js";
import { held_open } from "/study/asked/look.js";
import { finger } from "./finger.js";
import { loop_plot } from "./loop.js";
import { point_numbers } from "./numbers.js";
import { player } from "./player.js";
import { trace_of } from "./trace.js";

const kAskAgain_ms = 300;
/** So often in a row a study that lies between is not there before that is said. */
const kGoneAtMost = 40;

/**
 * Asks the study that has the point; one that lies between those of the study is in a study that may go, and then is
 * begun anew under another number, which takes a moment.
 * @param {() => number} id @param {boolean} is_between @param {AbortSignal} signal
 */
function asker_of(id, is_between, signal) {
  return async (/** @type {(study: number) => Promise<any>} */ ask) => {
    for (let left = is_between ? kGoneAtMost : 0; ; --left) {
      try {
        return await ask(id());
      } catch (error) {
        if (signal.aborted || left === 0 || /** @type {any} */ (error).status !== 404) throw error;
      }
      await pause(signal);
    }
  };
}

/** @param {AbortSignal} signal */
async function pause(signal) {
  await new Promise((go_on) => setTimeout(go_on, kAskAgain_ms));
  signal.throwIfAborted();
}

/**
 * A point as the server tells it. One that lies between those of the study is solved first, which takes a moment.
 * @param {ReturnType<typeof asker_of>} of_study @param {number} point @param {boolean} is_between @param {AbortSignal} signal
 */
async function told_of(of_study, point, is_between, signal) {
  for (;;) {
    const told = await of_study((study) => json(`/api/studies/${study}/points/${point}`, signal));
    if (!is_between || told.row || told.fault || told.left_out) return told;
    await pause(signal);
  }
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

/** The command that solves a point of no study that stays. @param {any} whole @param {any} wanted @param {any} row */
function solve_command(whole, wanted, row) {
  const lengths = (/** @type {string} */ key) => /^(links|lengths?\d*)$/.test(key);
  const changed = whole.model.filter((/** @type {any} */ one) => !one.usual && one.value !== null).map((/** @type {any} */ one) => one.key);
  const keys = new Set([...wanted.block.axes.map((/** @type {any} */ axis) => axis.key), ...changed].map((key) => (lengths(key) ? "lengths" : key)));
  for (const key of ["H", "mu", "e"]) keys.delete(key);
  const value = (/** @type {string} */ key) => (key === "lengths" ? row.lengths_m.join(",") : row[key === "E" ? "E_Pa" : key]);
  return ["oblique solve", ...["H", "mu", "e", ...keys].map((key) => `--${key.replaceAll("_", "-")} ${quoted(String(value(key)))}`), "--trace trace.csv"].join(" ");
}

/**
 * @param {HTMLElement} root @param {import("/main.js").Place} place @param {number} study @param {number} point
 * @returns {Promise<import("/main.js").View>}
 */
export async function point_view(root, place, study, point) {
  const { signal } = place;
  const whole = await json(`/api/studies/${study}`, signal);
  const said = h("p", { role: "status", class: "said" }, "A worker solves this point again.");
  /** Of points that lie between those of the study. */
  const is_between = place.fields.has("between");
  const side = Number(place.fields.get("side"));
  const of_view = new URLSearchParams(place.fields);
  of_view.delete("side");
  const back = is_between ? `#/study/${study}?${of_view}` : place.last(`/study/${study}`);
  const trail = (/** @type {string} */ what) => place.trail([h("a", { href: back }, whole.name), what]);
  /** The study that has the point. */
  let id = study;
  /** @type {any} */
  let wanted = null;
  /** @type {any} */
  let told = null;
  const take = h("section", {});
  if (is_between) {
    trail(`between its points, ${count(point)}`);
    root.append(said);
    wanted = await wanted_of(whole, place.fields, signal);
    id = await held_open(wanted, side, signal, (other) => {
      id = other;
      show_take();
    });
  } else {
    trail(`point ${count(point)}`);
  }
  const of_study = asker_of(() => id, is_between, signal);
  const name = () => (is_between ? `${whole.name}-between` : told.name);
  function show_take() {
    if (told) take.replaceChildren(...things_to_take(id, point, name(), told.row, whole, wanted, of_file(place.file)));
  }
  const [facts, numbers] = [h("div", {}), h("div", {})];
  function show_known() {
    const known = known_of(told, whole.columns);
    facts.replaceChildren(...known.facts);
    numbers.replaceChildren(...known.numbers);
  }
  told = await told_of(of_study, point, is_between, signal);
  const pictures = h("section", { "aria-label": "The contact over time" }, said);
  const other = (/** @type {number} */ number) => `#/study/${study}/point/${number}${is_between ? `?${place.fields}` : ""}`;
  const neighbours = h("div", { class: "row" },
    point > 0 && h("a", { class: "button", href: other(point - 1) }, "Previous point"),
    point + 1 < (is_between ? side * side : whole.numbers) && h("a", { class: "button", href: other(point + 1) }, "Next point"));
  show_known();
  show_take();
  root.replaceChildren(h("h2", { class: "name" }, is_between ? `${whole.name}, between its points: ${count(point)} of ${side} × ${side}` : `${told.name}, point ${count(point)}`),
    neighbours, facts, pictures, numbers, take);
  /** @type {{close: () => void}[]} */
  const parts = [];
  trace_of(of_study, point, signal, (text, is_bad) => {
    said.textContent = text;
    said.className = is_bad ? "said bad" : "said";
  }).then((trace) => {
    if (signal.aborted) return;
    parts.push(...show_trace(pictures, trace, `${is_between ? name() : `point-${study}`}-${point}.csv`));
  }).catch((error) => {
    if (signal.aborted) return;
    said.className = "said bad";
    said.textContent = `No time histories: ${error.message}`;
  });
  return { take: look_again(study, () => told, async () => {
    told = await told_of(of_study, point, is_between, signal);
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

const kPanels = ["forces", "loop", "deformation", "velocities", "energies", "shape"];

/** Its pictures as oblique plot draws them, and the command. @param {number} study @param {number} point @param {string} name @param {string | null} from of which file the command reads it; null: there is none */
function pictures_to_take(study, point, name, from) {
  const files = h("div", { class: "row files" });
  const { said, say } = file_sayer();
  const command = h("div", {});
  const choose = (/** @type {string} */ panel) => {
    const link = (/** @type {string} */ format) => file_link(format.toUpperCase(), `${name}-${point}.${format}`,
      `/api/studies/${study}/points/${point}/picture?${new URLSearchParams({ ...(panel ? { panel } : {}), format })}`, say);
    say("");
    files.replaceChildren(...["svg", "png", "csv"].map(link), said);
    if (from !== null) command.replaceChildren(copied("the command of the picture", `oblique plot ${quoted(name)} --point ${point}${panel ? ` --panel ${panel}` : ""} --out picture.svg${from}`));
  };
  choose("");
  return [h("div", { class: "row" }, named("pictures, as oblique plot draws them", picker([["", "all"], ...kPanels.map((one) => [one, one])], "", choose)), files), command];
}

/**
 * @param {number} id of the study that has it @param {number} point @param {string} name @param {any} row null: it is not solved
 * @param {any} whole the study @param {any} wanted what lies between its points; null: it is one of them @param {string} from of which file commands read it
 */
function things_to_take(id, point, name, row, whole, wanted, from) {
  const commands = wanted ? [h("p", {}, "The address of this page finds this point again or solves it anew, as does:"), ...(row ? [copied("the command of the point", solve_command(whole, wanted, row))] : [])]
    : [h("p", {}, "Its time histories:"), copied("the command of the trace", `oblique trace ${quoted(name)} ${point} --out trace.csv${from}`),
      h("p", {}, "Its row:"), copied("the command of the row", `oblique query ${quoted(name)} --where 'point = ${point}'${from}`)];
  return [h("h2", {}, "Take it with you"), ...pictures_to_take(id, point, name, wanted ? null : from), ...commands,
    h("a", { class: "button", download: `${name}-${point}-row.csv`, href: `/api/studies/${id}/rows?${new URLSearchParams({ where: `point = ${point}`, format: "csv" })}` }, "Row as CSV")];
}

/** @param {import("./trace.js").Trace} trace @param {string} name */
function save_trace(trace, name) {
  const columns = trace.head.columns.filter((/** @type {any} */ c) => c.numbers === 1);
  const values = columns.map((/** @type {any} */ c) => trace.column(c.name));
  const lines = [[...columns.map((/** @type {any} */ c) => c.name), "state"].join(",")];
  for (let i = 0; i < trace.rows; ++i) lines.push([...values.map((/** @type {Float64Array} */ v) => v[i]), trace.state(i)].join(","));
  save(name, "text/csv", lines.join("\r\n") + "\r\n");
}

/** @param {HTMLElement} place @param {import("./trace.js").Trace} trace @param {string} file */
function show_trace(place, trace, file) {
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
    h("p", {}, h("button", { type: "button", onclick: () => save_trace(trace, file) }, "Time histories as CSV"), " ",
      h("span", { class: "weak" }, `${count(trace.rows)}${trace.rows < trace.head.instants ? ` of ${count(trace.head.instants)}` : ""} instants${trace.rows < trace.head.instants ? ", evenly chosen" : ""}, solved again by ${trace.head.worker}, solver ${trace.head.solver_version}, ${trace.head.instruction_set}.`)));
  watch.begin();
  return [...all, body, watch];
}
