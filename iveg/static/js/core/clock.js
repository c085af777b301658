/**
 * The age of a value now, and the link of a robot that follows from it.
 *
 * The server says how old a value was when it sent it (`age_s`); from then on the
 * browser's own monotonic clock counts.  No wall clock enters, so a tablet with a wrong
 * date shows right ages, and silence alone turns LIVE into LATE and LATE into LOST.
 */

import { LIMITS } from "./limits.js";

/**
 * @typedef {"LIVE" | "LATE" | "LOST" | "UNKNOWN"} Link
 *
 * Fields of every stored value: `age_s` (s) at the server when sent, null for a value
 * never received; `receivedAtMs` (ms, `performance.now()`) when the browser got it.
 * @typedef {{age_s?: number | null, receivedAtMs?: number}} Aged
 */

/**
 * Age of a value now (s); Infinity for a value that was never received.
 *
 * @param {Aged | null | undefined} data
 * @param {number} [nowMs] `performance.now()` (ms)
 * @returns {number}
 */
export function ageOf(data, nowMs = performance.now()) {
  if (!data || data.age_s === null) return Number.POSITIVE_INFINITY;
  const waited = Math.max(0, nowMs - (data.receivedAtMs ?? nowMs)) / 1000;
  return (data.age_s ?? 0) + waited;
}

/**
 * The link that an age means.
 *
 * @param {number} ageS (s)
 * @returns {Link}
 */
export function linkOf(ageS) {
  if (ageS === Number.POSITIVE_INFINITY) return "UNKNOWN";
  if (ageS <= LIMITS.live_s) return "LIVE";
  return ageS <= LIMITS.late_s ? "LATE" : "LOST";
}

/**
 * The link of a robot now, judged here and not by what the server last wrote.
 *
 * @param {Aged | null | undefined} robot
 * @param {number} [nowMs] `performance.now()` (ms)
 * @returns {Link}
 */
export function linkOfRobot(robot, nowMs = performance.now()) {
  return linkOf(ageOf(robot, nowMs));
}

/** Whether nobody knows what such a robot does now. @param {Link} link */
export const isSilent = (link) => link === "LOST" || link === "UNKNOWN";

/**
 * The text of an age, marked where it is an estimate without proof from the robot.
 *
 * @param {{age_estimated?: boolean} | null | undefined} robot
 * @param {string} said
 * @param {{t: (key: string, slots: {said: string}) => string}} i18n
 * @returns {string}
 */
export function aboutAge(robot, said, i18n) {
  return robot?.age_estimated ? i18n.t("robot.age_about", { said }) : said;
}

/**
 * The server's clock as the browser sees it, from pings.
 *
 * Of the last eight round trips the shortest counts: its answer spent the least time
 * waiting somewhere, so half of it is the best guess of the way back (Cristian 1989).
 *
 * `at` is the server's monotonic clock (s), which no correction of the date moves:
 * `localOf(at)` is that moment by `performance.now()` (ms), null before the first answer;
 * `serverOf(nowMs)` is the inverse, with its uncertainty (s).
 *
 * @typedef {{
 *   note: (sentMs: number, receivedMs: number, serverS: number, at?: number) => void,
 *   serverNow: (nowMs: number) => number,
 *   localOf: (at: number) => number | null,
 *   serverOf: (nowMs: number) => {at: number, within: number} | null,
 *   roundTripMs: () => number | null,
 *   reset: () => void,
 * }} ServerClock
 *
 * @param {number} [fallbackOriginS] Unix time (s) at `nowMs` = 0 until a ping is answered
 * @returns {ServerClock}
 */
export function createServerClock(fallbackOriginS = performance.timeOrigin / 1000) {
  /** @type {{roundTrip: number, origin: number, zeroMs: number | null}[]} */
  let samples = [];
  /** Asked for each of hundreds of values a second. */
  let shortest = samples[0];
  const best = () => shortest;
  return {
    note(sentMs, receivedMs, serverS, at) {
      const middle = (sentMs + receivedMs) / 2;
      const sample = {
        roundTrip: receivedMs - sentMs,
        origin: serverS - middle / 1000,
        zeroMs: at === undefined ? null : middle - 1000 * at,
      };
      samples = [...samples.slice(-7), sample];
      shortest = samples.reduce((a, b) => (b.roundTrip < a.roundTrip ? b : a));
    },
    serverNow: (nowMs) =>
      (samples.length ? best().origin : fallbackOriginS) + nowMs / 1000,
    localOf(at) {
      const zeroMs = samples.length ? best().zeroMs : null;
      return zeroMs === null ? null : zeroMs + 1000 * at;
    },
    serverOf(nowMs) {
      const told = samples.length ? best() : null;
      if (told === null || told.zeroMs === null) return null;
      return { at: (nowMs - told.zeroMs) / 1000, within: told.roundTrip / 2000 };
    },
    roundTripMs: () => (samples.length ? samples[samples.length - 1].roundTrip : null),
    reset() {
      samples = [];
    },
  };
}
