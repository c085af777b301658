/**
 * Recorded moments as addresses, and the events among which they lie.
 *
 * @typedef {import("./protocol.js").Entry} Entry
 */

/** How long before an event it is shown (s). */
export const BEFORE_S = 10;
const EVENTS = new Set(["command", "alert", "speed"]);

/** The address of a moment. @param {number} atS Unix time */
export const pastAddress = (atS) =>
  `/?${new URLSearchParams({ t: new Date(1000 * atS).toISOString() })}`;

/** The moment that an address asks for (Unix s); null: now. @param {string} search */
export function askedMoment(search) {
  const asked = new URLSearchParams(search).get("t");
  const atMs = asked === null ? Number.NaN : Date.parse(asked);
  return Number.isNaN(atMs) ? null : atMs / 1000;
}

/**
 * The events of a log by time, and which is next.
 *
 * @param {readonly Pick<Entry, "at" | "kind">[]} entries any order
 * @param {number} atS Unix time
 * @param {1 | -1} way forwards or backwards
 * @returns {number | null} Unix time
 */
export function nextEvent(entries, atS, way) {
  const times = entries
    .filter(({ kind }) => EVENTS.has(kind))
    .map(({ at }) => Date.parse(at) / 1000)
    // The moment that is shown is up to a tick before the one that was asked for.
    .filter((at) => (way > 0 ? at > atS + 0.1 : at < atS - 0.1));
  if (!times.length) return null;
  return way > 0 ? Math.min(...times) : Math.max(...times);
}
