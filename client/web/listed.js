// @ts-check
// Studies and workers as the server lists them, a page at a time.
import { json } from "/server.js";

const kAtOnce = 200;
const kMostAtOnce = 1000;

/** All that a list has. @param {"studies" | "workers"} what @returns {Promise<any[]>} */
export async function all_of(what) {
  const all = [];
  for (let after = 0; ;) {
    const page = await json(`/api/${what}?limit=${kMostAtOnce}&after=${after}`);
    all.push(...page[what]);
    if (page.next_after === 0) return all;
    after = page.next_after;
  }
}

/** The first so many studies. @param {number} wanted @returns {Promise<{found: Map<number, any>, next_after: number}>} next_after 0: these are all */
async function first_studies(wanted) {
  const found = new Map();
  let next_after = 0;
  do {
    const page = await json(`/api/studies?limit=${Math.min(wanted - found.size, kMostAtOnce)}&after=${next_after}`);
    for (const study of page.studies) found.set(study.id, study);
    next_after = page.next_after;
  } while (next_after !== 0 && found.size < wanted);
  return { found, next_after };
}

/** Studies: as many as somebody wants to see, and those that events tell of. One reading ends before the next begins, so that no older answer replaces a newer one. */
export class StudyList {
  /** @param {() => void} changed @param {(error: any) => void} failed it did not come */
  constructor(changed, failed) {
    this.changed = changed;
    this.failed = failed;
    /** @type {Map<number, any>} */
    this.known = new Map();
    /** Those of the last event. @type {any[]} */
    this.told = [];
    this.was_read = false;
    this.has_more = false;
    this.wanted = kAtOnce;
    this.is_reading = false;
    this.wants_another = false;
  }

  /** @param {any[]} studies of an event */
  take(studies) {
    this.told = studies;
    for (const study of studies) this.known.set(study.id, study);
  }

  more() {
    this.wanted += kAtOnce;
    return this.read();
  }

  /** Reads again, as far as was read before. */
  async read() {
    this.wants_another = true;
    if (this.is_reading) return;
    this.is_reading = true;
    try {
      while (this.wants_another) {
        this.wants_another = false;
        await this.#read_once();
        this.changed();
      }
    } catch (error) {
      this.failed(error);
    }
    this.is_reading = false;
  }

  async #read_once() {
    const { found, next_after } = await first_studies(this.wanted);
    // What an event told of stays when it has ended, though it lies beyond.
    const beyond = next_after === 0 ? [] : [...this.known.keys()].filter((id) => id > next_after);
    if (beyond.length > 0) {
      const page = await json(`/api/studies?limit=${kMostAtOnce}&after=${Math.min(...beyond) - 1}`);
      for (const study of page.studies) if (this.known.has(study.id)) found.set(study.id, study);
    }
    this.was_read = true;
    this.has_more = next_after !== 0;
    this.known = found;
    this.take(this.told);
  }
}
