/**
 * The parameters of the rule, as the server's table (`iveg/domain/parameters.py`) has
 * them: it writes that into the page, so that no parameter is named here.
 *
 * @typedef {import("../core/protocol.js").Rule} Rule
 * @typedef {"person" | "robot"} Class
 * @typedef {{
 *   key: string, class_key: string | null, unit: "share" | "m" | "s" | "switch",
 *   protects: "more" | "less", word: string,
 * }} Parameter `key` and `class_key` as the API has them
 * @typedef {import("../core/i18n.js").I18n} I18n
 */

import { need } from "../panels/dom.js";

/** @type {readonly Class[]} */
export const CLASSES = ["person", "robot"];

/** @returns {Parameter[]} */
export function readParameters() {
  return JSON.parse(need("#rule-section").dataset.parameters ?? "");
}

/** All keys of a parameter in the API. @param {Parameter} parameter */
export function keysOf({ key, class_key }) {
  return class_key === null ? [key] : [key, class_key];
}

/** The values of all parameters. @param {Parameter[]} parameters @param {Rule} rule */
export function valuesOf(parameters, rule) {
  const keys = parameters.flatMap(keysOf);
  return Object.fromEntries(keys.map((key) => [key, membersOf(rule)[key]]));
}

/**
 * The value of a class of its own; undefined: it has none.
 *
 * @param {Parameter} parameter @param {Rule} rule @param {Class} class_
 * @returns {number | undefined}
 */
export function ownOf({ class_key }, rule, class_) {
  return class_key === null ? undefined : membersOf(rule)[class_key]?.[class_];
}

/**
 * The value that counts for a class; null: for any.
 *
 * @param {Parameter} parameter @param {Rule} rule @param {Class | null} class_
 * @returns {number | boolean}
 */
export function valueFor(parameter, rule, class_) {
  const own = class_ === null ? undefined : ownOf(parameter, rule, class_);
  return own ?? membersOf(rule)[parameter.key];
}

/** A parameter's values in words. @param {Parameter} parameter @param {Rule} rule
 * @param {I18n} i18n */
export function valueSaid(parameter, rule, i18n) {
  const own = CLASSES.flatMap((class_) => {
    const value = ownOf(parameter, rule, class_);
    if (value === undefined) return [];
    return [`${i18n.t(`rule.class.${class_}`)} ${measureSaid(parameter, value, i18n)}`];
  });
  return [measureSaid(parameter, valueFor(parameter, rule, null), i18n), ...own].join(
    " ",
  );
}

/** @param {Parameter} parameter @param {number | boolean} value @param {I18n} i18n */
function measureSaid({ unit }, value, i18n) {
  if (unit === "switch") return i18n.t(`rule.unit.${value ? "on" : "off"}`);
  return i18n.t(`rule.unit.${unit}`, { value });
}

/** @param {Rule} rule */
const membersOf = (rule) => /** @type {Record<string, any>} */ (rule);
