/**
 * The texts of a robot's card, as pure functions of the robot's state.
 *
 * An unknown value is said to be unknown: never a clear way, a speed or a margin.
 */

import { ageOf, isSilent, linkOfRobot } from "../core/clock.js";
import { LIMITS } from "../core/limits.js";
import { readingOf } from "./gauge.js";

/** @typedef {import("../core/i18n.js").I18n} I18n */
/** @typedef {import("../core/protocol.js").DetectionFrame} DetectionFrame */
/** @typedef {import("../core/protocol.js").Robot} Robot */

/** Shown as 0.00 (m/s, rad/s). */
const STILL = 0.005;
/** An older detection frame says nothing of now (s). */
const CERTAIN_FOR_S = 3;
const DEGREES = 180 / Math.PI;

/**
 * What a robot does; an order to stop is not yet a standstill.
 *
 * @param {Robot | undefined} robot
 * @param {I18n} i18n
 * @param {boolean} [isResuming] the order under way is a resume, and no release
 */
export function modeSaid(robot, i18n, isResuming = false) {
  const { mode = "UNKNOWN", stop } = robot ?? {};
  if (!isHeard(robot)) return i18n.t("robot.mode.UNKNOWN");
  if (stop && stop.state !== "STANDING") {
    if (stop.state === "RELEASING" && isResuming) return i18n.t("robot.mode_resuming");
    const state = i18n.t(`history.state.${stop.state}`);
    return i18n.t("robot.mode_stopping", { state });
  }
  if (isWaiting(robot)) return i18n.t("robot.mode.WAITING");
  if (mode !== "SLOW") return i18n.t(`robot.mode.${mode}`);
  return i18n.t("robot.mode_slow", { factor: LIMITS.slow_factor });
}

/**
 * Why it does that; empty for a robot without any message yet.
 *
 * @param {Robot | undefined} robot
 * @param {I18n} i18n
 */
export function whySaid(robot, i18n) {
  if (!robot || !isHeard(robot)) return "";
  if (robot.holds.length) {
    const names = robot.holds.map(({ source }) =>
      i18n.t(`release.hold_source.${source}`),
    );
    return i18n.t("robot.why.held", { sources: [...new Set(names)].join(", ") });
  }
  const isLimited = (robot.speed_limit?.speed_factor ?? 1) < 1;
  const reason = isLimited ? robot.speed_limit?.reason : robot.applied?.reason;
  const [lacks] = robot.missing ?? [];
  if (isLimited && lacks && (reason === "stale" || reason === "doubt")) {
    return missingSaid(lacks, robot.robot_id, i18n);
  }
  const distance = robot.speed_limit?.distance_m ?? null;
  if (distance === null && (reason === "person" || reason === "robot")) {
    return i18n.t(`why.${reason}`);
  }
  const isHollow = isWaiting(robot) || isSilent(linkOfRobot(robot));
  if (!reason || (reason === "clear" && isHollow)) return "";
  const seconds = robot.speed_limit?.foretold_s ?? null;
  if (isLimited && seconds !== null) {
    return i18n.t(`robot.why.${reason}_ahead`, { distance, seconds });
  }
  return i18n.t(`robot.why.${reason}`, { distance });
}

/**
 * What a robot lacks to be clear.
 *
 * @param {import("../types.js").MissingPremise} lacks
 * @param {string} ownId
 * @param {I18n} i18n
 */
function missingSaid({ premise, robot_id }, ownId, i18n) {
  const own = premise !== "pose" && robot_id === ownId ? "_own" : "";
  return i18n.t(`robot.missing.${premise}${own}`, { robot: robot_id });
}

/** Whether a robot has ever sent a pose or a report. @param {Robot | undefined} robot */
export const isHeard = (robot) => Boolean(robot?.pose ?? robot?.applied);

/** Whether a robot could drive and does not. @param {Robot | undefined} robot */
function isWaiting(robot) {
  const { mode, twist } = robot ?? {};
  return (
    mode === "RUNNING" &&
    Math.abs(twist?.linear ?? 1) < STILL &&
    Math.abs(twist?.angular ?? 1) < STILL
  );
}

/**
 * The faults that a robot reports of its own data, a sentence each.
 *
 * @param {Robot} robot
 * @param {I18n} i18n
 */
export function faultsSaid(robot, i18n) {
  return (robot.applied?.faults ?? []).map(({ code, about, for_s }) => {
    const known = i18n.has(`robot.fault.${code}`) ? code : "other";
    const said = i18n.t(`robot.fault.${known}`, { code, about });
    return for_s === null ? said : i18n.t("robot.fault_for", { said, seconds: for_s });
  });
}

/** @param {Robot | undefined} robot @param {I18n} i18n */
export function marginSaid(robot, i18n) {
  if (isSilent(linkOfRobot(robot))) return i18n.t("robot.margin_lost");
  const margin = robot?.margin;
  if (!margin) return i18n.t("robot.margin_nobody");
  const band = i18n.t(`robot.margin_band.${margin.band}`);
  if (margin.band === "unknown") return band;
  return i18n.t("robot.margin_value", { margin_m: margin.margin_m, band });
}

/** A task in the reader's language; a task that iVeg does not know, as it was sent.
 * @param {string | null | undefined} task @param {I18n} i18n */
export function taskSaid(task, i18n) {
  if (!task || task === "none") return i18n.t("task.unknown");
  const key = `task.${task}`;
  return i18n.has(key) ? i18n.t(key) : task;
}

/** The age of a pose (s, finite). @param {number} ageS @param {I18n} i18n */
export function agoSaid(ageS, i18n) {
  return i18n.t(ageS < 10 ? "robot.ago" : "robot.ago_long", { age: ageS });
}

/**
 * Pose and twist by the field of the card that shows them.
 *
 * @param {Robot | undefined} robot
 * @param {I18n} i18n
 * @returns {[string, string][]}
 */
export function readoutsSaid(robot, i18n) {
  const { pose, twist } = robot ?? {};
  const said = (
    /** @type {number | null | undefined} */ value,
    /** @type {number} */ decimals,
    /** @type {string} */ unit,
  ) =>
    value === null || value === undefined
      ? "—"
      : `${i18n.number(value, decimals)} ${i18n.t(`robot.unit.${unit}`)}`;
  return [
    ["x", said(pose?.x, 2, "m")],
    ["y", said(pose?.y, 2, "m")],
    ["yaw", said(pose && pose.yaw * DEGREES, 1, "deg")],
    ["v", said(twist?.linear, 2, "ms")],
    ["w", said(twist?.angular, 2, "rads")],
  ];
}

/**
 * What the gauge draws and says.
 *
 * @param {Robot | undefined} robot
 * @param {string} robotId
 * @param {I18n} i18n
 * @returns {import("./gauge.js").Reading}
 */
export function gaugeSaid(robot, robotId, i18n) {
  const { speed, max, factor } = readingOf(robot);
  const limit = (factor ?? 1) * max;
  const isKnown = speed !== null;
  return {
    speed,
    max,
    factor,
    name: i18n.t("robot.gauge", { robot: robotId }),
    said: isKnown
      ? i18n.t("robot.gauge_value", { speed, max, limit })
      : i18n.t("robot.speed_unknown"),
    limitSaid: factor === null ? "" : i18n.t("robot.limit", { limit }),
    speedSaid: isKnown ? i18n.number(Math.abs(speed), 2) : "—",
  };
}

/**
 * How certain the detector is of its most certain detection now.
 *
 * @param {DetectionFrame | undefined} frame the robot's newest
 * @param {I18n} i18n
 */
export function certaintySaid(frame, i18n) {
  if (!frame || ageOf(frame) > CERTAIN_FOR_S) return i18n.t("robot.certainty_old");
  const [best] = [...frame.items].sort((a, b) => b.probability - a.probability);
  if (!best) return i18n.t("robot.certainty_none");
  const key = best.confident ? "robot.certainty_value" : "robot.certainty_faint";
  const slots = { class: best.class ?? best.class_id, confidence: best.probability };
  return i18n.t(key, slots);
}
