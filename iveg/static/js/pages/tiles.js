/**
 * Two figures of the fleet: how soon robots obey, and missing answers; each with its age
 * and its number of values.
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
 * @returns {Record<"latency" | "echo", Tile>}
 */
export function tilesOf(safety, waitedS, i18n) {
  const aged = (/** @type {number | null} */ age) =>
    age === null ? null : age + waitedS;
  return {
    latency: latencyOf(safety.alert_latency, aged, i18n),
    echo: echoOf(safety.not_echoed, aged, i18n),
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
