// Sends requests to the server. server/web/page/README.md describes paths and fields.

export const retryMs = 3000;

/**
 * Creates an error. `status` is the HTTP status; `isSilence` means that the server did not answer.
 */
const failure = (text, fields) => Object.assign(new Error(text), fields);

async function request(path, options) {
  let answer;
  try {
    answer = await fetch(path, options);
  } catch (error) {
    if (options.signal?.aborted) throw error;
    throw failure("The server does not answer.", { isSilence: true });
  }
  if (answer.ok) return answer;
  const { error } = await answer.json().catch(() => ({}));
  throw failure(error ?? `${answer.status} ${answer.statusText}`, { status: answer.status });
}

export const json = async (path, signal) => (await request(path, { signal })).json();

export const rowsPath = (study, query) => `api/studies/${study}/rows?${new URLSearchParams(query)}`;

export const rows = (study, query, signal) => json(rowsPath(study, query), signal);

export async function post(path, body = {}, signal = undefined) {
  const headers = { "Content-Type": "application/json" };
  return (
    await request(path, { method: "POST", signal, body: JSON.stringify(body), headers })
  ).json();
}

/**
 * Reads an answer of binary numbers that follow a JSON head. Returns the head, all bytes, and the
 * offset of the numbers.
 */
export async function numbers(path, signal) {
  const bytes = await (await request(path, { signal })).arrayBuffer();
  const length = new DataView(bytes).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  return { head, bytes, begin: 4 + length };
}

export const session = () => json("api/session");

/**
 * Receives the server's overview (studies and workers) again and again while the page is visible.
 */
export function follow({ take, say, reconnected }) {
  let source = null;
  let timer = 0;
  let isSilent = false;
  const close = () => {
    clearTimeout(timer);
    source?.close();
    source = null;
  };
  const open = () => {
    if (document.hidden) close();
    if (document.hidden || source) return;
    source = new EventSource("api/events");
    source.addEventListener("overview", (event) => take(JSON.parse(event.data)));
    source.addEventListener("open", () => {
      if (isSilent) reconnected();
      isSilent = false;
    });
    source.addEventListener("error", () => {
      isSilent = true;
      say("The server does not answer. Trying again …");
      if (source?.readyState !== EventSource.CLOSED) return;
      close(); // browsers do not reconnect after a refusal
      session().then(
        (update) => update.may_look || say(`The server was restarted: ${update.how_to_enter}.`),
        () => {},
      );
      timer = setTimeout(open, retryMs);
    });
  };
  document.addEventListener("visibilitychange", open);
  addEventListener("pagehide", close);
  addEventListener("pageshow", open);
  open();
}
