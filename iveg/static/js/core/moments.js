/**
 * Recorded moments as addresses, and the events among which they lie.
 *
 * @typedef {import("./protocol.js").Entry} Entry
 */

/** How long before an event it is shown (s). */
export const BEFORE_S = 10;
const DAY_MS = 86_400_000;
/** What `Date.parse` makes of other texts ("12": a day of 2001) nobody has meant. */
const DAY_FIRST = /^\d{4}-\d\d-\d\d/;
const EVENTS = new Set(["command", "alert", "speed"]);

/** The address of a moment. @param {number} atS Unix time */
export const pastAddress = (atS) =>
  `/?${new URLSearchParams({ t: new Date(1000 * atS).toISOString() })}`;

/**
 * The moment that an address asks for (Unix s); null: now, or none that can be shown.
 *
 * @param {string} search
 * @param {number} [nowMs] this device's clock, which may be wrong
 */
export function askedMoment(search, nowMs = Date.now()) {
  // An unescaped "+01:00" reaches us as " 01:00".
  const asked = new URLSearchParams(search).get("t")?.replace(" ", "+") ?? "";
  const atMs = DAY_FIRST.test(asked) ? Date.parse(asked) : Number.NaN;
  return Number.isNaN(atMs) || atMs > nowMs + DAY_MS ? null : atMs / 1000;
}

/** Whether an address asks for a moment that cannot be shown. @param {string} search */
export const isUnread = (search) =>
  new URLSearchParams(search).has("t") && askedMoment(search) === null;

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
