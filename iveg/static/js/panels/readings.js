/**
 * Readings of a robot's small sensors, a row each: the card and the Fleet page show all.
 */

import { fill, make, setText } from "./dom.js";

/** @typedef {import("../core/protocol.js").Robot} Robot */
/** @typedef {import("../core/i18n.js").I18n} I18n */

/**
 * @typedef {object} Reading
 * @property {string} label key of its name
 * @property {(robot: Robot, i18n: I18n) => string | null} say null: nothing is known
 */

/** @type {readonly Reading[]} */
const READINGS = [{ label: "robot.battery", say: saidOfBattery }];

/** Every row, with a dash for an unknown value, so that cards keep their height.
 * @param {Robot | undefined} robot @param {I18n} i18n
 * @returns {{label: string, said: string}[]} */
export function readingsOf(robot, i18n) {
  return READINGS.map(({ label, say }) => ({
    label: i18n.t(label),
    said: (robot && say(robot, i18n)) ?? "—",
  }));
}

/**
 * Writes the rows of a card.
 *
 * @param {HTMLElement} place
 * @param {Robot | undefined} robot
 * @param {I18n} i18n
 */
export function drawReadings(place, robot, i18n) {
  fill(place, readingsOf(robot, i18n), makeRow, (row, { label, said }) => {
    const [name, value] = row.children;
    setText(name, label);
    setText(value, said);
  });
}

function makeRow() {
  const row = make("p", "card__line");
  row.append(make("span", "card__label"), " ", make("span"));
  return row;
}

/** @param {Robot} robot @param {I18n} i18n */
function saidOfBattery({ battery }, i18n) {
  if (!battery || battery.percentage === null) return null;
  const key = battery.charging ? "robot.battery_charging" : "robot.battery_level";
  return i18n.t(key, { level: battery.percentage });
}
