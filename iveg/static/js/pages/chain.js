/**
 * Where the chain from robot to screen is broken, in one sentence: pure judgement.
 *
 * What lies behind a broken hop is silent because of it, so of several that are equally
 * bad the one nearest to the robots is named.
 *
 * @typedef {"ok" | "late" | "down" | "unknown"} State
 * @typedef {{hop: string, state: State}} Hop
 * @typedef {{key: string, slots: Record<string, string>, state: State, hop: string | null}
 * } Verdict
 */

/** In the order in which a datum travels; then what stands beside. */
export const ORDER = [
  "mqtt",
  "iot_agent",
  "orion",
  "notifications",
  "database",
  "emulator",
];
/** @type {State[]} */
const WORST_FIRST = ["down", "late", "unknown"];

/**
 * @param {readonly Hop[]} hops as the server tells them
 * @param {readonly string[]} lost ids of robots that are silent
 * @param {boolean} isOpen whether this screen hears the server
 * @returns {Verdict}
 */
export function judgeChain(hops, lost, isOpen) {
  if (!isOpen) return verdict("fleet.silent_server", "down", "server");
  for (const state of WORST_FIRST) {
    const broken = ORDER.find((name) =>
      hops.some((hop) => hop.hop === name && hop.state === state),
    );
    // Robots that are silent while the chain is only late are the worse news.
    if (state === "late" && lost.length) break;
    if (broken) return verdict(`health.hop.${broken}.${state}`, state, broken);
  }
  if (!lost.length) return verdict("fleet.whole", "ok", null);
  const robots = lost.join(", ");
  return { ...verdict("fleet.silent_robots", "down", "robots"), slots: { robots } };
}

/**
 * @param {string} key
 * @param {State} state
 * @param {string | null} hop
 * @returns {Verdict}
 */
function verdict(key, state, hop) {
  return { key, slots: {}, state, hop };
}
