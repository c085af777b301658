/**
 * Times of a STOP on each transport, from the press on: pure arithmetic.
 *
 * @typedef {import("../types.js").Command} Order
 * @typedef {{median: number, worst: number}} Stat (ms)
 */

const LOUD = new Set(["UNCONFIRMED", "STILL_MOVING"]);

/**
 * The zero of an order's times: the press, or its acceptance where no press is known.
 *
 * @param {Order["times"]} times
 */
export function zeroOf({ pressed, requested }) {
  return pressed ?? requested;
}

/**
 * All in ms from the press on; null where nothing came.
 *
 * @param {Order} order
 * @param {readonly string[]} transports
 * @returns {{accepted: number | null, sent: (number | null)[],
 *   answer: (number | null)[], standing: number | null}} `sent` and `answer` in the
 *   order of the transports
 */
export function tookOf({ times, standstill_ms }, transports) {
  const zero = Date.parse(zeroOf(times));
  const since = (/** @type {string | undefined} */ at) =>
    at === undefined ? null : Date.parse(at) - zero;
  return {
    accepted: times.pressed ? since(times.requested) : null,
    sent: transports.map((id) => since(times.sent[id])),
    answer: transports.map((id) => since(times.answer[id])),
    standing: standstill_ms,
  };
}

/**
 * The outcome of an order, never the present state of its robot.
 *
 * @param {Order} order
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function endSaid({ state, reason, was_loud, ...told }, i18n) {
  const outcome = told.outcome ?? "open";
  const slots = { state: i18n.t(`history.state.${state}`), why: reason ?? "" };
  const said = i18n.t(`commandspage.end.${outcome}`, slots);
  const isLoudNow = outcome === "open" && LOUD.has(state);
  return was_loud && !isLoudNow ? `${said} ${i18n.t("commandspage.was_loud")}` : said;
}

/**
 * The STOPs among orders; release and resume are not measured against a press.
 *
 * @param {Order[]} orders
 * @param {readonly string[]} transports
 */
export function summaryOf(orders, transports) {
  const stops = orders.filter(({ kind }) => kind === "stop");
  const took = stops.map((order) => tookOf(order, transports));
  return {
    count: stops.length,
    unconfirmed: stops.filter(({ was_loud }) => was_loud).length,
    answer: transports.map((_, i) => statOf(took.map(({ answer }) => answer[i]))),
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
