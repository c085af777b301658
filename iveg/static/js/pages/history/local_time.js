/**
 * Times on the greenhouse's clock: Europe/Madrid on screen, UTC in data.
 */

const ZONE = "Europe/Madrid";
const HOUR_MS = 3_600_000;
const PARTS = new Intl.DateTimeFormat("en-GB", {
  timeZone: ZONE,
  hourCycle: "h23",
  year: "numeric",
  month: "2-digit",
  day: "2-digit",
  hour: "2-digit",
  minute: "2-digit",
  second: "2-digit",
});
/** @type {Map<number, number>} hour since 1970 → offset (ms) */
const offsets = new Map();

/**
 * How far the wall clock is ahead of UTC (ms).
 *
 * @param {number} at Unix milliseconds
 */
export function offsetAt(at) {
  // Clocks change on a full hour of UTC, so one answer holds for the hour.
  const hour = Math.floor(at / HOUR_MS);
  let offset = offsets.get(hour);
  if (offset === undefined) {
    const part = Object.fromEntries(
      PARTS.formatToParts(hour * HOUR_MS).map(({ type, value }) => [type, value]),
    );
    const wall = `${part.year}-${part.month}-${part.day}T${part.hour}:${part.minute}:${part.second}Z`;
    offset = Date.parse(wall) - hour * HOUR_MS;
    offsets.set(hour, offset);
  }
  return offset;
}

/**
 * The wall clock's text, as Plotly reads it: no zone in it.
 *
 * @param {number} at Unix milliseconds
 * @returns {string} `2026-11-20T09:00:00.000`
 */
export function wallText(at) {
  return new Date(at + offsetAt(at)).toISOString().slice(0, 23);
}

/** The same as people type it: `2026-11-20 09:00:00`. @param {number} at Unix ms */
export function typedText(at) {
  return wallText(at).slice(0, 19).replace("T", " ");
}

/**
 * The moment that a wall clock's text names; the hour that a change to winter time
 * repeats is taken as its first round, the one that a change skips as the hour after.
 *
 * @param {string} text as people type it: `2026-11-20 09:00`, seconds at will
 * @returns {number} Unix milliseconds; NaN where the text is none
 */
export function momentOf(text) {
  const wall = Date.parse(`${text.trim().replace(/\s+/, "T")}Z`);
  if (Number.isNaN(wall)) return Number.NaN;
  // Three hours back lies before any change that could make this text ambiguous.
  const before = wall - offsetAt(wall - 3 * HOUR_MS);
  const after = wall - offsetAt(before);
  const isSkipped = after + offsetAt(after) !== wall;
  return isSkipped ? before : after;
}

/**
 * Date and time for people: day before month, 24 hours, as both languages have it here.
 *
 * @param {string | number | null} at ISO-8601 or Unix milliseconds
 * @param {{withYear?: boolean}} [how]
 */
export function dayAndTime(at, { withYear = false } = {}) {
  if (at === null) return "—";
  const [day, time] = wallText(new Date(at).getTime()).split("T");
  const [year, month, date] = day.split("-");
  const shown = withYear ? `${date}/${month}/${year}` : `${date}/${month}`;
  return `${shown} ${time.slice(0, 8)}`;
}

/**
 * Time of day to the millisecond, for evidence.
 *
 * @param {string | number} at ISO-8601 or Unix milliseconds
 * @returns {string} `13:04:11.123`
 */
export function millisecondsOf(at) {
  return wallText(new Date(at).getTime()).slice(11);
}
