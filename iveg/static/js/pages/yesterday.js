/**
 * What a change of the rule would have cost yesterday, before it is made.
 *
 * @typedef {import("../core/protocol.js").Rule} Rule
 * @typedef {import("./lowering.js").Change} Change
 * @typedef {import("../types.js").WhatIf} WhatIf
 * @typedef {{key: string, slots: Record<string, string | number>}} Said
 */

import { sendApi } from "../core/api.js";
import { momentOf, wallText } from "./history/local_time.js";
import { personShare } from "./lowering.js";
import { endQuestion, failureKey, isGoing, lookAgain, refusalKey } from "./question.js";

const DAY_MS = 86_400_000;

/**
 * Asks, and tells how far the answer is.
 *
 * @param {Rule} before in force
 * @param {Change} change
 * @param {(said: Said) => void} tell called anew whenever there is more to say
 * @param {AbortSignal} [signal] nobody wants to know any more
 */
export async function askYesterday(before, change, tell, signal) {
  const wanted = questionOf(before, change, Date.now());
  let { status, body } = await sendApi("POST", "what-if", wanted);
  while (body?.id && isGoing(body)) {
    // A person has one question at a time.
    if (signal?.aborted) return void endQuestion(body);
    tell({ key: "preview.going", slots: { percent: Math.round(body.progress * 100) } });
    ({ status, body } = await lookAgain(body, signal));
  }
  const said = status < 300 && body?.id ? answerSaid(body) : null;
  tell(said ?? { key: refusalKey(status, body) ?? "preview.failed", slots: {} });
}

/**
 * @param {Rule} before
 * @param {Change} change
 * @param {number} now Unix milliseconds
 */
export function questionOf(before, change, now) {
  const after = { ...before, ...change };
  const today = momentOf(`${wallText(now).slice(0, 10)} 00:00`);
  // Twelve hours before midnight is yesterday, however long that day was.
  const since = momentOf(`${wallText(today - DAY_MS / 2).slice(0, 10)} 00:00`);
  return {
    since: new Date(since).toISOString(),
    until: new Date(today).toISOString(),
    confidence_threshold: personShare(after),
    radius_m: after.radius_m,
    foresight_s: after.foresight ? after.foresight_s : 0,
    vary: "foresight_s",
  };
}

/** @param {WhatIf} found @returns {Said | null} */
function answerSaid({ state, why, answer }) {
  if (state === "failed" && why === "no_data")
    return { key: "preview.no_data", slots: {} };
  if (state === "failed" && why === "truth") return { key: failureKey(why), slots: {} };
  if (state !== "done" || !answer) return null;
  const minutes = (/** @type {Record<string, number>} */ of) =>
    Object.values(of).reduce((sum, s) => sum + s, 0) / 60;
  const { in_force, candidate } = answer;
  return {
    key: "preview.said",
    slots: {
      in_force: minutes(in_force.slowed_s),
      candidate: minutes(candidate.slowed_s),
      met: in_force.encounters.person ?? 0,
      would_meet: candidate.encounters.person ?? 0,
    },
  };
}
