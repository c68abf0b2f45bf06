// @ts-check
// What a study lacks is solved while somebody looks: coarse first, then finer. The server makes a short-lived
// study of it, that comes before all others and goes when nobody asks for it any more.
import { Refusal, change, json } from "/server.js";
import { slice } from "./picture.js";

/** Each has the values of the one before among its own. */
const kSides = [33, 65, 129];
/** A quick picture is there in some tenths of a second, and one that is not need not be asked for so often. */
const kAskSoon_ms = 25;
const kAskAgain_ms = 120;
const kQuick_ms = 1000;
/** Drawing parts of what comes whole in moments would hold it up. */
const kMoments_ms = 300;
const kStillHere_ms = 2500;

/** Keys of the model as a recipe has them. */
const kModelKeys = { E: "E_Pa", A: "A_m2", I: "I_m4", rho: "rho_kg_m3", g: "g_m_s2", elements_per_link: "elements_per_link", k: "k_N_m", eta2: "eta2",
  tip_mass: "tip_mass_kg", dt: "dt_s", dt_fall: "dt_fall_s", spectral_radius: "spectral_radius", tolerance: "tolerance", lengths: "lengths_m" };
const kIntegrators = ["explicit", "generalized-alpha"];

/** What holds where no axis says otherwise. @param {{key: string, value: any}[]} model as the study tells it */
function model_of(model) {
  const value = (/** @type {string} */ key) => model.find((one) => one.key === key)?.value;
  return { ...Object.fromEntries(Object.entries(kModelKeys).map(([key, name]) => [name, value(key)])), integrator: Math.max(kIntegrators.indexOf(value("integrator")), 0) };
}

/**
 * @typedef {object} Wanted
 * @property {{key: string, value: any}[]} model of the study, where no axis says otherwise
 * @property {import("../axes.js").Block} block with the axes that are asked for besides its own
 * @property {string} z
 * @property {Record<string, {from: number, to: number, is_log: boolean}>} ranges of the two axes
 * @property {Record<string, number>} held values of the others
 * @property {string} where which cells are shown; empty: all
 */

/** @param {Wanted} wanted @param {number} side */
function recipe_of(wanted, side) {
  const axes = wanted.block.axes.map((axis) => {
    const range = wanted.ranges[axis.key];
    if (range) return { key: axis.key, from: range.from, to: range.to, count: side, ...(range.is_log ? { spacing: "SPACING_LOGARITHMIC" } : {}) };
    return axis.expression ? { key: axis.key, expression: axis.expression } : { key: axis.key, values: [wanted.held[axis.key]] };
  });
  return { model: model_of(wanted.model), blocks: [{ axes, ...(wanted.block.where ? { where: wanted.block.where } : {}) }] };
}

/** So long, or until the page is seen again. @param {number} ms */
const rest = (ms) => new Promise((go_on) => {
  const end = () => {
    clearTimeout(timer);
    document.removeEventListener("visibilitychange", end);
    go_on(undefined);
  };
  const timer = setTimeout(end, ms);
  document.addEventListener("visibilitychange", end);
});

/** Whether somebody asked for a study that went, as nobody had looked at it for a while. @param {any} error */
const has_gone = (error) => error.status === 404;

/**
 * Keeps a study alive while the page is seen; one that went meanwhile is begun anew.
 * @param {number} id @param {() => Promise<number>} begin @param {AbortSignal} signal @returns {Promise<number>} its number, which then is another one
 */
async function asked_for(id, begin, signal) {
  if (document.hidden) return id;
  try {
    await json(`/api/studies/${id}`, signal);
  } catch (error) {
    if (!signal.aborted && has_gone(error)) return begin();  // a server that does not answer is asked again
  }
  return id;
}

/** @param {number} id @param {() => Promise<number>} begin @param {AbortSignal} signal @returns {AsyncGenerator<number>} other numbers that the study has */
async function* still_here(id, begin, signal) {
  for (;;) {
    await rest(kStillHere_ms);
    if (signal.aborted) return;
    const other = await asked_for(id, begin, signal);
    if (other !== id) yield id = other;
  }
}

/** How much of a picture is solved, of 1. @param {import("./picture.js").Picture} picture */
const share_of = ({ head, values }) => 1 - head.missing / Math.max(values.length - head.left_out, 1);

/**
 * Pictures as they become better; what was given last is kept alive until `signal`.
 * @param {Wanted} wanted @param {number} first_side the coarsest that is shown @param {AbortSignal} signal @param {(key: string) => string} unit_of
 * @param {(side: number, share: number) => void} coming is told how much is solved of one that is finer than what was given
 * @returns {AsyncGenerator<{id: number, side: number, is_whole: boolean, picture: import("./picture.js").Picture, block: any}>}
 */
export async function* finer(wanted, first_side, signal, unit_of, coming) {
  const [x, y] = Object.keys(wanted.ranges);
  /** @type {any} */
  let given = null;
  let asked_at = 0;
  for (const side of kSides.filter((one) => one >= first_side)) {
    if (signal.aborted) return;
    const recipe = recipe_of(wanted, side);
    const begin = async () => (await change("/api/look", { recipe })).id;
    let id = await begin();
    const begun_at = performance.now();
    for (let is_whole = false; !is_whole && !signal.aborted;) {
      try {
        const picture = await slice(id, { z: wanted.z, x, y, nx: side, ny: side, ...(wanted.where ? { where: wanted.where } : {}) }, signal, unit_of);
        is_whole = picture.head.missing === 0;
        const is_slow = performance.now() - begun_at > kMoments_ms;
        // Half of a finer picture is worse than all of the coarser one.
        if (is_whole || (is_slow && side === kSides[0])) {
          given = { begin, told: { id, side, is_whole, picture, block: recipe.blocks[0] } };
          asked_at = performance.now();
          yield given.told;
        } else if (is_slow) {
          coming(side, share_of(picture));
        }
        if (is_whole && side === kSides[kSides.length - 1]) {
          for await (const other of still_here(id, begin, signal)) yield { ...given.told, id: other };
        }
      } catch (error) {
        if (signal.aborted || !has_gone(error)) throw error;
        id = await begin();
      }
      if (given && given.told.side < side && performance.now() - asked_at >= kStillHere_ms) {
        asked_at = performance.now();
        const other = await asked_for(given.told.id, given.begin, signal);
        if (other !== given.told.id) yield given.told = { ...given.told, id: other };
      }
      if (!is_whole) await rest(performance.now() - begun_at < kQuick_ms ? kAskSoon_ms : kAskAgain_ms);
    }
  }
}

/**
 * A study of what lies between, as long as `signal` lasts.
 * @param {Wanted} wanted @param {number} side @param {AbortSignal} signal @param {(id: number) => void} moved it has another number now
 * @returns {Promise<number>} its number
 */
export async function held_open(wanted, side, signal, moved) {
  const recipe = recipe_of(wanted, side);
  const begin = async () => (await change("/api/look", { recipe })).id;
  const id = await begin();
  const watch = async () => {
    for await (const other of still_here(id, begin, signal)) moved(other);
  };
  watch().catch(() => {});  // what is asked for next says why
  return id;
}

/** @param {number} id @param {string} name */
export const keep = (id, name) => change(`/api/look/${id}/keep`, { name });
