/**
 * What a robot's card says, as pure functions of what is known of the robot.
 *
 * What nobody knows is said to be unknown: never a clear way, a speed or a margin.
 */

import { LIMITS } from "../core/limits.js";

/** @typedef {import("../core/i18n.js").I18n} I18n */
/** @typedef {import("../core/protocol.js").Margin} Margin */
/** @typedef {import("../core/protocol.js").Robot} Robot */

/** What is shown as 0.00 (m/s, rad/s). */
const STILL = 0.005;

/**
 * What a robot does, in words; that it was told to stop is not that it stands.
 *
 * @param {Robot | undefined} robot
 * @param {I18n} i18n
 * @param {boolean} [isResuming] what is under way is a resume, and no release
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
 * Why it does that; nothing of a robot that was never heard.
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
  const distance = robot.speed_limit?.distance_m ?? null;
  if (distance === null && (reason === "person" || reason === "robot")) {
    return i18n.t(`why.${reason}`);
  }
  if (!reason || (reason === "clear" && isWaiting(robot))) return "";
  return i18n.t(`robot.why.${reason}`, { distance });
}

/** Whether a robot has ever said where it is. @param {Robot | undefined} robot */
export const isHeard = (robot) => Boolean(robot?.pose ?? robot?.applied);

/** It could drive and does not. @param {Robot | undefined} robot */
function isWaiting(robot) {
  const { mode, twist } = robot ?? {};
  return (
    mode === "RUNNING" &&
    Math.abs(twist?.linear ?? 1) < STILL &&
    Math.abs(twist?.angular ?? 1) < STILL
  );
}

/**
 * What a robot finds wrong with its own data, a sentence each.
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

/** @param {Margin | null} margin @param {I18n} i18n */
export function marginSaid(margin, i18n) {
  if (!margin) return i18n.t("robot.margin_nobody");
  const band = i18n.t(`robot.margin_band.${margin.band}`);
  if (margin.band === "unknown") return band;
  return i18n.t("robot.margin_value", { margin_m: margin.margin_m, band });
}

/** A task in the reader's words; one of another fleet as it was sent, none as none.
 * @param {string | null | undefined} task @param {I18n} i18n */
export function taskSaid(task, i18n) {
  if (!task || task === "none") return i18n.t("task.unknown");
  const key = `task.${task}`;
  return i18n.has(key) ? i18n.t(key) : task;
}
