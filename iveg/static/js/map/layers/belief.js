/**
 * The greenhouse as one robot knows it: its own eyes, and what the server has told it.
 *
 * A robot hears the shared people and the poses of the others by the feedback
 * (Algorithm 2); their laser scans and raw detections it never gets.  One whose newest
 * feedback is too old counts on its own eyes alone, and so does this picture.
 *
 * @typedef {import("../scene.js").Scene} Scene
 * @typedef {import("../../core/protocol.js").Robot} Robot
 */

/** A robot comes to a stand when its feedback is older (s; `IVEG_FEEDBACK_STAND_S`). */
const DEAF_AFTER_S = 3;

/**
 * Whether a robot says that it still hears the server.
 *
 * @param {Robot | undefined} robot
 */
export function hears(robot) {
  const age = robot?.applied?.feedback_age_s;
  return typeof age === "number" && age <= DEAF_AFTER_S;
}

/**
 * @param {Scene} scene
 * @param {string} robotId
 * @param {boolean} isHearing
 * @returns {Scene}
 */
export function believedBy(scene, robotId, isHearing) {
  const own = (/** @type {{robotId: string}} */ it) => it.robotId === robotId;
  return {
    ...scene,
    scans: scene.scans.filter(own),
    detections: scene.detections.filter(own),
    robots: scene.robots.filter(({ id }) => isHearing || id === robotId),
    people: scene.people.filter(
      ({ observers }) => isHearing || observers.includes(robotId),
    ),
  };
}
