/**
 * Four safety figures of the fleet: how soon robots obey, missing answers, time with a
 * negative margin, and the worst margin; each with its age and its number of values.
 */

import { ageOf } from "../core/clock.js";
import { need, setText } from "../panels/dom.js";

/** @typedef {import("../core/protocol.js").Health} Health */
/** @typedef {import("../core/protocol.js").Safety} Safety */
/** @typedef {import("../core/i18n.js").I18n} I18n */
/** @typedef {{value: string, of: string}} Tile */

const TICK_MS = 1000;
/** With fewer values a quantile would be one of them by chance. */
const FEWEST = 20;

/** @param {import("../main.js").App} app */
export function createTiles({ store, i18n }) {
  function draw() {
    /** @type {Health | null | undefined} */
    const health = store.get("health");
    if (!health?.safety) return;
    const waitedS = ageOf({ age_s: 0, receivedAtMs: health.receivedAtMs });
    for (const [name, tile] of Object.entries(tilesOf(health.safety, waitedS, i18n))) {
      setText(need(`#tile-${name}`), tile.value);
      setText(need(`#tile-${name}-of`), tile.of);
    }
  }

  store.subscribe("health", draw);
  i18n.onChange(draw);
  setInterval(draw, TICK_MS);
  draw();
}

/**
 * @param {Safety} safety
 * @param {number} waitedS since the server wrote the ages (s)
 * @param {I18n} i18n
 * @returns {Record<"latency" | "echo" | "negative" | "worst", Tile>}
 */
export function tilesOf(safety, waitedS, i18n) {
  const aged = (/** @type {number | null} */ age) =>
    age === null ? null : age + waitedS;
  return {
    latency: latencyOf(safety.alert_latency, aged, i18n),
    echo: echoOf(safety.not_echoed, aged, i18n),
    negative: negativeOf(safety.negative_margin, aged, i18n),
    worst: worstOf(safety.worst_margin, aged, i18n),
  };
}

/** @param {Safety["alert_latency"]} it @param {(age: number | null) => number | null} aged
 * @param {I18n} i18n @returns {Tile} */
function latencyOf(it, aged, i18n) {
  const minutes = it.window_s / 60;
  if (!it.count) return { value: "—", of: i18n.t("tiles.no_answers", { minutes }) };
  const slots = { ...it, minutes, age: aged(it.age_s), fewest: FEWEST };
  const value = it.count < FEWEST ? "tiles.too_few" : "tiles.latency_value";
  return {
    value: i18n.t(value, slots),
    of: i18n.t("tiles.latency_of", slots),
  };
}

/** @param {Safety["not_echoed"]} it @param {(age: number | null) => number | null} aged
 * @param {I18n} i18n @returns {Tile} */
function echoOf(it, aged, i18n) {
  const minutes = it.window_s / 60;
  if (!it.of) return { value: "—", of: i18n.t("tiles.no_alerts", { minutes }) };
  const slots = { ...it, minutes, age: aged(it.age_s) };
  return {
    value: i18n.t("tiles.echo_value", slots),
    of: i18n.t("tiles.echo_of", slots),
  };
}

/** @param {Safety["negative_margin"]} it @param {(age: number | null) => number | null} aged
 * @param {I18n} i18n @returns {Tile} */
function negativeOf(it, aged, i18n) {
  if (it.share === null) return { value: "—", of: i18n.t("tiles.no_margins") };
  const slots = {
    share: it.share * 100,
    known: it.known_s / 60,
    unknown: it.unknown_s / 60,
    since: it.since,
    count: it.count,
    age: aged(it.age_s),
  };
  return {
    value: i18n.t("tiles.negative_value", slots),
    of: i18n.t("tiles.negative_of", slots),
  };
}

/** @param {Safety["worst_margin"]} it @param {(age: number | null) => number | null} aged
 * @param {I18n} i18n @returns {Tile} */
function worstOf(it, aged, i18n) {
  if (!it.margin) return { value: "—", of: i18n.t("tiles.no_margins") };
  const { margin_m, robot_id, person_id } = it.margin;
  const whose = { margin_m, robot: robot_id, person: person_id };
  const when = { at: it.at, since: it.since, count: it.count, age: aged(it.age_s) };
  return {
    value: i18n.t("tiles.worst_value", whose),
    of: i18n.t("tiles.worst_of", { ...whose, ...when }),
  };
}
