/**
 * The broken hop of the data path, in one sentence: pure functions.
 *
 * The hops behind a broken hop are silent because of it, so of several equally bad hops
 * the one nearest to the robots is named.
 *
 * @typedef {"ok" | "late" | "down" | "unknown"} State
 * @typedef {{hop: string, state: State, lag_s?: number | null}} Hop
 * @typedef {{key: string, slots: Record<string, string | number>}} Sentence
 * @typedef {Sentence & {state: State, hop: string | null}} Verdict
 * @typedef {{id: string, link: import("../core/clock.js").Link}} Heard
 * @typedef {import("../core/protocol.js").Robot} Robot
 */

import { isSilent, linkOfRobot } from "../core/clock.js";

/** In the order of the data path; then the hops beside it. */
export const ORDER = ["mqtt", "iot_agent", "orion", "notifications", "database"];
/** From this lag on (s), the lag itself is the fault. */
const LATE_S = 1;
/** @type {State[]} */
const WORST_FIRST = ["down", "late", "unknown"];

/**
 * The chain from the robots to this screen: whole only while every robot is live.
 *
 * @param {readonly Hop[]} hops as the server tells them
 * @param {readonly Heard[]} robots the fleet, as this screen hears it
 * @param {boolean} isOpen whether this screen hears the server
 * @returns {Verdict}
 */
export function judgeDataPath(hops, robots, isOpen) {
  if (!isOpen) return verdict("fleet.silent_server", "down", "server");
  if (!hops.length) return verdict("fleet.unknown", "unknown", null);
  const lost = robots.filter(({ link }) => isSilent(link));
  for (const state of WORST_FIRST) {
    const broken = hops
      .filter((hop) => hop.state === state)
      .sort((a, b) => ORDER.indexOf(a.hop) - ORDER.indexOf(b.hop))[0];
    // Silent robots are worse than a data path that is only late.
    if (state === "late" && lost.length) break;
    if (broken) return { ...sentenceOf(broken), state, hop: broken.hop };
  }
  if (!robots.length) return verdict("fleet.no_robots", "unknown", "robots");
  if (lost.length) return ofRobots("fleet.silent_robots", "down", lost);
  const late = robots.filter(({ link }) => link !== "LIVE");
  if (late.length) return ofRobots("fleet.late_robots", "late", late);
  return verdict("fleet.whole", "ok", null);
}

/** The fleet with the link of each robot now. @param {Iterable<Robot>} robots */
export const heardOf = (robots) =>
  [...robots].map((robot) => ({ id: robot.robot_id, link: linkOfRobot(robot) }));

/**
 * @param {string} key
 * @param {State} state
 * @param {readonly Heard[]} robots
 * @returns {Verdict}
 */
function ofRobots(key, state, robots) {
  const named = robots.map(({ id }) => id).join(", ");
  return { ...verdict(key, state, "robots"), slots: { robots: named } };
}

/**
 * The sentence about one hop: its lag where that is known, else its state.
 *
 * @param {Hop} hop
 * @returns {Sentence}
 */
export function sentenceOf(hop) {
  const lag = hop.lag_s ?? null;
  if (hop.state !== "late" || lag === null || lag <= LATE_S)
    return { key: `health.hop.${hop.hop}.${hop.state}`, slots: {} };
  return { key: "health.lag", slots: { lag } };
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
