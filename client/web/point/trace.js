// @ts-check
// The time histories of a point, column by column.
import { numbers, Silence } from "/server.js";

/** After it was refused for what may change: no worker, too many who wait, no answer. */
const kAskAgain_ms = 3000;

/**
 * @typedef {{from: number, to: number, kind: "stick" | "compression" | "restitution"}} Interval
 * @typedef {object} Fall from release to touch, evenly spaced in time
 * @property {number} rows 0: the worker sends none
 * @property {(name: string) => Float64Array} column
 * @property {(row: number) => Float64Array} nodes
 * @typedef {object} Trace
 * @property {any} head
 * @property {number} rows of the contact
 * @property {(name: string) => Float64Array} column of the contact
 * @property {(row: number) => Float64Array} nodes x and y by turns, the pin first
 * @property {(row: number) => string} state
 * @property {Fall} fall
 * @property {Interval[]} phases
 * @property {Interval[]} sticks
 */

/** Whether the same question may have an answer later. @param {any} error */
const is_for_now = (error) => error instanceof Silence || error.status === 409 || error.status === 503;

/**
 * Waits until a worker has solved it again.
 * @param {number} study @param {number} point @param {AbortSignal} signal @param {(text: string, is_bad: boolean) => void} say
 * @returns {Promise<Trace>}
 */
export async function trace_of(study, point, signal, say) {
  say("Waiting for a worker, or for it to solve this point again.", false);
  for (;;) {
    try {
      return taken_apart(await numbers(`/api/studies/${study}/points/${point}/trace?shape=1&fall=1`, signal));
    } catch (error) {
      if (signal.aborted || !is_for_now(error)) throw error;
      say(`No time histories yet: ${/** @type {Error} */ (error).message.replace(/\.$/, "")}. They are asked for again.`, true);
    }
    await new Promise((go_on) => setTimeout(go_on, kAskAgain_ms));
    signal.throwIfAborted();
  }
}

/** @param {{head: any, bytes: ArrayBuffer, begin: number}} answer @returns {Trace} */
function taken_apart({ head, bytes, begin }) {
  const { row_numbers } = head;
  const before = head.fall_rows ?? 0;
  const rows = head.rows - before;
  const all = new Float64Array(bytes, begin, head.rows * row_numbers);
  const states = new Uint8Array(bytes, begin + 8 * head.rows * row_numbers + before, rows);
  /** @type {Map<string, number>} */
  const first = new Map();
  let at = 0;
  for (const column of head.columns) {
    first.set(column.name, at);
    at += column.numbers;
  }
  const part = (/** @type {number} */ from, /** @type {number} */ length) => (/** @type {string} */ name) => {
    const place = first.get(name);
    if (place === undefined) throw new Error(`the trace has no ${name}`);
    return Float64Array.from({ length }, (_, row) => all[(from + row) * row_numbers + place]);
  };
  const column = part(before, rows);
  const t = column("t_s");
  /** Spans of rows that have one sign. @param {(code: number) => string} kind_of @returns {Interval[]} */
  const spans = (kind_of) => {
    const found = /** @type {Interval[]} */ ([]);
    for (let row = 0; row + 1 < rows; ++row) {
      const kind = /** @type {any} */ (kind_of(states[row]));
      const last = found.at(-1);
      if (last && last.kind === kind && last.to === t[row]) last.to = t[row + 1];
      else if (kind) found.push({ from: t[row], to: t[row + 1], kind });
    }
    return found;
  };
  const nodes_at = first.get("node{}x_m node{}y_m") ?? 0;
  const nodes = (/** @type {number} */ row) => all.subarray(row * row_numbers + nodes_at, row * row_numbers + nodes_at + 2 * head.nodes);
  return { head, rows, column, nodes: (row) => nodes(before + row), fall: { rows: before, column: part(0, before), nodes },
    state: (row) => head.states[states[row]],
    // The codes' bits: 1 is restitution, 2 is slip.
    phases: spans((code) => (code & 1 ? "restitution" : "compression")),
    sticks: spans((code) => (code & 2 ? "" : "stick")) };
}

/** The row whose time is the last at or before `t`. @param {Float64Array} times @param {number} t */
export function row_at(times, t) {
  let low = 0;
  let high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}
