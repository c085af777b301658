/**
 * Readings of a robot's small sensors, a row each: the card and the Fleet page show all.
 */

import { SENSORS } from "../core/sensors.js";
import { fill, make, setText } from "./dom.js";

/** @typedef {import("../core/protocol.js").Robot} Robot */
/** @typedef {import("../core/i18n.js").I18n} I18n */
/** @typedef {typeof SENSORS[number]} Sensor */
/** @typedef {{[quantity: string]: number | boolean | null}} Quantities */

/**
 * @typedef {object} Reading
 * @property {string} label
 * @property {string} said a dash for an unknown value, so that cards keep their height
 */

/** Every row.
 * @param {Robot | undefined} robot @param {I18n} i18n
 * @returns {Reading[]} */
export function readingsOf(robot, i18n) {
  return SENSORS.map((sensor) => {
    const label = i18n.t(`robot.${sensor.name}`);
    const read = /** @type {Quantities | null | undefined} */ (robot?.[sensor.name]);
    const level = read?.[sensor.shown];
    if (!read || typeof level !== "number") return { label, said: "—" };
    return { label, said: i18n.t(keyOf(sensor, read), { level }) };
  });
}

/** @param {Sensor} sensor @param {Quantities} read */
function keyOf({ name, flags }, read) {
  return `robot.${name}_${flags.find((flag) => read[flag]) ?? "level"}`;
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
    const [name, value] = row.querySelectorAll("span");
    setText(name, label);
    setText(value, said);
  });
}

function makeRow() {
  const row = make("p", "card__line");
  row.append(make("span", "card__label"), " ", make("span"));
  return row;
}
