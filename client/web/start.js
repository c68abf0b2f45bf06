// @ts-check
// A study that is started here: values as on the command line, how much it is, and what the server says of it.
import { h, named, picker, copied } from "/parts/dom.js";
import { count, quoted, time_left } from "/parts/format.js";
import { change } from "/server.js";

/** The most that a double counts without gaps. */
const kMostCounted = 2 ** 53;
const kBytesPerPoint = 450; // measured: a row with its packed arrays
const kJudgeAfter_ms = 250;

/**
 * An axis as a flag has it: 0.4 or 0.4,0.6,0.8 or FROM:TO:COUNT or FROM:TO:COUNT:log.
 * @param {string} key @param {string} text @returns {{axis: any, values: number}}
 */
export function axis_of(key, text) {
  const number = (/** @type {string} */ part) => {
    const value = Number(part);
    if (part.trim() === "" || !Number.isFinite(value)) throw new Error(`${key}: "${part.trim()}" is no number`);
    return value;
  };
  if (!text.includes(":")) {
    const values = text.split(",").map(number);
    return { axis: { key, values }, values: values.length };
  }
  const parts = text.split(":");
  const is_log = parts.length === 4 && parts[3].trim() === "log";
  if (parts.length !== 3 && !is_log) throw new Error(`${key}: a range is FROM:TO:COUNT or FROM:TO:COUNT:log`);
  const [from, to, values] = parts.slice(0, 3).map(number);
  if (!Number.isInteger(values) || values < 1) throw new Error(`${key}: the count must be a whole number from 1`);
  return { axis: { key, from, to, count: values, ...(is_log ? { spacing: "SPACING_LOGARITHMIC" } : {}) }, values };
}

/** @param {{name: string, H: string, mu: string, e: string, others: string, where: string, priority: string}} form */
export function submission_of(form) {
  // Model keys come first, then H, mu, e.
  const others = form.others.split(/\n/).map((line) => line.trim()).filter((line) => line !== "").map((line) => {
    const [key, text] = line.split("=", 2);
    if (!text) throw new Error(`"${line}": other keys are written as KEY=VALUES, one a line`);
    return axis_of(key.trim(), text.trim());
  });
  const axes = [...others, axis_of("H", form.H), axis_of("mu", form.mu), axis_of("e", form.e)];
  const points = axes.reduce((product, axis) => product * axis.values, 1);
  if (form.name.trim() === "") throw new Error("name: a study has one");
  return { points, body: { name: form.name.trim(), priority: Number(form.priority) || 0,
    recipe: { blocks: [{ axes: axes.map((one) => one.axis), ...(form.where.trim() ? { where: form.where.trim() } : {}) }] } } };
}

/** @param {HTMLElement} root @param {import("/main.js").Place} place @returns {import("/main.js").View} */
export function start_view(root, place) {
  place.trail(["new study"]);
  if (!place.may_change) {
    root.append(h("p", {}, "Studies are started with the address that the server printed, or that oblique view prints."));
    return {};
  }
  const text = (/** @type {string} */ value, /** @type {string} */ hint) => h("input", { type: "text", value, placeholder: hint, spellcheck: false, autocomplete: "off", oninput: () => tell() });
  const fields = { name: text("", "friction"), H: text("1", "0.3:1.1:33"), mu: text("0.1:2:40", "0.1:2:40"), e: text("1", "0.6,0.8,1"),
    others: h("textarea", { rows: 2, placeholder: "k=1e7:3e7:5", spellcheck: false, oninput: () => tell() }), where: text("", "mu > 0.5 * e"),
    priority: picker([["0", "usual"], ["10", "before others"], ["-10", "after others"]], "0", () => tell()) };
  const size = h("p", { role: "status" });
  const said = h("p", { role: "alert", class: "bad" });
  const commands = h("div", {});
  const submit = h("button", { type: "submit" }, "Start");
  const form = h("form", { class: "start", onsubmit: (/** @type {Event} */ event) => {
    event.preventDefault();
    start();
  } },
  named("name", fields.name), named("H, drop height [m]", fields.H), named("mu, friction", fields.mu), named("e, restitution", fields.e),
  named("other keys of the model, one a line", fields.others), named("only points where", fields.where), named("priority", fields.priority),
  h("p", { class: "weak" }, "Values: 0.4, or 0.4,0.6,0.8, or FROM:TO:COUNT, or FROM:TO:COUNT:log."), size, said, submit);
  root.append(h("h2", {}, "Start a study"), form, commands);

  const values = () => /** @type {any} */ (Object.fromEntries(Object.entries(fields).map(([name, field]) => [name, field.value])));
  let later = 0;
  let turn = 0;
  const object_to = (/** @type {any} */ error) => {
    size.textContent = String(error.message);
    size.className = "bad";
    submit.disabled = true;
  };
  /** How much it is. @param {number} points @param {boolean} is_counted */
  function tell_size(points, is_counted) {
    const now = place.now();
    const seconds = now && now.threads > 0 && now.thread_s_per_point > 0 ? (points * now.thread_s_per_point) / now.threads : null;
    const bytes = points * kBytesPerPoint;
    size.textContent = `${count(points)} ${points === 1 ? "point" : "points"}${is_counted ? "" : " at most"}`
      + (seconds !== null ? `, about ${time_left(seconds)} with the ${now.threads} threads that are here` : "")
      + (bytes > 1e6 ? `, about ${bytes > 1e9 ? `${(bytes / 1e9).toFixed(1)} GB` : `${Math.round(bytes / 1e6)} MB`} in the database` : "") + ".";
    size.className = "";
    submit.disabled = false;
  }
  function tell() {
    said.textContent = "";
    clearTimeout(later);
    const mine = ++turn;
    try {
      const v = values();
      const told = submission_of({ ...v, name: v.name || "name" });
      if (told.points > kMostCounted) throw new Error("that is more points than a study may have");
      tell_size(told.points, v.where.trim() === "");
      const others = v.others.split(/\n/).filter((/** @type {string} */ line) => line.trim() !== "").flatMap((/** @type {string} */ line) => {
        const [key, text_] = line.split("=", 2);
        return [`--${key.trim().replaceAll("_", "-")}`, text_.trim()];
      });
      commands.replaceChildren(h("p", {}, "The same on a command line:"), copied("the command of the study", ["oblique", "submit", "--name", v.name || "NAME",
        ...others, "--H", v.H, "--mu", v.mu, "--e", v.e, ...(v.where.trim() ? ["--where", v.where.trim()] : [])].map(quoted).join(" ")));
      // What the grammar of recipes and filters says of it.
      later = setTimeout(async () => {
        try {
          const judged = await change("/api/check", { recipe: told.body.recipe });
          if (mine === turn) tell_size(judged.points, judged.is_counted);
        } catch (error) {
          if (mine === turn) object_to(error);
        }
      }, kJudgeAfter_ms);
    } catch (error) {
      object_to(error);
    }
  }
  async function start() {
    try {
      submit.disabled = true;
      const made = await change("/api/studies", submission_of(values()).body);
      location.hash = `#/study/${made.id}`;
    } catch (error) {
      said.textContent = String(/** @type {Error} */ (error).message);
      submit.disabled = false;
    }
  }
  tell();
  fields.name.focus();
  return { close: () => clearTimeout(later) };
}
