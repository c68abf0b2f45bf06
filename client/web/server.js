// @ts-check
// All that the page asks of its server; server/web/page/README.md has every path and field.

/** An answer that is an error, with the server's sentence. */
class Refusal extends Error {
  /** @param {number} status @param {string} sentence */
  constructor(status, sentence) {
    super(sentence);
    this.status = status;
  }
}

/** No answer: nobody listens, or no longer. */
export class Silence extends Error {
  constructor() {
    super("The server does not answer.");
  }
}

/** What people are told of an error. @param {any} error */
export const in_words = (error) => (/dynamically imported module|importing a module script/i.test(error?.message) ? new Silence() : error);

/** @param {string} path @param {RequestInit} how */
async function asked(path, how) {
  try {
    return await fetch(path, how);
  } catch (error) {
    if (how.signal?.aborted) throw error;
    throw new Silence();
  }
}

/** @param {Response} answer */
async function refusal(answer) {
  let sentence = `${answer.status} ${answer.statusText}`;
  try {
    sentence = (await answer.json()).error ?? sentence;
  } catch { /* an answer without JSON */ }
  return new Refusal(answer.status, sentence);
}

/** @param {string} path @param {AbortSignal} [signal] @returns {Promise<any>} */
export async function json(path, signal) {
  const answer = await asked(path, { signal });
  if (!answer.ok) throw await refusal(answer);
  return answer.json();
}

/** Rows of a study. @param {number} study @param {Record<string, string | number>} asked @param {AbortSignal} [signal] */
export const rows = (study, asked, signal) => json(rows_path(study, asked), signal);

/** @param {number} study @param {Record<string, string | number>} asked */
export const rows_path = (study, asked) => `/api/studies/${study}/rows?${new URLSearchParams(/** @type {any} */ (asked))}`;

/** Asks for a change. @param {string} path @param {object} [body] @param {AbortSignal} [signal] @returns {Promise<any>} */
export async function change(path, body, signal) {
  const answer = await asked(path, {
    method: "POST", signal, body: JSON.stringify(body ?? {}), headers: { "Content-Type": "application/json" } });
  if (!answer.ok) throw await refusal(answer);
  return answer.json();
}

/**
 * Numbers behind a head: the head, the bytes, and where the numbers begin in them.
 * @param {string} path @param {AbortSignal} [signal]
 * @returns {Promise<{head: any, bytes: ArrayBuffer, begin: number}>}
 */
export async function numbers(path, signal) {
  const answer = await asked(path, { signal });
  if (!answer.ok) throw await refusal(answer);
  const bytes = await answer.arrayBuffer();
  const length = new DataView(bytes).getUint32(0, true);
  return { head: JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length))), bytes, begin: 4 + length };
}

/** @returns {Promise<{version: string, may_look: boolean, may_change: boolean, file: string, how_to_enter: string}>} */
export const session = () => json("/api/session");

const kTryAgain_ms = 3000;

/**
 * Follows the overview while the page is seen.
 * @param {(now: any) => void} take @param {(text: string) => void} say @param {() => void} back it answers again
 */
export function follow(take, say, back) {
  /** @type {EventSource | null} */
  let source = null;
  let later = 0;
  let is_silent = false;
  const end = () => {
    clearTimeout(later);
    source?.close();
    source = null;
  };
  const look = () => {
    if (document.hidden) {  // nobody looks
      end();
    } else if (!source) {
      source = new EventSource("/api/events");
      source.addEventListener("overview", (event) => take(JSON.parse(event.data)));
      source.addEventListener("open", () => {
        if (is_silent) back();
        is_silent = false;
      });
      source.addEventListener("error", () => {
        is_silent = true;
        say("The server does not answer; trying again.");
        if (source?.readyState !== EventSource.CLOSED) return;
        end();  // it was refused, and browsers do not ask again then
        session().then((told) => { if (!told.may_look) say(`The server was started anew: ${told.how_to_enter}.`); }, () => {});
        later = setTimeout(look, kTryAgain_ms);
      });
    }
  };
  document.addEventListener("visibilitychange", look);
  addEventListener("pagehide", end);
  addEventListener("pageshow", look);
  look();
}
