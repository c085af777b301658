/**
 * Questions about the past: one at a time, then the moment that is wanted by then.
 *
 * @typedef {import("./api.js").Answer} Answer
 * @typedef {(atS: number, signal: AbortSignal) => Promise<Answer>} Ask
 */

import { readApi } from "./api.js";

/** Longer than this an answer is slow. */
export const SLOW_MS = 5000;
/** While one moment is shown, the next may take so long before anything is said. */
const SOON_MS = 1000;

export class PastLine {
  #ask;
  #answered;
  #now;
  #wantedS = Number.NaN;
  #askedS = Number.NaN;
  #askedAtMs = 0;
  /** @type {AbortController | null} */
  #question = null;

  /**
   * @param {(answer: Answer) => void} answered
   * @param {Ask} ask
   * @param {() => number} now ms
   */
  constructor(answered, ask = askWorld, now = () => performance.now()) {
    this.#answered = answered;
    this.#ask = ask;
    this.#now = now;
  }

  /** Since the question that is out was asked (ms); null: none is. */
  get waitedMs() {
    return this.#question && this.#now() - this.#askedAtMs;
  }

  /** @param {number} atS Unix time of the moment that is wanted from now on */
  want(atS) {
    this.#wantedS = atS;
    if (this.#question === null && atS !== this.#askedS) void this.#bring();
  }

  /** Ask anew, and wait no longer for what is out. */
  again() {
    this.#question?.abort();
    void this.#bring();
  }

  async #bring() {
    const question = new AbortController();
    this.#question = question;
    this.#askedS = this.#wantedS;
    this.#askedAtMs = this.#now();
    const answer = await this.#ask(this.#askedS, question.signal);
    if (this.#question !== question) return;
    this.#question = null;
    this.#answered(answer);
    this.want(this.#wantedS);
  }
}

/**
 * What is said while an answer is awaited.
 *
 * @param {number | null} waitedMs @param {boolean} isShown whether any moment is
 * @returns {"" | "opening" | "slow"}
 */
export function waitSaid(waitedMs, isShown) {
  if (waitedMs === null) return "";
  if (waitedMs >= SLOW_MS) return "slow";
  return isShown && waitedMs < SOON_MS ? "" : "opening";
}

/**
 * Why there is no picture, as the last part of the key of its text.
 *
 * @param {number} status @param {any} body
 */
export function problemOf(status, body) {
  if (status === 422) return "never";
  if (status === 404 && body?.before && body.after) return "gap_both";
  if (status === 404) return body?.before || body?.after ? "gap_one" : "never";
  return "failed";
}

/** @param {number} atS @param {AbortSignal} signal */
function askWorld(atS, signal) {
  const at = new Date(1000 * atS).toISOString();
  return readApi(`world?${new URLSearchParams({ at })}`, signal);
}
