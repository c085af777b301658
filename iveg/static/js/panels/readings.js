/**
 * What a robot's small sensors say, one row each: the card and the Fleet page show all.
 */

/** @typedef {import("../protocol.js").Robot} Robot */
/** @typedef {import("../i18n.js").Words} Words */

/**
 * @typedef {object} Reading
 * @property {string} label key of its name
 * @property {(robot: Robot, words: Words) => string | null} say null: nothing is known
 */

/** @type {readonly Reading[]} */
const READINGS = [{ label: "robot.battery", say: saidOfBattery }];

/** Every row, a dash where nothing is known, so that cards keep their height.
 * @param {Robot | undefined} robot @param {Words} words
 * @returns {{label: string, said: string}[]} */
export function readingsOf(robot, words) {
  return READINGS.map(({ label, say }) => ({
    label: words.t(label),
    said: (robot && say(robot, words)) ?? "—",
  }));
}

/** @param {Robot} robot @param {Words} words */
function saidOfBattery({ battery }, words) {
  if (!battery || battery.percentage === null) return null;
  const key = battery.charging ? "robot.battery_charging" : "robot.battery_level";
  return words.t(key, { level: battery.percentage });
}
