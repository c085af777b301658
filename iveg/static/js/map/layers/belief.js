/**
 * The greenhouse as one robot knows it: its own detections, and the server's feedback.
 *
 * A robot receives the shared people and the poses of its peers in the feedback
 * (Algorithm 2), but never their laser scans or raw detections.  A robot whose newest
 * feedback is too old relies on its own detections alone, and so does this picture.
 *
 * @typedef {import("../scene.js").Scene} Scene
 * @typedef {import("../../core/protocol.js").Robot} Robot
 */

/** A robot comes to a stand when its feedback is older (s; `IVEG_FEEDBACK_STAND_S`). */
const DEAF_AFTER_S = 3;

/**
 * Whether a robot reports that it still receives feedback.
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
