// @ts-check
// What is solved between the points of a study, as an address says it: so it is found again, or solved anew.
import { Refusal } from "/server.js";
import { own_axes, ranges_of } from "../axes.js";
import { slice } from "./picture.js";

/**
 * What an address asks for: the values at which other axes are held are the server's own.
 * @param {any} study @param {URLSearchParams} fields @param {AbortSignal} signal
 * @returns {Promise<import("./look.js").Wanted>}
 */
export async function wanted_of(study, fields, signal) {
  const is = (/** @type {string} */ name) => fields.get(name) ?? "";
  const ranges = ranges_of(is("between"));
  const block = study.blocks[Number(is("block"))];
  if (!ranges || !block) throw new Refusal(400, "that address does not say what lies between which values");
  const [x, y] = Object.keys(ranges);
  const keys = own_axes(block).map((axis) => axis.key);
  const at = is("at").split(",").filter((one) => keys.includes(one.split("@")[0]) && !ranges[one.split("@")[0]]).join(",");
  const z = is("z") || "fn_peak_N";
  const one = await slice(study.id, { z, x, y, block: is("block"), nx: 1, ny: 1, ...(at ? { at } : {}) }, signal, () => "");
  const held = Object.fromEntries(one.head.at.map((/** @type {any} */ axis) => [axis.key, axis.value]));
  return { study: study.id, block, z, ranges, held, where: is("where") };
}
