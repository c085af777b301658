/**
 * The situation of a robot, and of the fleet, as this page may say it now: pure functions.
 *
 * The server finds it (`iveg/domain/situation/judge.py`); here it only grows old.  A robot that
 * this page has not heard of lately is never told as clear, whatever was true before.
 *
 * @typedef {import("../types.js").Situation} Situation
 * @typedef {Situation["level"]} Level
 * @typedef {import("./protocol.js").Robot} Robot
 * @typedef {import("./i18n.js").I18n} I18n
 * @typedef {{said: string, why: string, todo: string}} Said
 * @typedef {{level: Level, said: string, robotId: string | null}} FleetSaid
 */

import { ageOf, isSilent, linkOfRobot } from "./clock.js";

/** Worst first, as the server ranks them. */
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
 * @returns {Situation}
 */
export function situationOf(robot, nowMs = performance.now()) {
  if (!robot) return UNHEARD;
  const { situation } = robot;
  const link = linkOfRobot(robot, nowMs);
  const age = ageOf(robot, nowMs);
  const slots = Number.isFinite(age) ? { ...situation.slots, age } : situation.slots;
  if (OF_SILENCE.has(situation.state) && link !== "LIVE") {
    const state =
      situation.state === "late" && isSilent(link) ? "lost" : situation.state;
    return { ...situation, state, slots };
  }
  if (link === "LIVE" || situation.level === "danger") return situation;
  if (link === "UNKNOWN") return { ...UNHEARD, factor: situation.factor };
  if (link === "LATE" && OF_ORDERS.has(situation.state)) return situation;
  return {
    ...UNHEARD,
    // Silence makes nothing better.
    level: situation.level === "caution" ? "caution" : "doubt",
    state: link === "LATE" ? "late" : "lost",
    action: link === "LATE" ? "as_moving" : "check_network",
    factor: situation.factor,
    slots: { age },
  };
}

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

/** The drawings of causes, and the names that each is of. @type {[string, RegExp][]} */
const MARKS = [
  ["person", /^person/],
  ["robot", /^robot/],
  ["obstacle", /^obstacle/],
  ["lock", /^hold$|^held_/],
  ["camera", /^no_detector/],
  ["link", /^(link|watchdog|stale|no_pose)/],
];

/** The drawing of what a situation is because of. @param {Situation} situation */
export const markOf = ({ why, cause }) =>
  MARKS.find(([, names]) => names.test(why ?? cause))?.[0] ?? null;

/** A phrase that begins a line. @param {string} said */
export const capitalised = (said) => said.slice(0, 1).toUpperCase() + said.slice(1);

/** From bad to good, for sorting. @param {Situation} situation */
export const rankOf = ({ level }) => LEVELS.indexOf(level);

/**
 * The worst of the fleet in one sentence; of several as bad, the first of the fleet.
 *
 * @param {Iterable<Robot>} robots
 * @param {I18n} i18n
 * @param {number} [nowMs] `performance.now()` (ms)
 * @returns {FleetSaid}
 */
export function fleetSaid(robots, i18n, nowMs = performance.now()) {
  const fleet = [...robots].map((robot) => ({
    robot: robot.robot_id,
    situation: situationOf(robot, nowMs),
  }));
  const [worst] = [...fleet].sort((a, b) => rankOf(a.situation) - rankOf(b.situation));
  if (!worst) return { level: "away", said: i18n.t("robot.none"), robotId: null };
  const { robot, situation } = worst;
  const { level } = situation;
  if (level !== "working" && level !== "away") {
    const bad = fleet.filter((one) => one.situation.level === "danger").length;
    const slots = { robot, said: sentenceOf(situation, i18n), more: bad - 1 };
    const said = i18n.t(`situation.of_robot${bad > 1 ? "_more" : ""}`, slots);
    return { level, said, robotId: robot };
  }
  return quietSaid(fleet, i18n);
}

/**
 * A fleet of which nothing bad is known: all clear only if every robot says so.
 *
 * @param {{robot: string, situation: Situation}[]} fleet
 * @param {I18n} i18n
 * @returns {FleetSaid}
 */
function quietSaid(fleet, i18n) {
  const named = (/** @type {(one: Situation) => boolean} */ belongs) =>
    fleet.filter(({ situation }) => belongs(situation)).map(({ robot }) => robot);
  const away = named(({ level }) => level === "away");
  const clear = named(({ state }) => state === "clear");
  const others = named(({ level, state }) => level === "working" && state !== "clear");
  const [robot] = clear;
  const count = clear.length;
  const slots = { robot, count, away: away.join(", "), others: others.join(", ") };
  if (away.length) {
    const key = away.length === fleet.length ? "none_heard" : "some_away";
    const said = i18n.t(`situation.fleet.${key}`, slots);
    return { level: "away", said, robotId: null };
  }
  const key = others.length
    ? `${count ? "some" : "none"}_clear`
    : `clear_${count === 1 ? "one" : "many"}`;
  return {
    level: "working",
    said: i18n.t(`situation.fleet.${key}`, slots),
    robotId: null,
  };
}
