// @ts-check
// What is solved between the points of a study, or beside them, as an address says it: so it is found again, or solved anew.
import { Refusal } from "/server.js";
import { own_axes, ranges_of, unvaried } from "../axes.js";
import { slice } from "./picture.js";

/**
 * At which values a block holds its axes: those are the server's own, so that points which are solved there are the same.
 * @param {any} study @param {URLSearchParams} fields @param {string} z @param {string[]} varied keys that are not held @param {AbortSignal} signal
 * @returns {Promise<Record<string, number>>}
 */
async function held_values(study, fields, z, varied, signal) {
  const block = study.blocks[Number(fields.get("block"))];
  const places = new Map((fields.get("at") ?? "").split(",").map((one) => /** @type {[string, string]} */ (one.split("@"))));
  const keys = own_axes(block).map((axis) => axis.key);
  if (keys.length === 0) throw new Refusal(400, "that block has no axes between which points could be solved");
  // One cell tells all: that of the first axis it has along x, those of the others at which it is.
  const [x, ...others] = keys;
  const at = others.filter((key) => places.get(key)).map((key) => `${key}@${places.get(key)}`).join(",");
  const number = places.get(x) ?? "0";
  const one = await slice(study.id, { z, x, x0: number, x1: number, block: fields.get("block") ?? "", nx: 1, ...(at ? { at } : {}) }, signal, () => "");
  const held = { [x]: one.x.values[0], ...Object.fromEntries(one.head.at.map((/** @type {any} */ axis) => [axis.key, axis.value])) };
  for (const key of varied) delete held[key];
  return held;
}

/**
 * What an address asks for.
 * @param {any} study @param {URLSearchParams} fields @param {AbortSignal} signal
 * @returns {Promise<import("./look.js").Wanted>}
 */
export async function wanted_of(study, fields, signal) {
  const ranges = ranges_of(fields.get("between") ?? "");
  const block = study.blocks[Number(fields.get("block"))];
  if (!ranges || !block) throw new Refusal(400, "that address does not say what lies between which values");
  const z = fields.get("z") || "fn_peak_N";
  const held = await held_values(study, fields, z, Object.keys(ranges), signal);
  // Keys of the model come first.
  const added = unvaried(study, block).filter(({ key }) => ranges[key] && !block.axes.some((/** @type {any} */ axis) => axis.key === key));
  return { model: study.model, block: { ...block, axes: [...added, ...block.axes] }, z, ranges, held, where: fields.get("where") ?? "" };
}
