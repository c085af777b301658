/**
 * What a STOP took on each road, from the press on: pure arithmetic on its times.
 *
 * @typedef {{command_id: string, robot_id: string, kind: string, state: string,
 *   requested_by: string, tries: number, drill?: boolean, standstill_ms: number | null,
 *   times: {requested: string, sent_fiware: string | null, sent_direct: string | null,
 *     answer_fiware: string | null, answer_direct: string | null,
 *     standing: string | null}}} Order
 * @typedef {{median: number, worst: number}} Stat (ms)
 */

const LOUD = new Set(["UNCONFIRMED", "STILL_MOVING"]);

/**
 * @param {Order} order
 * @returns {Record<"sentDirect" | "direct" | "sentFiware" | "fiware" | "standing",
 *   number | null>} (ms) since it was asked for; null where nothing came
 */
export function tookOf({ times, standstill_ms }) {
  const since = (/** @type {string | null} */ at) =>
    at === null ? null : Date.parse(at) - Date.parse(times.requested);
  return {
    sentDirect: since(times.sent_direct),
    direct: since(times.answer_direct),
    sentFiware: since(times.sent_fiware),
    fiware: since(times.answer_fiware),
    standing: standstill_ms,
  };
}

/**
 * The STOPs among orders; release and resume are not measured against a press.
 *
 * @param {Order[]} orders
 */
export function summaryOf(orders) {
  const stops = orders.filter(({ kind }) => kind === "stop");
  const took = stops.map(tookOf);
  return {
    count: stops.length,
    unconfirmed: stops.filter(({ state }) => LOUD.has(state)).length,
    direct: statOf(took.map(({ direct }) => direct)),
    fiware: statOf(took.map(({ fiware }) => fiware)),
    standing: statOf(took.map(({ standing }) => standing)),
  };
}

/**
 * Median and worst; of an even count the upper of the two in the middle, so that the
 * number is one that was measured.
 *
 * @param {(number | null)[]} values
 * @returns {Stat | null}
 */
export function statOf(values) {
  const known = values.filter((value) => value !== null).sort((a, b) => a - b);
  if (!known.length) return null;
  return { median: known[known.length >> 1], worst: known[known.length - 1] };
}
