/**
 * How a message changes a value that the store knows, as pure functions.
 *
 * @typedef {import("./protocol.js").Robot} Robot
 * @typedef {import("./protocol.js").Snapshot} Snapshot
 */

/**
 * Writes the time of arrival on a value, and on each value of a list.
 *
 * @template T
 * @param {T} data
 * @param {number} atMs
 * @returns {T}
 */
export function received(data, atMs) {
  const values = Array.isArray(data) ? data : [data];
  for (const value of values) {
    if (value && typeof value === "object") value.receivedAtMs = atMs;
  }
  return data;
}

/**
 * Whether the server received a robot's state before the one that is known.  Times of
 * one server in one format compare as text.
 *
 * @param {Robot} robot
 * @param {Robot} known
 */
export function isOlder(robot, known) {
  if (!robot.received_at || !known.received_at) return false;
  return robot.received_at < known.received_at;
}

/**
 * A robot that has moved.  Ages within its state count from the arrival of that state, so
 * the age of the pose, which is younger, is written as of then, too.
 *
 * @param {Robot} known
 * @param {Robot} move `age_s`, `pose`, `twist`, `stamp`
 * @param {number} atMs
 * @returns {Robot}
 */
export function moved(known, move, atMs) {
  const age_s =
    typeof move.age_s === "number" ? move.age_s - sinceS(known, atMs) : null;
  return { ...known, ...move, age_s };
}

/**
 * A robot of which something else has changed; its pose grows older meanwhile.
 *
 * @param {Robot} known
 * @param {Partial<Robot>} changes
 * @param {number} atMs
 * @returns {Robot}
 */
export function changed(known, changes, atMs) {
  const age_s =
    typeof known.age_s === "number" ? known.age_s + sinceS(known, atMs) : null;
  return { ...known, ...changes, age_s, receivedAtMs: atMs };
}

/** @param {Robot} known @param {number} atMs */
const sinceS = (known, atMs) => (atMs - (known.receivedAtMs ?? atMs)) / 1000;

/**
 * The messages that would have brought the same as a snapshot.
 *
 * @param {Snapshot} snapshot
 * @returns {[string, unknown][]}
 */
export function topicsOf(snapshot) {
  return [
    ["map", snapshot.map],
    ...(snapshot.robots ?? []).map(under("robots", "robot_id")),
    ["people", snapshot.people ?? []],
    ...Object.entries(snapshot.detections ?? {}).map(
      ([id, frame]) => /** @type {[string, unknown]} */ ([`detections/${id}`, frame]),
    ),
    ...(snapshot.commands ?? []).map(under("commands", "command_id")),
    ["alerts", snapshot.alerts ?? []],
    ["rule", snapshot.rule],
    ["health", snapshot.health],
    ["climate", snapshot.climate],
    ["equipment", snapshot.equipment ?? []],
  ];
}

/**
 * @param {string} head
 * @param {string} key
 * @returns {(value: any) => [string, unknown]}
 */
function under(head, key) {
  return (value) => [`${head}/${value[key]}`, value];
}
