/**
 * The situation of the fleet in one sentence: pure functions of those of its robots.
 *
 * Robots of which the same holds for the same reason are told together: one name of ten
 * locked robots would hide nine.
 *
 * @typedef {import("./situation.js").Level} Level
 * @typedef {import("./situation.js").Situation} Situation
 * @typedef {import("./protocol.js").Robot} Robot
 * @typedef {import("./i18n.js").I18n} I18n
 * @typedef {{robot: string, situation: Situation}} One
 * @typedef {{level: Level, kind: import("./situation.js").Kind, said: string,
 *   robotId: string | null}} FleetSaid `level`: of the gravest of the fleet
 */

import { LEVELS, rankOf, sentenceOf, situationOf } from "./situation.js";

/** Two lines of a phone. */
const MOST_LETTERS = 86;
/** So many are named; of more only the first two. */
const NAMED = 3;
/** Each of them is told by itself: where somebody is counts more than how many. */
const ALONE = new Set(["not_slowing"]);
/** Of a fleet without any other state it is said who waits. */
const QUIET = new Set(["clear", "waiting"]);

/**
 * The first in order of all that holds for the fleet, in one sentence: of several of the
 * same kind most of the same, in danger the first of the fleet.
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
  const ranks = fleet.map(({ situation }) => rankOf(situation));
  const first = fleet.filter((_, n) => ranks[n] === Math.min(...ranks));
  if (!first.length)
    return { level: "away", kind: "away", said: i18n.t("robot.none"), robotId: null };
  const [{ situation }] = first;
  const { kind } = situation;
  if (kind === "working" || kind === "away")
    return { ...quietSaid(fleet, i18n), kind, robotId: null };
  const group = groupOf(first);
  const isOther = (/** @type {One} */ one) => isDanger(one) && !group.includes(one);
  const said = saidOfGroup(group, fleet.length, fleet.filter(isOther).length, i18n);
  const levels = fleet.map((one) => LEVELS.indexOf(one.situation.level));
  const level = LEVELS[Math.min(...levels)];
  return { level, kind, said, robotId: group[0].robot };
}

/** @param {One} one */
const isDanger = ({ situation }) => situation.level === "danger";

/** Those that are told together. @param {One[]} alike @returns {One[]} */
function groupOf(alike) {
  /** @type {Map<string, One[]>} */
  const groups = new Map();
  for (const one of alike) {
    const key = likenessOf(one);
    groups.set(key, [...(groups.get(key) ?? []), one]);
  }
  const [first, ...others] = groups.values();
  if (isDanger(alike[0])) return first;
  return others.reduce((a, b) => (b.length > a.length ? b : a), first);
}

/** The same for robots of which one sentence is true. @param {One} one */
function likenessOf({ robot, situation }) {
  const { state, why, about, action, slots } = situation;
  const own = ALONE.has(state) ? robot : "";
  const reason = reasonOf(why);
  const whose = reason?.startsWith("no_") ? about : "";
  return [state, reason, whose, action, slots.factor, own].join(" ");
}

/** A reason without where and how far. @param {string | null} why */
const reasonOf = (why) =>
  why?.replace(/_(at|in|ahead)$/, "").replace(/_was$/, "_unseen") ?? null;

/**
 * @param {One[]} group @param {number} total robots of the fleet
 * @param {number} more in danger and not of the group @param {I18n} i18n
 */
function saidOfGroup(group, total, more, i18n) {
  const [{ robot, situation }] = group;
  const key = `situation.of_robot${more > 0 ? "_more" : ""}`;
  const write = (/** @type {string} */ who, /** @type {string} */ said) =>
    i18n.t(key, { robot: who, said, more });
  if (group.length === 1) return write(robot, sentenceOf(situation, i18n));
  const said = sentenceOf(jointly(group), plural(i18n));
  const names = group.map((one) => one.robot);
  const whole = write(whoSaid(names, total, i18n), said);
  if (whole.length <= MOST_LETTERS || names.length <= NAMED) return whole;
  return write(i18n.t("situation.group.count", { count: names.length }), said);
}

/** @param {string[]} names @param {number} total @param {I18n} i18n */
function whoSaid(names, total, i18n) {
  const slots = { count: names.length, names: names.slice(0, 2).join(", ") };
  if (names.length <= NAMED && (names.length < total || total === 2))
    return names.join(", ");
  return i18n.t(`situation.group.${names.length === total ? "all" : "some"}`, slots);
}

/** What holds for all of a group: the longest silence, no place but one of all.
 * @param {One[]} group @returns {Situation} */
function jointly(group) {
  const all = group.map(({ situation }) => situation);
  const [first] = all;
  const numbers = (/** @type {string} */ name) =>
    all.map(({ slots }) => Number(slots[name] ?? 0));
  const slots = { ...first.slots };
  if ("age" in slots) slots.age = Math.max(...numbers("age"));
  if ("unseen" in slots) slots.unseen = Math.min(...numbers("unseen"));
  const isOnePlace = all.every(
    ({ why, slots: { lane } }) => why === first.why && lane === slots.lane,
  );
  const why = isOnePlace && first.why === "person_in" ? first.why : reasonOf(first.why);
  return { ...first, why, slots };
}

/**
 * The words for several robots, where they differ from those for one.
 *
 * @param {I18n} i18n
 * @returns {I18n}
 */
function plural(i18n) {
  const t = (/** @type {string} */ key, /** @type {any} */ slots) => {
    const [, kind, name] = key.split(".");
    const many = `situation.many.${kind}.${name}`;
    return i18n.t(i18n.has(many) ? many : key, slots);
  };
  return { ...i18n, t };
}

/**
 * A fleet of which nothing bad is known: all clear only if every robot says so.
 *
 * @param {{robot: string, situation: Situation}[]} fleet
 * @param {I18n} i18n
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
    return { level: /** @type {Level} */ ("away"), said };
  }
  const wait = fleet.every(({ situation: { state } }) => QUIET.has(state));
  const key = others.length
    ? `${count ? "some" : "none"}_clear${wait ? "_waiting" : ""}`
    : `clear_${count === 1 ? "one" : "many"}`;
  return {
    level: /** @type {Level} */ ("working"),
    said: i18n.t(`situation.fleet.${key}`, slots),
  };
}
