/**
 * Everything that the page says of a fleet, surface by surface, by its own pure functions.
 *
 * Without a language a text is its key and slots, so that a test can compare facts.
 */

import { linkOfRobot } from "../../iveg/static/js/core/clock.js";
import { fleetSaid } from "../../iveg/static/js/core/fleet_said.js";
import { createI18n } from "../../iveg/static/js/core/i18n.js";
import {
  phrasesOf,
  sentenceOf,
  situationOf,
} from "../../iveg/static/js/core/situation.js";
import { isSeenHeld, tagsOf } from "../../iveg/static/js/map/layers/tags.js";
import { statusOf } from "../../iveg/static/js/pages/fleet.js";
import { heardOf, judgeDataPath } from "../../iveg/static/js/pages/health_sentence.js";
import { readingOf } from "../../iveg/static/js/panels/gauge.js";
import { peopleSaid } from "../../iveg/static/js/panels/map_facts.js";
import { marginSaid } from "../../iveg/static/js/panels/robot_texts.js";

/** @typedef {import("./builders.js").Robot} Robot */
/** @typedef {import("../../iveg/static/js/core/i18n.js").I18n} I18n */
/** @typedef {import("../../iveg/static/js/core/store.js").ConnectionState} ConnectionState */

const KEYS = /** @type {I18n} */ (
  /** @type {unknown} */ ({
    t: (/** @type {string} */ key, /** @type {object} */ slots = {}) =>
      [key, ...Object.values(slots)].join(" "),
    has: () => true,
    number: String,
  })
);

/** @param {string} language empty: keys @returns {Promise<I18n>} */
async function wordsOf(language) {
  if (!language) return KEYS;
  const load = async () => (await fetch(`/static/i18n/${language}.json`)).json();
  const i18n = createI18n(load);
  await i18n.use(/** @type {"es" | "en"} */ (language));
  return i18n;
}

/**
 * @param {Robot[]} robots as the server told them
 * @param {number} waitedS ago
 * @param {string} language
 * @param {import("./builders.js").Person[]} people
 * @param {ConnectionState} connection
 */
export async function all(robots, waitedS, language, people = [], connection = "open") {
  const i18n = await wordsOf(language);
  const [nowMs, read] = [performance.now(), performance.now];
  performance.now = () => nowMs; // one moment for all surfaces
  try {
    const receivedAtMs = nowMs - waitedS * 1000;
    return {
      ...surfaces(robots, receivedAtMs, i18n, connection),
      ...counted(people, receivedAtMs, i18n),
    };
  } finally {
    performance.now = read;
  }
}

/**
 * @param {Robot[]} robots @param {number} receivedAtMs @param {I18n} i18n
 * @param {ConnectionState} connection
 */
function surfaces(robots, receivedAtMs, i18n, connection) {
  const fleet = robots.map((robot) => ({ ...robot, receivedAtMs }));
  const { level, said } = fleetSaid(fleet, i18n);
  const chain = judgeDataPath([{ hop: "mqtt", state: "ok" }], heardOf(fleet), true);
  return {
    level,
    status: said,
    chain: chain.key,
    chip: chain.state,
    robots: fleet.map((robot) => ofRobot(robot, i18n, connection)),
  };
}

/**
 * Who is there: with cameras, without any, and without the server.
 *
 * @param {import("./builders.js").Person[]} people
 * @param {number} receivedAtMs @param {I18n} i18n
 */
function counted(people, receivedAtMs, i18n) {
  const known = /** @type {any[]} */ (people.map((one) => ({ ...one, receivedAtMs })));
  const looking = (/** @type {number} */ cameras) =>
    /** @type {any} */ ({ cameras, share: 0.5, receivedAtMs: performance.now() });
  return {
    people: peopleSaid(known, looking(2), true, i18n),
    blind: peopleSaid(known, looking(0), true, i18n),
    gone: peopleSaid(known, looking(2), false, i18n),
  };
}

/** @param {Robot} robot @param {I18n} i18n @param {ConnectionState} connection */
function ofRobot(robot, i18n, connection) {
  const situation = situationOf(robot, performance.now(), connection);
  const link = linkOfRobot(robot);
  const seen = /** @type {any} */ ({ situation, link, ageS: 0, replay: false });
  const labels = /** @type {any} */ ({
    percent: (/** @type {number} */ share) => `${share}`,
    age: () => "",
    ago: () => "",
  });
  const theme = /** @type {any} */ ({ alert: [] });
  const said = phrasesOf(situation, i18n);
  return {
    robot: robot.robot_id,
    link,
    level: situation.level,
    said: said.said,
    line: sentenceOf(situation, i18n),
    row: statusOf(robot, i18n, connection),
    margin: marginSaid(robot, i18n),
    factor: readingOf(robot).factor,
    locks: robot.holds.length,
    padlock: isSeenHeld(seen),
    pill: tagsOf({ theme, labels }, seen)
      .map(([text]) => text)
      .join(""),
  };
}
