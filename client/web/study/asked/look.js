// @ts-check
// What a study lacks is solved while somebody looks: coarse first, then finer. The server makes a short-lived
// study of it, that comes before all others and goes when nobody asks for it any more.
import { change, json } from "/server.js";
import { rows, slice } from "./picture.js";

/** Each has the values of the one before among its own. */
const kSides = [33, 65, 129];
const kAskAgain_ms = 120;
const kStillHere_ms = 2500;

/** Of a row, as the recipe's model has them. */
const kModelKeys = { E_Pa: "E_Pa", A: "A_m2", I: "I_m4", rho: "rho_kg_m3", g: "g_m_s2", elements_per_link: "elements_per_link", k: "k_N_m", eta2: "eta2",
  tip_mass: "tip_mass_kg", dt: "dt_s", dt_fall: "dt_fall_s", spectral_radius: "spectral_radius", tolerance: "tolerance" };
const kIntegrators = ["explicit", "generalized-alpha"];

/**
 * The model of a block, as one of its solved points has it: others may have axes of the model that it has not.
 * @param {number} study @param {import("../axes.js").Block} block @param {AbortSignal} signal
 */
async function model_of(study, { first_point, points }, signal) {
  let { row } = await json(`/api/studies/${study}/points/${first_point}`, signal);
  if (!row) {
    const some = await rows(study, { select: "point", where: `point >= ${first_point} AND point < ${first_point + points}`, limit: 1 }, signal);
    if (some.rows.length === 0) throw new Error("there is no result yet that tells the model");
    ({ row } = await json(`/api/studies/${study}/points/${some.rows[0][0]}`, signal));
  }
  const model = Object.fromEntries(Object.entries(kModelKeys).map(([column, key]) => [key, row[column]]));
  return { ...model, lengths_m: row.lengths_m, integrator: Math.max(kIntegrators.indexOf(row.integrator), 0) };
}

/**
 * @typedef {object} Wanted
 * @property {number} study
 * @property {import("../axes.js").Block} block
 * @property {string} z
 * @property {Record<string, {from: number, to: number, is_log: boolean}>} ranges of the two axes
 * @property {Record<string, number>} held values of the others
 * @property {string} where which cells are shown; empty: all
 */

/** @param {Wanted} wanted @param {any} model @param {number} side */
function recipe_of(wanted, model, side) {
  const axes = wanted.block.axes.map((axis) => {
    const range = wanted.ranges[axis.key];
    if (range) return { key: axis.key, from: range.from, to: range.to, count: side, ...(range.is_log ? { spacing: "SPACING_LOGARITHMIC" } : {}) };
    return axis.expression ? { key: axis.key, expression: axis.expression } : { key: axis.key, values: [wanted.held[axis.key]] };
  });
  return { model, blocks: [{ axes, ...(wanted.block.where ? { where: wanted.block.where } : {}) }] };
}

const rest = (/** @type {number} */ ms) => new Promise((go_on) => setTimeout(go_on, ms));

/**
 * Pictures as they become better; afterwards it keeps the study alive until `signal`.
 * @param {Wanted} wanted @param {AbortSignal} signal @param {(key: string) => string} unit_of
 * @returns {AsyncGenerator<{id: number, side: number, is_whole: boolean, picture: import("./picture.js").Picture}>}
 */
export async function* finer(wanted, signal, unit_of) {
  const model = await model_of(wanted.study, wanted.block, signal);
  if (signal.aborted) return;
  const [x, y] = Object.keys(wanted.ranges);
  let id = 0;
  for (const side of kSides) {
    ({ id } = await change("/api/look", { recipe: recipe_of(wanted, model, side) }));
    for (let is_whole = false; !is_whole && !signal.aborted;) {
      const picture = await slice(id, { z: wanted.z, x, y, nx: side, ny: side, ...(wanted.where ? { where: wanted.where } : {}) }, signal, unit_of);
      is_whole = picture.head.missing === 0;
      // Half of a finer picture is worse than all of the coarser one.
      if (is_whole || side === kSides[0]) yield { id, side, is_whole, picture };
      if (!is_whole) await rest(kAskAgain_ms);
    }
    if (signal.aborted) return;
  }
  while (!signal.aborted) {
    await rest(kStillHere_ms);
    if (!document.hidden && !signal.aborted) await json(`/api/studies/${id}`, signal);
  }
}

/** @param {number} id @param {string} name */
export const keep = (id, name) => change(`/api/look/${id}/keep`, { name });
