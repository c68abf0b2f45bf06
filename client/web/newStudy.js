// The form for a new study. It takes values as on the command line, and shows the study's size,
// which the server computes, and the equivalent command.
import { post } from "./api.js";
import { command, h, labelled, picker } from "./lib/dom.js";
import { count, counted, dbFlag, quoted, withUnit } from "./lib/format.js";

const checkAfterMs = 250;
const usualPreset = "standard";
const presets = [
  ["standard", "standard: to predict"],
  ["converged", "converged: reference, slow"],
  ["paper", "paper: as published, coarse mesh"],
  ["printed", "printed: numbers as printed in the paper"],
];
const samples = {
  random: "SAMPLE_RANDOM",
  lhs: "SAMPLE_LATIN_HYPERCUBE",
  sobol: "SAMPLE_SOBOL",
};

function numberOf(key, text) {
  const value = Number(text);
  if (text.trim() !== "" && Number.isFinite(value)) return value;
  throw new Error(`${key}: "${text.trim()}" is not a number`);
}

/**
 * Parses an axis: 0.4 or 0.4,0.6 or FROM:TO:COUNT or FROM:TO:COUNT:log; in a random sample also
 * FROM:TO.
 */
function axisOf(key, text, isSample) {
  const [from, to, number, ...spacing] = text.split(":");
  const range = () => ({ from: numberOf(key, from), to: numberOf(key, to) });
  if (to === undefined) {
    return { key, values: text.split(",").map((part) => numberOf(key, part)) };
  }
  if (number === undefined && isSample) {
    return { key, distribution: { kind: "DISTRIBUTION_UNIFORM", ...range() } };
  }
  if (number === undefined || !["", "log"].includes(spacing.join(":"))) {
    const orEnds = isSample ? "; in a sample also FROM:TO" : "";
    throw new Error(`${key}: a range is FROM:TO:COUNT or FROM:TO:COUNT:log${orEnds}`);
  }
  const isLog = spacing.length > 0 ? { spacing: "SPACING_LOGARITHMIC" } : {};
  return { key, ...range(), count: numberOf(key, number), ...isLog };
}

/** Parses KIND:COUNT:SEED, as in --sample; returns undefined for a grid. */
function sampleOf(text) {
  if (text === "") return undefined;
  const [kind, number, seed = "1", ...more] = text.split(":");
  if (!Object.hasOwn(samples, kind) || number === undefined || more.length > 0) {
    const known = Object.keys(samples).join(", ");
    throw new Error(`sample: write KIND:COUNT:SEED, such as sobol:1000:1; kinds are ${known}`);
  }
  const [size, start] = [number, seed].map((part) => numberOf("sample", part));
  return { kind: samples[kind], count: size, seed: start };
}

/** Returns [key, text] for the model keys that have no field of their own. */
function otherKeys(form) {
  const lines = form.others.split("\n").map((line) => line.trim());
  return lines.filter(Boolean).map((line) => {
    const [key, text] = line.split("=", 2).map((part) => part.trim());
    if (!text) throw new Error(`"${line}": write KEY=VALUES, one key per line`);
    return [key, text];
  });
}

function submissionOf(form) {
  const { name, where, preset } = form;
  if (name === "") throw new Error("the study needs a name");
  const sample = sampleOf(form.sample);
  const axis = ([key, text]) => axisOf(key, text, sample !== undefined);
  // Keys with a single value belong to the model, as with flags. Other model keys become axes, in
  // the order of their names, before H, mu and e.
  const others = otherKeys(form).map(axis);
  const isSingle = (one) => one.values?.length === 1 && !/^length\d/.test(one.key);
  const varied = others.filter((one) => !isSingle(one)).sort((a, b) => (a.key < b.key ? -1 : 1));
  const point = ["H", "mu", "e"].map((key) => axis([key, form[key]]));
  const model = Object.fromEntries(others.filter(isSingle).map((one) => [one.key, one.values[0]]));
  const block = { axes: [...varied, ...point], ...(sample && { sample }), ...(where && { where }) };
  return { name, model: { preset, ...model }, recipe: { blocks: [block] } };
}

/** Returns the contents of the form as flags of a command. */
function flagsOf(form) {
  const flag = (name, value) => (value === "" ? [] : [`--${name.replaceAll("_", "-")}`, value]);
  const all = [
    ...flag("name", form.name || "NAME"),
    ...(form.preset === usualPreset ? [] : flag("preset", form.preset)),
    ...otherKeys(form).flatMap(([key, text]) => flag(key, text)),
    ...["H", "mu", "e", "sample", "where"].flatMap((name) => flag(name, form[name])),
  ];
  return all.map(quoted).join(" ");
}

function shownBytes(bytes) {
  const power = Math.min(Math.max(Math.floor(Math.log10(bytes) / 3), 1), 3);
  const size = bytes / 1000 ** power;
  return `${size < 10 ? size.toFixed(1) : count(size)} ${["", "kB", "MB", "GB"][power]}`;
}

/** Formats the server's answer to `/api/check` as a sentence. */
function sizeOf({ points, is_counted, models, falls, falls_estimated, bytes, surely_reached_m }) {
  const about = (isEstimate) => (isEstimate ? "about " : "");
  const size =
    `${about(!is_counted)}${counted(points, "point")}, ${counted(models, "model")} with ` +
    `${about(falls_estimated)}${counted(falls, falls === 1 ? "fall" : "different fall")}, ` +
    `about ${shownBytes(bytes)} in the database.`;
  if (!surely_reached_m) return size;
  const reached = withUnit(surely_reached_m, "H", "m");
  return `${size} Points with an H above ${reached} fail if the tip does not fall that far.`;
}

function fieldsOf(changed) {
  const settings = { spellcheck: false, autocomplete: "off", oninput: changed };
  const text = (value, placeholder) =>
    h("input", { type: "text", value, placeholder, ...settings });
  const fields = {
    name: text("", "friction"),
    H: text("1", "0.3:1.1:33"),
    mu: text("0.1:2:40", "0.1:2:40"),
    e: text("1", "0.6,0.8,1"),
    preset: picker(presets, usualPreset, changed),
    others: h("textarea", { rows: 2, placeholder: "k=1e7:3e7:5", ...settings }),
    sample: text("", "sobol:1000:1"),
    where: text("", "mu > 0.5 * e"),
  };
  const values =
    "0.4, or 0.4,0.6,0.8, or FROM:TO:COUNT, or FROM:TO:COUNT:log; in a random sample also FROM:TO";
  const elements = [
    labelled("name", fields.name),
    labelled("H, drop height [m]", fields.H, values),
    labelled("mu, friction", fields.mu, values),
    labelled("e, restitution", fields.e, values),
    labelled("preset of the model", fields.preset),
    labelled(
      "other keys of the model, one per line",
      fields.others,
      `KEY=VALUES; values: ${values}`,
    ),
    labelled("random sample", fields.sample, "KIND:COUNT:SEED; KIND is random, lhs or sobol"),
    labelled("filter", fields.where, "a condition on inputs; other points are left out"),
  ];
  const texts = () => Object.entries(fields).map(([name, field]) => [name, field.value.trim()]);
  return { elements, first: fields.name, read: () => Object.fromEntries(texts()) };
}

export function newStudyView(root, place) {
  place.trail(["new study"]);
  if (!place.mayChange) {
    const how = "To submit studies, open the address that oblique-server or oblique view printed.";
    root.append(h("p", how));
    return {};
  }
  const { elements, first, read } = fieldsOf(() => check());
  const size = h("p", { role: "status" });
  const said = h("p.bad", { role: "alert" });
  const submit = h("button", { type: "submit" }, "Submit");
  const commands = h("div");
  const onsubmit = (event) => {
    event.preventDefault();
    start();
  };
  root.append(
    h("h2", "New study"),
    h("form.start", { onsubmit }, ...elements, size, said, submit),
    h("h2", "Command line"),
    commands,
  );
  let timer = 0;
  let asked = new AbortController();
  let isWrong = false;
  let isStarting = false;

  function show(text, wrong = false) {
    size.textContent = text;
    size.className = wrong ? "bad" : "";
    isWrong = wrong;
    submit.disabled = isWrong || isStarting;
  }

  async function ask({ model, recipe }, signal) {
    try {
      show(sizeOf(await post("api/check", { model, recipe }, signal)));
    } catch (error) {
      if (signal.aborted) return;
      if (error.status === 400) show(error.message, true);
      else show(`The server could not check the study: ${error.message}`);
    }
  }

  function check() {
    clearTimeout(timer);
    asked.abort();
    asked = new AbortController();
    said.textContent = "";
    const form = read();
    try {
      const submission = submissionOf({ ...form, name: form.name || "NAME" });
      show("");
      timer = setTimeout(ask, checkAfterMs, submission, asked.signal);
      const make = `oblique ${place.file ? "run" : "submit"} ${flagsOf(form)}${dbFlag(place.file)}`;
      commands.replaceChildren(
        command("the study", make),
        h("p.weak", "To measure the time by solving some points:"),
        command("the time", `oblique study check ${flagsOf(form)}`),
      );
    } catch (error) {
      show(error.message, true);
    }
  }

  async function start() {
    if (isStarting || isWrong) return;
    isStarting = submit.disabled = true;
    try {
      const made = await post("api/studies", submissionOf(read()));
      if (!place.signal.aborted) place.go(`#/study/${made.id}`);
    } catch (error) {
      said.textContent = error.message;
    }
    isStarting = false;
    submit.disabled = isWrong;
  }

  check();
  first.focus();
  return {
    close() {
      clearTimeout(timer);
      asked.abort();
    },
  };
}
