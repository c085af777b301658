/**
 * The newest STOP of each robot, and whether a resume followed it.
 *
 * A command comes by its own topic and within its robot's state; the newer one counts.
 *
 * @typedef {import("../core/protocol.js").Command} Command
 * @typedef {import("../core/protocol.js").Robot} Robot
 */

/** A robot's state may be a frame older than its command's own topic (ms). */
const SETTLE_MS = 800;

export class NewestStops {
  /** @type {Map<string, {command: Command, heardMs: number}>} by robot */
  #stops = new Map();
  /** @type {Map<string, string>} kind of the newest release or resume by robot */
  #kinds = new Map();

  clear() {
    this.#stops.clear();
    this.#kinds.clear();
  }

  /** @param {Command} command @returns {boolean} whether it is the newest STOP now */
  take(command) {
    const { robot_id, kind, state } = command;
    if (kind !== "stop") this.#kinds.set(robot_id, kind);
    const known = this.commandOf(robot_id);
    if (kind !== "stop" || (known && isOlder(command, known))) return false;
    if (state === "RUNNING") this.#stops.delete(robot_id);
    else this.#stops.set(robot_id, { command, heardMs: performance.now() });
    return true;
  }

  /** A robot's state without a STOP ends the known one, unless that is newer.
   * @param {string} robotId */
  forget(robotId) {
    if (performance.now() - this.heardMs(robotId) > SETTLE_MS)
      this.#stops.delete(robotId);
  }

  /** @param {string} robotId */
  commandOf(robotId) {
    return this.#stops.get(robotId)?.command;
  }

  /** When the robot's STOP was heard last (ms). @param {string} robotId */
  heardMs(robotId) {
    return this.#stops.get(robotId)?.heardMs ?? Number.NEGATIVE_INFINITY;
  }

  /** Whether the order under way is a resume, and no release. @param {string} robotId */
  isResuming(robotId) {
    return this.#kinds.get(robotId) === "resume";
  }
}

/**
 * Whether a command belongs to an earlier episode than the known one.  Times of one
 * server in one format compare as text; within an episode the last to arrive is newest.
 *
 * @param {Command} command
 * @param {Command} known
 */
function isOlder(command, known) {
  if (command.command_id === known.command_id) return false;
  const a = command.times.requested ?? "";
  const b = known.times.requested ?? "";
  return a < b;
}
