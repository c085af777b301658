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

/** An older detection frame says nothing of now (s). */
const CERTAIN_FOR_S = 3;
const DEGREES = 180 / Math.PI;

/** Whether a robot has ever sent a pose or a report. @param {Robot | undefined} robot */
export const isHeard = (robot) => Boolean(robot?.pose ?? robot?.applied);

/** Whether a robot is at rest. @param {Robot | undefined} robot */
function isAtRest(robot) {
  return (
    Math.abs(robot?.twist?.linear ?? 1) < LIMITS.standing_speed &&
    Math.abs(robot?.twist?.angular ?? 1) < LIMITS.standing_speed
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
  // A robot that stands stops nothing.
  if (isAtRest(robot) && margin.band !== "unknown")
    return i18n.t("robot.margin_stands", margin);
  const band = i18n.t(`robot.margin_band.${margin.band}`);
  if (margin.band === "unknown") return band;
  return i18n.t("robot.margin_value", { margin_m: margin.margin_m, band });
}

/**
 * What the margin is made of; empty without one.
 *
 * @param {Robot | undefined} robot
 * @param {I18n} i18n
 */
export function marginPartsSaid(robot, i18n) {
  const margin = robot?.margin;
  if (!margin) return "";
  const key = isAtRest(robot) ? "robot.margin_parts_stands" : "robot.margin_parts";
  return i18n.t(key, { ...margin });
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
