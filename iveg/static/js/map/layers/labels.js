/**
 * The labels on the map itself, in the reader's language and number format.
 *
 * @typedef {(key: string, slots?: Record<string, string | number>) => string} Translate
 * @typedef {ReturnType<typeof createLabels>} Labels
 */

import { laneName } from "../../core/lanes.js";

/**
 * @param {Translate} [t] of the keys `class.…`, `lane.…`, `task.…`, `map.encounter`, `map.ghost`,
 *   `map.last_seen`, `map.replay`, `situation.is.…`; without it numbers stand alone
 * @param {string} [locale] BCP 47; the page's by default
 */
export function createLabels(t = untranslated, locale = document.documentElement.lang) {
  const language = locale || "es";
  const plain = new Intl.NumberFormat(language, { maximumFractionDigits: 1 });
  const percents = new Intl.NumberFormat(language, { style: "percent" });
  /** @type {Map<number, Intl.NumberFormat>} by decimals: making one costs a hundred uses */
  const fixed = new Map();

  /** @param {number} value @param {number} decimals */
  function digits(value, decimals) {
    const known = fixed.get(decimals);
    const options = {
      minimumFractionDigits: decimals,
      maximumFractionDigits: decimals,
    };
    const format = known ?? new Intl.NumberFormat(language, options);
    if (!known) fixed.set(decimals, format);
    return format.format(value);
  }

  /** A word of a robot's; one that iVeg does not know, as it was sent.
   * @param {string} kind @param {string} word */
  function translated(kind, word) {
    const key = `${kind}.${word}`;
    const said = t(key);
    return said === key || said === word.toUpperCase() ? word : said;
  }

  return {
    /** @param {string} lane */
    lane: (lane) => laneName(lane, t),
    /** A length of the scale bar. @param {number} m */
    metres: (m) => `${plain.format(m)} m`,
    /** A measured distance. @param {number} m */
    distance: (m) => `${digits(m, 1)} m`,
    /** A length that a person measured. @param {number} m */
    measured: (m) => `${digits(m, 2)} m`,
    /** @param {string} task */
    task: (task) => translated("task", task),
    /** What a detector says that it sees. @param {string} classId */
    seen: (classId) => translated("class", classId),
    /** A number of other equipment. @param {import("../../core/protocol.js").Tile} tile */
    tile: ({ value, state, unit, decimals }) => {
      if (value === null || state === "silent" || state === "unreadable") return "—";
      const said = digits(value, decimals);
      return unit === "1" ? said : `${said} ${unit}`;
    },
    /** @param {number} share 0–1 */
    percent: (share) => percents.format(share),
    /** An age short enough for a tag; tenths while they matter. @param {number} s */
    age: (s) => `${s < 10 ? digits(s, 1) : plain.format(Math.round(s))} s`,
    /** @param {number} s Infinity: nobody knows */
    ago: (s) => (Number.isFinite(s) ? t("map.ghost", { age: Math.round(s) }) : "? s"),
    /** @param {number} s */
    lastSeen: (s) => t("map.last_seen", { age: Math.round(s) }),
    /** How soon a zone is reached, and how sure that is. @param {string} robot
     * @param {number} seconds @param {number} share 0–1 */
    encounter: (robot, seconds, share) => t("map.encounter", { robot, seconds, share }),
    replay: () => t("map.replay"),
    noCamera: () => t("situation.is.no_camera"),
  };
}

/** @type {Translate} */
function untranslated(key, slots = {}) {
  const values = Object.values(slots);
  return values.length ? values.join(" ") : (key.split(".").pop() ?? "").toUpperCase();
}
