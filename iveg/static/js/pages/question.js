/**
 * A question about another rule, as both pages ask it that show an answer.
 *
 * @typedef {import("../types.js").WhatIf} WhatIf
 */

import { readApi, sendApi } from "../core/api.js";

const LOOK_MS = 500;

/** Whether its answer is still to come, or to grow. @param {WhatIf | null} asked */
export function isGoing(asked) {
  return asked !== null && ["waiting", "running"].includes(asked.state);
}

/**
 * What has become of a question, a moment later.
 *
 * @param {WhatIf} asked
 * @param {AbortSignal} [signal] ends the wait early
 */
export async function lookAgain({ id }, signal) {
  await new Promise((resolve) => {
    setTimeout(resolve, LOOK_MS);
    signal?.addEventListener("abort", resolve, { once: true });
  });
  return readApi(`what-if/${id}`);
}

/** @param {WhatIf} asked */
export function endQuestion({ id }) {
  return sendApi("DELETE", `what-if/${id}`, {});
}

/** What a failed question says of whom. @type {Record<string, string>} */
const FAILURES = {
  no_data: "whatif.no_data",
  truth: "whatif.truth_unreadable",
  database: "whatif.no_history",
};

/** The text of a failure. @param {string | null} why */
export const failureKey = (why) => FAILURES[why ?? ""] ?? "whatif.failed";

/**
 * Why a question was not taken, as a key of the texts; null: for what it says.
 *
 * @param {number} status @param {any} body
 */
export function refusalKey(status, body) {
  if (status === 0) return "rows.offline";
  return status === 409 ? `whatif.refused.${body?.why}` : null;
}
