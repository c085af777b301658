/**
 * State and text of a STOP control, as pure functions of the facts (docs/dashboard.md).
 *
 * A request is never shown as a result: *asked*, *acknowledged* and *standing* are three
 * different states, and a control without a connection looks unlike one that works.
 *
 * @typedef {import("../core/protocol.js").Command} Command
 * @typedef {import("../core/clock.js").Link} Link
 * @typedef {import("../core/store.js").ConnectionState} ConnectionState
 * @typedef {import("./press.js").Pending} Pending
 * @typedef {{state: StopState, key: string, slots: Record<string, string | number>}} View
 * @typedef {"ready" | "late" | "lost" | "asked" | "not_taken" | "acknowledged" |
 *   "standing" | "unconfirmed" | "still_moving" | "stale" | "moved" | "releasing" |
 *   "rearmed"} StopState
 *
 * @typedef {{
 *   robotId: string,
 *   connection: ConnectionState,
 *   isBlind?: boolean,
 *   isResuming?: boolean,
 *   link: Link,
 *   ageS: number,
 *   command: Command | null,
 *   press: Pending | null,
 *   nowMs: number,
 *   serverNowS: number,
 * }} RobotFacts `isBlind`: the session is over and may still stop;
 *   `isResuming`: the order under way is a resume; `nowMs` is `performance.now()`,
 *   `serverNowS` Unix time
 */

import { isSilent } from "../core/clock.js";
import { LIMITS } from "../core/limits.js";

/** @type {Record<string, StopState>} */
const BY_COMMAND = {
  REQUESTED: "asked",
  SENT: "asked",
  DELIVERED: "acknowledged",
  STANDING: "standing",
  UNCONFIRMED: "unconfirmed",
  STILL_MOVING: "still_moving",
  STALE: "stale",
  RELEASING: "releasing",
  READY: "rearmed",
};

/** Reason of a command that was made because a held robot moved. */
const MOVED = "moved";

/** Until it stands again, its movement is graver news than the order to stop. */
const MOVED_UNTIL = new Set(["asked", "acknowledged"]);

/** States in which a new press is news and must be visible. */
const GIVES_WAY = new Set(["standing", "stale", "releasing", "rearmed"]);

/** From the loudest to the quietest; the fleet's control shows the loudest. */
const LOUDEST_FIRST = /** @type {StopState[]} */ ([
  "unconfirmed",
  "still_moving",
  "moved",
  "not_taken",
  "asked",
  "acknowledged",
  "releasing",
  "stale",
  "rearmed",
  "standing",
]);

/** Age from which a press without an answer is shown as such (ms). */
export const TAKEN_LIMIT_MS = 500;

/**
 * One robot's control.
 *
 * @param {RobotFacts} facts
 * @returns {View}
 */
export function viewOfRobot(facts) {
  const robot = facts.robotId;
  if (facts.isBlind) return blind(facts.press, facts.nowMs, { robot });
  if (isCut(facts.connection)) return lost(facts.press, facts.nowMs);
  const state = shownState(facts);
  if (facts.press && (!state || GIVES_WAY.has(state))) {
    return viewOfPress(facts.press, facts.nowMs);
  }
  if (state && facts.command) return viewOfCommand(state, facts.command, facts);
  if (facts.connection === "connecting" || facts.link === "LATE") {
    return { state: "late", key: "stop.late", slots: { robot, seconds: aged(facts) } };
  }
  if (facts.link !== "LIVE") return lost(null, facts.nowMs);
  return { state: "ready", key: "stop.ready", slots: { robot } };
}

/**
 * The control of the whole fleet.
 *
 * @param {{connection: ConnectionState, isBlind?: boolean, press: Pending | null,
 *   nowMs: number, robots: {view: View, link: Link, ageS: number}[]}} facts
 * @returns {View}
 */
export function viewOfFleet({ connection, isBlind, press, nowMs, robots }) {
  if (isBlind) return blind(press, nowMs, null);
  if (isCut(connection)) return lost(press, nowMs);
  if (press) return viewOfPress(press, nowMs);
  const total = robots.length;
  const standing = robots.filter(({ view }) => view.state === "standing").length;
  if (total && standing === total) {
    return {
      state: "standing",
      key: "stop.standing_fleet",
      slots: { count: standing, total },
    };
  }
  const states = robots.map(({ view }) => view.state);
  if (total && states.every((state) => LOUDEST_FIRST.includes(state))) {
    const loudest = LOUDEST_FIRST.find((state) => states.includes(state));
    const told = robots.find(({ view }) => view.state === loudest);
    if (told) return told.view;
  }
  if (total && robots.every(({ link }) => isSilent(link))) {
    return lost(null, nowMs);
  }
  return viewOfQuietFleet(connection, robots);
}

/**
 * Some robot hears: the press is sent, and reaches no robot without contact.
 *
 * @param {ConnectionState} connection
 * @param {{link: Link, ageS: number}[]} robots
 * @returns {View}
 */
function viewOfQuietFleet(connection, robots) {
  const count = robots.filter(({ link }) => isSilent(link)).length;
  if (connection === "open" && count) {
    const slots = { count, total: robots.length };
    return { state: "late", key: "stop.part_fleet", slots };
  }
  const late = robots.filter(({ link }) => link === "LATE");
  if (connection === "connecting" || late.length) {
    const seconds = Math.max(0, ...late.map(({ ageS }) => ageS));
    return { state: "late", key: "stop.late_fleet", slots: { seconds } };
  }
  return { state: "ready", key: "stop.ready_fleet", slots: {} };
}

/** @param {Command | null} command @returns {StopState | null} */
export function stateOfCommand(command) {
  if (!command) return null;
  const state = BY_COMMAND[command.state] ?? null;
  const moved = command.reason === MOVED && MOVED_UNTIL.has(state ?? "");
  return moved ? "moved" : state;
}

/**
 * A standstill is shown for as long as the robot's report of it is fresh: the browser
 * counts by itself, for a server may hang as well as a robot.
 *
 * @param {RobotFacts} facts
 * @returns {StopState | null}
 */
function shownState({ command, nowMs }) {
  const state = stateOfCommand(command);
  if (!command || state !== "standing") return state;
  const ageS = doubtOf(command, nowMs)?.ageS ?? Number.POSITIVE_INFINITY;
  return ageS > LIMITS.report_stale_s ? "stale" : "standing";
}

/**
 * @param {StopState} state
 * @param {Command} command
 * @param {RobotFacts} facts
 * @returns {View}
 */
function viewOfCommand(state, command, facts) {
  const key = `stop.${state}`;
  if (state === "asked") {
    const ms = facts.press
      ? facts.nowMs - facts.press.atMs
      : since(command.times.requested, facts.serverNowS) * 1000;
    return { state, key, slots: { ms } };
  }
  if (state === "releasing" && facts.isResuming) {
    return { state, key: "stop.resuming", slots: {} };
  }
  if (state === "standing") {
    if (command.times.standing === null) {
      return { state, key: "stop.standing_untimed", slots: {} };
    }
    const seconds = since(command.times.standing, facts.serverNowS);
    return { state, key, slots: { seconds } };
  }
  if (state === "stale") {
    const seconds = Math.max(aged(facts), reportAge(command, facts.nowMs));
    return { state, key, slots: { seconds } };
  }
  return { state, key, slots: {} };
}

/**
 * @param {Pending} press
 * @param {number} nowMs
 * @returns {View}
 */
function viewOfPress(press, nowMs) {
  const ms = nowMs - press.atMs;
  if (!press.accepted && ms > TAKEN_LIMIT_MS) {
    return { state: "not_taken", key: "stop.not_taken", slots: { tries: press.tries } };
  }
  return { state: "asked", key: "stop.asked", slots: { ms } };
}

/**
 * @param {Pending | null} press
 * @param {number} nowMs
 * @returns {View}
 */
function lost(press, nowMs) {
  // The press must be visible, and visibly without an answer.
  if (press && !press.accepted) {
    const seconds = Math.max(0, (nowMs - press.atMs) / 1000);
    return { state: "lost", key: "stop.kept", slots: { seconds } };
  }
  return { state: "lost", key: "stop.lost", slots: {} };
}

/**
 * A session that is over: STOP is still accepted, but its effect is not visible.
 *
 * @param {Pending | null} press
 * @param {number} nowMs
 * @param {{robot: string} | null} slots null is the fleet
 * @returns {View}
 */
function blind(press, nowMs, slots) {
  if (press?.accepted) return { state: "asked", key: "stop.blind_taken", slots: {} };
  if (press) return lost(press, nowMs);
  const key = slots ? "stop.blind" : "stop.blind_fleet";
  return { state: "late", key, slots: slots ?? {} };
}

/** @param {ConnectionState} connection */
const isCut = (connection) => connection === "lost" || connection === "signed-out";

/** Age of the robot's last report (s). @param {Command} command @param {number} nowMs */
const reportAge = (command, nowMs) => doubtOf(command, nowMs)?.ageS ?? 0;

/**
 * Age of a robot's last report, and how far it may have driven since: the server's
 * figures, which the browser continues.
 *
 * @param {Command} command
 * @param {number} nowMs `performance.now()`
 * @returns {{ageS: number, movedM: number} | null} null when it never said anything
 */
export function doubtOf({ robot, receivedAtMs }, nowMs) {
  if (!robot || robot.report_age_s === null) return null;
  const waitedS = Math.max(0, nowMs - (receivedAtMs ?? nowMs)) / 1000;
  const movedM = (robot.moved_m ?? 0) + Math.abs(robot.v ?? 0) * waitedS;
  return { ageS: robot.report_age_s + waitedS, movedM };
}

/** @param {RobotFacts} facts age that can be written (s) */
const aged = ({ ageS }) => (Number.isFinite(ageS) ? ageS : 0);

/** @param {string | null | undefined} iso @param {number} nowS */
export function since(iso, nowS) {
  const at = iso ? Date.parse(iso) / 1000 : Number.NaN;
  return Number.isFinite(at) ? Math.max(0, nowS - at) : 0;
}
