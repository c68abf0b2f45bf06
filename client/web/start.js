// @ts-check
// A study that is started here: values as on the command line, how much it is by the server's count.
import { copied, h, named, picker, tick } from "/parts/dom.js";
import { count, of_file, quoted, with_unit } from "/parts/format.js";
import { change } from "/server.js";

/** The most that a double counts without gaps. */
const kMostCounted = 2 ** 53;
const kJudgeAfter_ms = 250;

const kDistributions = /** @type {Record<string, string>} */ ({ uniform: "DISTRIBUTION_UNIFORM", "log-uniform": "DISTRIBUTION_LOG_UNIFORM", normal: "DISTRIBUTION_NORMAL" });
const kSamples = /** @type {Record<string, string>} */ ({ random: "SAMPLE_RANDOM", lhs: "SAMPLE_LATIN_HYPERCUBE", sobol: "SAMPLE_SOBOL" });

/** @param {string} key @param {string} part */
function number_of(key, part) {
  const value = Number(part);
  if (part.trim() === "" || !Number.isFinite(value)) throw new Error(`${key}: "${part.trim()}" is no number`);
  return value;
}

/** A whole number from `least`. @param {string} key @param {string} what @param {string} part @param {number} least */
function whole_of(key, what, part, least) {
  const value = number_of(key, part);
  if (!Number.isInteger(value) || value < least) throw new Error(`${key}: the ${what} must be a whole number from ${least}`);
  return value;
}

/**
 * An axis as a flag has it: 0.4 or 0.4,0.6,0.8 or FROM:TO:COUNT or FROM:TO:COUNT:log; of a sample one value, FROM:TO or a distribution.
 * @param {string} key @param {string} text @param {boolean} [is_drawn] in a sample @returns {{axis: any, values: number}}
 */
export function axis_of(key, text, is_drawn = false) {
  const drawn = is_drawn ? drawn_axis(key, text.trim()) : null;
  if (drawn) return { axis: { key, distribution: drawn }, values: 1 };
  if (!text.includes(":")) {
    const values = text.split(",").map((part) => number_of(key, part));
    return { axis: { key, values }, values: values.length };
  }
  const parts = text.split(":");
  const is_log = parts.length === 4 && parts[3].trim() === "log";
  if (parts.length !== 3 && !is_log) throw new Error(`${key}: a range is FROM:TO:COUNT or FROM:TO:COUNT:log${is_drawn ? "; of a sample FROM:TO" : ""}`);
  const [from, to] = parts.slice(0, 2).map((part) => number_of(key, part));
  const values = whole_of(key, "count", parts[2], 1);
  return { axis: { key, from, to, count: values, ...(is_log ? { spacing: "SPACING_LOGARITHMIC" } : {}) }, values };
}

/** What an axis of a sample is drawn from; null: it is written otherwise. @param {string} key @param {string} text */
function drawn_axis(key, text) {
  const [, name, inside] = /^([a-z-]+)\((.*)\)$/.exec(text) ?? [];
  const ends = (/** @type {(string | undefined)[]} */ parts) => Object.fromEntries(["from", "to"].flatMap((end, i) => (parts[i]?.trim() ? [[end, number_of(key, /** @type {string} */ (parts[i]))]] : [])));
  if (name === undefined) {
    const parts = text.split(":");
    return parts.length === 2 ? { kind: kDistributions.uniform, from: number_of(key, parts[0]), to: number_of(key, parts[1]) } : null;
  }
  const parts = inside.split(",");
  if (!Object.hasOwn(kDistributions, name)) throw new Error(`${key}: there is no distribution ${name}; there are ${Object.keys(kDistributions).join(", ")}`);
  const kind = kDistributions[name];
  if (name !== "normal" && parts.length === 2) return { kind, from: number_of(key, parts[0]), to: number_of(key, parts[1]) };
  if (name === "normal" && (parts.length === 2 || parts.length === 4)) return { kind, mean: number_of(key, parts[0]), sd: number_of(key, parts[1]), ...ends(parts.slice(2)) };
  throw new Error(`${key}: write ${name === "normal" ? "normal(MEAN,SD) or normal(MEAN,SD,FROM,TO)" : `${name}(FROM,TO)`}`);
}

/** As --sample has it; undefined: nothing is drawn. @param {string} text */
function sample_of(text) {
  if (text === "") return undefined;
  const [kind, count_, seed = "1", ...others] = text.split(":");
  if (!Object.hasOwn(kSamples, kind) || count_ === undefined || others.length > 0) throw new Error("sample: write KIND:COUNT:SEED, as sobol:1000:1; kinds are random, lhs and sobol");
  return { kind: kSamples[kind], count: whole_of("sample", "count", count_, 1), seed: whole_of("sample", "seed", seed, 0) };
}

/**
 * What somebody has filled in.
 * @typedef {{name: string, H: string, mu: string, e: string, others: string, where: string, priority: string, preset: string, integrator: string, sample: string, errors: boolean}} Form
 */

/** Keys of the model that the form has no field for, and their values. @param {Form} form */
function others_of(form) {
  return form.others.split(/\n/).map((line) => line.trim()).filter((line) => line !== "").map((line) => {
    const [key, text] = line.split("=", 2);
    if (!text) throw new Error(`"${line}": other keys are written as KEY=VALUES, one a line`);
    return [key.trim(), text.trim()];
  });
}

/** @param {Form} form */
function submission_of(form) {
  const sample = sample_of(form.sample.trim());
  const axis = (/** @type {string} */ key, /** @type {string} */ text) => axis_of(key, text, sample !== undefined);
  // Single values are part of the model, as those of flags are; model keys come first, by name, then H, mu, e.
  const others = others_of(form).map(([key, text]) => ({ key, ...axis(key, text) }));
  const is_single = (/** @type {any} */ one) => one.axis.values?.length === 1 && !/^length\d/.test(one.key);
  const model = { preset: form.preset, integrator: form.integrator, ...Object.fromEntries(others.filter(is_single).map((one) => [one.key, one.axis.values[0]])) };
  const varied = others.filter((one) => !is_single(one)).sort((a, b) => (a.key < b.key ? -1 : 1));
  const axes = [...varied, axis("H", form.H), axis("mu", form.mu), axis("e", form.e)];
  const points = sample ? sample.count : axes.reduce((product, one) => product * one.values, 1);
  if (form.name.trim() === "") throw new Error("name: a study has one");
  const where = form.where.trim();
  return { points, body: { name: form.name.trim(), priority: Number(form.priority) || 0, model,
    recipe: { errors: form.errors, blocks: [{ axes: axes.map((one) => one.axis), ...(sample ? { sample } : {}), ...(where ? { where } : {}) }] } } };
}

/** The flags of the study on a command line. @param {Form} form @param {boolean} [with_priority] */
function flags_of(form, with_priority = false) {
  const flag = (/** @type {string} */ name, /** @type {string} */ value, /** @type {string} */ usual = "") => (value.trim() === usual ? [] : [`--${name}`, value.trim()]);
  return ["--name", form.name.trim() || "NAME", ...flag("preset", form.preset, kUsual.preset), ...flag("integrator", form.integrator, kUsual.integrator),
    ...others_of(form).flatMap(([key, text]) => flag(key.replaceAll("_", "-"), text)), ...flag("H", form.H), ...flag("mu", form.mu), ...flag("e", form.e),
    ...flag("sample", form.sample), ...flag("where", form.where), ...(form.errors ? ["--errors"] : []), ...(with_priority ? flag("priority", form.priority, kUsual.priority) : [])].map(quoted).join(" ");
}

/** The command that makes the same study. @param {Form} form @param {string} file in which it is solved; empty: by the server */
const command_of = (form, file) => `oblique ${file ? "run" : "submit"} ${flags_of(form, !file)}${of_file(file)}`;

/** What a form says unless somebody chooses. */
const kUsual = { preset: "standard", integrator: "explicit", priority: "0" };

/** Its fields. @param {() => void} changed */
function fields_of(changed) {
  const text = (/** @type {string} */ value, /** @type {string} */ hint) => h("input", { type: "text", value, placeholder: hint, spellcheck: false, autocomplete: "off", oninput: changed });
  const fields = { name: text("", "friction"), H: text("1", "0.3:1.1:33"), mu: text("0.1:2:40", "0.1:2:40"), e: text("1", "0.6,0.8,1"),
    preset: picker([["standard", "standard: to predict"], ["paper", "paper: as published, forces 3 % off"], ["printed", "printed: as the paper prints it"], ["converged", "converged: the reference, slow"]], kUsual.preset, changed),
    integrator: picker([["explicit", "explicit"], ["generalized-alpha", "generalized-alpha: the reference, slow"]], kUsual.integrator, changed),
    others: h("textarea", { rows: 2, placeholder: "k=1e7:3e7:5", spellcheck: false, oninput: changed }), sample: text("", "sobol:1000:1"), where: text("", "mu > 0.5 * e"),
    priority: picker([["0", "usual"], ["10", "before others"], ["-10", "after others"]], kUsual.priority, changed) };
  const errors = tick("estimate errors, at a quarter more cost", false, changed);
  return { first: fields.name,
    elements: [named("name", fields.name), named("H, drop height [m]", fields.H), named("mu, friction", fields.mu), named("e, restitution", fields.e),
      named("model to start from", fields.preset), named("integrator", fields.integrator), named("other keys of the model, one a line", fields.others),
      named("points drawn, not multiplied: KIND:COUNT:SEED", fields.sample), named("only points where", fields.where), errors, named("priority", fields.priority)],
    /** @returns {Form} */
    values: () => /** @type {any} */ ({ ...Object.fromEntries(Object.entries(fields).map(([name, field]) => [name, field.value])), errors: errors.querySelector("input").checked }) };
}

/**
 * What is known of a study before it starts: what the server answers to `/api/check`, or only how many points it has at most.
 * @typedef {{points: number, is_counted: boolean, models?: number, falls?: number, falls_estimated?: boolean, bytes?: number, surely_reached_m?: number | null}} Judged
 */

/** @param {number} bytes */
function shown_bytes(bytes) {
  const [size, unit] = bytes < 1e6 ? [bytes / 1e3, "kB"] : bytes < 1e9 ? [bytes / 1e6, "MB"] : [bytes / 1e9, "GB"];
  return `${size < 10 ? size.toFixed(1) : count(Math.round(size))} ${unit}`;
}

/** How much a study is, in the numbers of `oblique study check`. @param {Judged} judged */
function size_of({ points, is_counted, models = 0, falls = 0, falls_estimated, bytes = 0, surely_reached_m: reached_m }) {
  const many = (/** @type {number} */ number, /** @type {string} */ one, /** @type {string} */ more = `${one}s`) => `${count(number)} ${number === 1 ? one : more}`;
  const said = [(is_counted ? "" : "about ") + many(points, "point")];
  if (models > 0) said.push(`${many(models, "model")} with ${falls_estimated ? "about " : ""}${many(falls, "fall", "different falls")}`, `about ${shown_bytes(bytes)} in the database`);
  return [`${said.join(", ")}.`,
    ...(reached_m ? [`Whether the tip comes down further than ${with_unit(reached_m, "m")} only its fall tells: points with an H that it never reaches will fail.`] : [])].join(" ");
}

/**
 * Tells how much the last values are, at once as far as the page knows and then by the server.
 * @param {import("/main.js").Place} place @param {(text: string, is_wrong?: boolean) => void} show
 */
function judging_of(place, show) {
  let later = 0;
  /** What is asked of the last values. */
  let asked = new AbortController();
  /** What the grammar of recipes and filters says of it. @param {Form} form @param {any} body @param {string} before what is said already */
  async function judge(form, body, before) {
    const { signal } = asked;
    try {
      const judged = await change("/api/check", { recipe: body.recipe, model: body.model }, signal);
      show(size_of(judged));
    } catch (error) {
      if (signal.aborted) return;
      const { status, message } = /** @type {any} */ (error);
      if (status === 400) show(message, true);
      else show(`${before} It could not be judged before it starts: ${message}`);
    }
  }
  function end() {
    clearTimeout(later);
    asked.abort();
  }
  return { end,
    /** Of other values than before. Throws what is wrong with them as they are written. @param {Form} form */
    begin(form) {
      end();
      asked = new AbortController();
      const { points, body } = submission_of({ ...form, name: form.name || "name" });
      if (points > kMostCounted) throw new Error("that is more points than a study may have");
      const before = size_of({ points, is_counted: form.where.trim() === "" });
      show(before);
      later = setTimeout(() => judge(form, body, before), kJudgeAfter_ms);
    } };
}

/** @param {HTMLElement[]} elements its fields @param {() => void} start */
function form_of(elements, start) {
  const size = h("p", { role: "status" });
  const said = h("p", { role: "alert", class: "bad" });
  const submit = h("button", { type: "submit" }, "Start");
  const element = h("form", { class: "start", onsubmit: (/** @type {Event} */ event) => {
    event.preventDefault();
    start();
  } }, ...elements, h("p", { class: "weak" }, "Values: 0.4, or 0.4,0.6,0.8, or FROM:TO:COUNT, or FROM:TO:COUNT:log. Of points that are drawn: 0.4, or FROM:TO, or normal(MEAN,SD)."), size, said, submit);
  return { element, size, said, submit };
}

/** @param {HTMLElement} root @param {import("/main.js").Place} place @returns {import("/main.js").View} */
export function start_view(root, place) {
  place.trail(["new study"]);
  if (!place.may_change) {
    root.append(h("p", {}, "Studies are started with the address that the server printed, or that oblique view prints."));
    return {};
  }
  const { first, elements, values } = fields_of(() => tell());
  const form = form_of(elements, () => start());
  const commands = h("div", {});
  root.append(h("h2", {}, "Start a study"), form.element, commands);
  let is_wrong = false;
  let is_starting = false;
  let is_closed = false;
  const judging = judging_of(place, show);
  /** @param {string} text @param {boolean} [wrong] they are no study */
  function show(text, wrong = false) {
    form.size.textContent = text;
    form.size.className = wrong ? "bad" : "";
    is_wrong = wrong;
    form.submit.disabled = is_wrong || is_starting;
  }
  function tell() {
    form.said.textContent = "";
    const filled = values();
    try {
      judging.begin(filled);
      commands.replaceChildren(h("p", {}, `The same on a command line${place.file && ", once oblique view has ended"}:`), copied("the command of the study", command_of(filled, place.file)),
        h("p", {}, "How long it takes, measured where this command runs:"), copied("the command that measures the time", `oblique study check ${flags_of(filled)}`));
    } catch (error) {
      show(String(/** @type {Error} */ (error).message), true);
    }
  }
  async function start() {
    if (is_starting || is_wrong) return;
    is_starting = form.submit.disabled = true;
    try {
      const made = await change("/api/studies", submission_of(values()).body);
      if (!is_closed) location.hash = `#/study/${made.id}`;
    } catch (error) {
      form.said.textContent = String(/** @type {Error} */ (error).message);
    }
    is_starting = false;
    form.submit.disabled = is_wrong;
  }
  tell();
  first.focus();
  return { close() {
    is_closed = true;
    judging.end();
  } };
}
