/**
 * The situation of a robot as this page may say it now: pure functions.
 *
 * The server finds it (`iveg/domain/situation.py`); here it only grows old.  A robot that
 * this page has not heard of lately is never told as clear, whatever was true before.
 *
 * @typedef {import("../types.js").Situation} Situation
 * @typedef {Situation["level"]} Level
 * @typedef {Situation["kind"]} Kind
 * @typedef {import("./protocol.js").Robot} Robot
 * @typedef {import("./i18n.js").I18n} I18n
 * @typedef {{said: string, why: string, todo: string}} Said
 */

import { ageOf, isSilent, linkOfRobot } from "./clock.js";
import { LIMITS } from "./limits.js";
import { ORDER } from "./order.js";

/** Colours and shapes, worst first. */
export const LEVELS = /** @type {const} */ ([
  "danger",
  "caution",
  "doubt",
  "locked",
  "working",
  "away",
]);

/** States with rules of the server for silence: they name it, or follow an order. */
const OF_SILENCE = new Set(["late", "lost", "lost_moving", "age_unknown", "no_data"]);
const OF_ORDERS = new Set([
  "stopping",
  "braking",
  "standing",
  "stood",
  "ready",
  "releasing",
  "resuming",
]);

/** Of a robot of which nothing is known. @type {Situation} */
export const UNHEARD = {
  level: "away",
  kind: "away",
  state: "no_data",
  cause: "link",
  why: null,
  about: null,
  action: "none",
  factor: null,
  slots: {},
};

/**
 * @param {Robot | undefined} robot
 * @param {number} [nowMs] `performance.now()` (ms)
 * @param {import("./store.js").ConnectionState} [connection] to the server
 * @returns {Situation}
 */
export function situationOf(robot, nowMs = performance.now(), connection = "open") {
  const found = grownOld(robot, nowMs);
  // The server's advice is of before it went.
  return connection === "lost" ? { ...found, action: "red_button" } : found;
}

/** @param {Robot | undefined} robot @param {number} nowMs @returns {Situation} */
function grownOld(robot, nowMs) {
  if (!robot) return UNHEARD;
  const { situation } = robot;
  const link = linkOfRobot(robot, nowMs);
  const age = ageOf(robot, nowMs);
  const slots = Number.isFinite(age) ? { ...situation.slots, age } : situation.slots;
  if (OF_SILENCE.has(situation.state) && link !== "LIVE") {
    const isLostNow = situation.state === "late" && isSilent(link);
    const kind = worse(LOST.kind, situation.kind);
    return { ...situation, ...(isLostNow ? { ...LOST, kind } : null), slots };
  }
  if (link === "LIVE" || situation.level === "danger") return situation;
  if (link === "UNKNOWN") return { ...UNHEARD, factor: situation.factor };
  if (link === "LATE" && OF_ORDERS.has(situation.state))
    return isOldStandstill(situation, age) ? stood(situation) : situation;
  const isLate = link === "LATE";
  return {
    ...UNHEARD,
    ...(isLate ? LATE : LOST),
    // Silence makes nothing better.
    kind: worse(isLate ? LATE.kind : LOST.kind, situation.kind),
    level: situation.level === "caution" ? "caution" : "doubt",
    factor: situation.factor,
    slots: { age },
  };
}

/** @type {Pick<Situation, "kind" | "state" | "action">} */
const LATE = { kind: "unsure", state: "late", action: "as_moving" };
/** @type {Pick<Situation, "kind" | "state" | "action">} */
const LOST = { kind: "lost", state: "lost", action: "red_button" };

const KINDS = /** @type {Kind[]} */ (Object.keys(ORDER));

/** The one that is told first. @param {Kind} a @param {Kind} b */
const worse = (a, b) => (KINDS.indexOf(a) < KINDS.indexOf(b) ? a : b);

/** Whether its STOP says already that nobody knows whether it stands.
 * @param {Situation} situation @param {number} ageS */
const isOldStandstill = ({ state }, ageS) =>
  state === "standing" && ageS > LIMITS.report_stale_s;

/** @param {Situation} situation @returns {Situation} as the server would say it */
const stood = (situation) => ({
  ...situation,
  level: "doubt",
  kind: "stop_unknown",
  state: "stood",
  action: "as_moving",
});

/**
 * What it does, why, and what to do, each a phrase of its own; empty where there is none.
 *
 * @param {Situation} situation
 * @param {I18n} i18n
 * @returns {Said}
 */
export function phrasesOf({ state, why, action, slots }, i18n) {
  return {
    said: i18n.t(`situation.is.${state}`, slots),
    why: why ? i18n.t(`situation.why.${why}`, slots) : "",
    todo: action === "none" ? "" : i18n.t(`situation.do.${action}`, slots),
  };
}

/**
 * The sentence about one robot, without its name.
 *
 * @param {Situation} situation
 * @param {I18n} i18n
 */
export function sentenceOf(situation, i18n) {
  const { said, why, todo } = phrasesOf(situation, i18n);
  const fact = why ? `${said}: ${why}` : said;
  return todo ? `${fact} — ${todo}` : fact;
}

/** Whether nobody reads its camera. @param {Robot | undefined} robot */
export const isBlind = (robot) =>
  Boolean(robot?.detector?.out_by) ||
  Boolean(robot?.detector?.required && robot.detector.missing);

/** The drawings of causes, and the names that each is of. @type {[string, RegExp][]} */
const MARKS = [
  ["person", /^person/],
  ["robot", /^robot/],
  ["obstacle", /^obstacle/],
  ["lock", /^hold$|^held_/],
  ["camera", /^(no_detector|camera)/],
  ["link", /^(link|watchdog|stale|no_pose)/],
];

/** The drawing of what a situation is because of. @param {Situation} situation */
export const markOf = ({ why, cause }) =>
  MARKS.find(([, names]) => names.test(why ?? cause))?.[0] ?? null;

/** A phrase that begins a line. @param {string} said */
export const capitalised = (said) => said.slice(0, 1).toUpperCase() + said.slice(1);

/** Its place in the order, the worst first. @param {Pick<Situation, "kind">} situation */
export const rankOf = ({ kind }) => KINDS.indexOf(kind);
