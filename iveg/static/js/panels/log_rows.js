/**
 * The rows of the log: a change of speed that lasts less than a second is no row of its
 * own, so that a robot at the edge of a zone does not fill the log with 50 % and 100 %.
 *
 * A slow-down that is over within a second is one row that says how long it lasted; one
 * that comes back within a second, for the same reason, goes on as the row that it was.
 *
 * @typedef {import("../core/protocol.js").Entry} Entry
 * @typedef {{entry: Entry, lastedS: number | null}} Row `lastedS`: from the slow-down
 *   until its end, where that is told here and not by a row of its own (s)
 */

const SHORT_S = 1;

/** @param {readonly Entry[]} entries oldest first @returns {Row[]} */
export function rowsOf(entries) {
  /** @type {Row[]} */
  const rows = [];
  /** @type {Map<string, Turn>} by robot */
  const turns = new Map();
  for (const entry of entries) {
    const turn = entry.kind === "speed" ? turns.get(entry.robot_id ?? "") : undefined;
    if (turn && isShort(turn.last, entry) && joins(turn, entry, rows)) continue;
    const row = { entry, lastedS: null };
    rows.push(row);
    if (entry.kind === "speed") turns.set(entry.robot_id ?? "", turnOf(row, turn));
  }
  return rows;
}

/**
 * A robot's newest slow-down, its newest change of speed, and the row of that.
 *
 * @typedef {{down: Row | null, last: Entry, row: Row}} Turn
 */

/** @param {Row} row @param {Turn | undefined} before @returns {Turn} */
function turnOf(row, before) {
  const down = isDown(row.entry) ? row : (before?.down ?? null);
  return { down, last: row.entry, row };
}

/**
 * Whether a change of speed is told by the row of the one before.
 *
 * @param {Turn} turn @param {Entry} entry less than a second after it
 * @param {Row[]} rows from which a row that was short is taken
 */
function joins(turn, entry, rows) {
  const { down, last, row } = turn;
  if (!down) return false;
  if (!isDown(entry) && isDown(last)) down.lastedS = secondsBetween(down.entry, entry);
  else if (isDown(entry) && !isDown(last) && causeOf(entry) === causeOf(down.entry)) {
    down.lastedS = null;
    if (row !== down) rows.splice(rows.indexOf(row), 1);
    turn.row = down;
  } else return false;
  turn.last = entry;
  return true;
}

/** @param {Entry} entry */
const isDown = ({ key }) => key.startsWith("log.speed_down");

/** @param {Entry} entry */
const causeOf = ({ key, slots }) => JSON.stringify([key, slots.factor, slots.cause]);

/** @param {Entry} before @param {Entry} after */
const secondsBetween = (before, after) =>
  (Date.parse(after.at) - Date.parse(before.at)) / 1000;

/** @param {Entry} before @param {Entry} after */
const isShort = (before, after) => secondsBetween(before, after) < SHORT_S;
