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
 * @property {{least: number, most: number, level: number} | null} gauge
 */

/** Every row.
 * @param {Robot | undefined} robot @param {I18n} i18n
 * @returns {Reading[]} */
export function readingsOf(robot, i18n) {
  return SENSORS.map((sensor) => {
    const label = i18n.t(`robot.${sensor.name}`);
    const read = /** @type {Quantities | null | undefined} */ (robot?.[sensor.name]);
    const level = read?.[sensor.shown];
    if (!read || typeof level !== "number") return { label, said: "—", gauge: null };
    const said = i18n.t(keyOf(sensor, read), { level });
    return { label, said, gauge: gaugeOf(sensor, level) };
  });
}

/** @param {Sensor} sensor @param {Quantities} read */
function keyOf({ name, flags }, read) {
  return `robot.${name}_${flags.find((flag) => read[flag]) ?? "level"}`;
}

/** @param {Sensor} sensor @param {number} level @returns {Reading["gauge"]} */
function gaugeOf({ gauge }, level) {
  const bounds = /** @type {readonly number[] | null} */ (gauge);
  return bounds && { least: bounds[0], most: bounds[1], level };
}

/**
 * Writes the rows of a card.
 *
 * @param {HTMLElement} place
 * @param {Robot | undefined} robot
 * @param {I18n} i18n
 */
export function drawReadings(place, robot, i18n) {
  fill(place, readingsOf(robot, i18n), makeRow, (row, { label, said, gauge }) => {
    const [name, value] = row.querySelectorAll("span");
    setText(name, label);
    setText(value, said);
    drawGauge(row, gauge, label);
  });
}

/** @param {Element} row @param {Reading["gauge"]} gauge @param {string} label */
function drawGauge(row, gauge, label) {
  const meter = row.querySelector("meter");
  if (!meter) return;
  meter.hidden = gauge === null;
  if (gauge === null) return;
  meter.ariaLabel = label;
  [meter.min, meter.max, meter.value] = [gauge.least, gauge.most, gauge.level];
}

function makeRow() {
  const row = make("p", "card__line");
  const meter = make("meter", "card__meter");
  meter.hidden = true;
  row.append(make("span", "card__label"), " ", meter, make("span"));
  return row;
}
