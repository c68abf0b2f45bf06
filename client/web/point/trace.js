// Loads the time histories of a point's contact as columns.
import { numbers, retryMs } from "../api.js";

/**
 * Whether a failed request may succeed later: there was no worker, no answer, or too many requests.
 */
const isTemporary = (error) => error.isSilence || [409, 503].includes(error.status);

/** Waits until a worker has solved the point again; `say` shows the reason for waiting. */
export async function loadTrace(study, point, signal, say) {
  say("Waiting for a worker to solve the point again.");
  for (;;) {
    try {
      return parse(await numbers(`api/studies/${study}/points/${point}/trace?shape=1`, signal));
    } catch (error) {
      if (signal.aborted || !isTemporary(error)) throw error;
      say(`No time histories yet: ${error.message.replace(/\.$/, "")}. Trying again.`, true);
    }
    await new Promise((resolve) => setTimeout(resolve, retryMs));
    signal.throwIfAborted();
  }
}

/**
 * Splits a trace into columns in SI units. Also returns the nodes (alternating x and y, from the
 * pin) and the state of each row, and the time spans [s] of phases and stick.
 */
function parse({ head, bytes, begin }) {
  const { rows, row_numbers: width } = head;
  const all = new Float64Array(bytes, begin, rows * width);
  const states = new Uint8Array(bytes, begin + 8 * rows * width, rows);
  const places = new Map();
  let place = 0;
  for (const { name, numbers: size } of head.columns) {
    places.set(name, place);
    place += size;
  }
  const column = (name) => {
    if (!places.has(name)) throw new Error(`the trace has no ${name}`);
    return Float64Array.from({ length: rows }, (_, row) => all[row * width + places.get(name)]);
  };
  const t = column("t_s");
  const spansOf = (kindOf) => {
    const found = [];
    for (let row = 0; row + 1 < rows; ++row) {
      const kind = kindOf(states[row]);
      const last = found.at(-1);
      if (last?.kind === kind && last.to === t[row]) last.to = t[row + 1];
      else if (kind) found.push({ from: t[row], to: t[row + 1], kind });
    }
    return found;
  };
  const nodes = places.get("node{}x_m node{}y_m");
  return {
    head,
    rows,
    column,
    nodes: (row) => all.subarray(row * width + nodes, row * width + nodes + 2 * head.nodes),
    state: (row) => head.states[states[row]],
    // In a state code, bit 1 means restitution and bit 2 means slip.
    spans: [
      ...spansOf((code) => (code & 1 ? "restitution" : "compression")),
      ...spansOf((code) => (code & 2 ? "" : "stick")),
    ],
  };
}

/** Returns the last row with a time of at most `t`. */
export function rowAt(times, t) {
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}
