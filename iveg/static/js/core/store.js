/**
 * What the browser knows: the newest value of every live topic, and who wants to hear.
 *
 * A snapshot replaces everything; after it the newest wins per topic, so memory is
 * bounded by the fleet and not by time.  Panels hear of a topic at most once per
 * animation frame, of telemetry with the page's beat; `log` and `commands/{id}` are told one by one, because each of them
 * is a fact and not a state.
 *
 * On a snapshot `snapshot` is told first and every topic it brought after it, except the
 * log's entries: who shows the log rebuilds it from `log()` when `snapshot` is told.
 *
 * @typedef {import("./protocol.js").Robot} Robot
 * @typedef {import("./protocol.js").Person} Person
 * @typedef {import("./protocol.js").Scan} Scan
 * @typedef {import("./protocol.js").Look} Look
 * @typedef {import("./protocol.js").Entry} Entry
 * @typedef {import("./protocol.js").Snapshot} Snapshot
 * @typedef {import("./protocol.js").GreenhouseMap} GreenhouseMap
 * @typedef {"connecting" | "open" | "lost" | "signed-out"} ConnectionState
 * @typedef {{state: ConnectionState, since: number}} Connection `since` (ms,
 *   `performance.now()`)
 * @typedef {import("./hub.js").Listener} Listener
 * @typedef {ReturnType<typeof createStore>} Store
 */

import { onBeat } from "./beat.js";
import { createHub, onNextFrame } from "./hub.js";

/** Entries of the log that a browser keeps. */
export const LOG_SIZE = 500;

/** Commands that a browser keeps, closed ones among them. */
export const COMMANDS_SIZE = 200;

/** Hues that the design has for robots (`--robot-1` … `--robot-8`). */
const ROBOT_HUES = 8;

/**
 * @param {{now?: () => number, schedule?: (flush: () => void) => void}} [options]
 *   `now` (ms) and the next animation frame; tests hand in their own
 */
export function createStore(options = {}) {
  const { now = () => performance.now(), schedule } = options;
  const hub = createHub(schedule ?? onNextFrame, schedule ?? onBeat);
  /** @type {Map<string, any>} */
  let values = new Map();
  /** @type {Map<string, Robot>} */
  let robots = new Map();
  /** @type {Map<string, Person>} */
  let people = new Map();
  /** @type {Map<string, Scan>} */
  let scans = new Map();
  /** @type {Map<string, Look>} */
  let looks = new Map();
  /** @type {Set<string>} topics, least recently heard first */
  let commands = new Set();
  /** @type {Entry[]} */
  let log = [];
  /** @type {Map<string, number>} */
  const slots = new Map();
  /** @type {Connection} */
  let connection = { state: "connecting", since: now() };

  /** @param {Robot} robot */
  function keepRobot(robot) {
    const known = robots.get(robot.robot_id);
    if (known && isOlder(robot, known)) return false;
    robots.set(robot.robot_id, robot);
    values.set(`robots/${robot.robot_id}`, robot);
    slotOf(robot.robot_id);
    return true;
  }

  /**
   * Keeps what has changed of a robot, and tells of all of it.
   *
   * @param {string} id
   * @param {(known: Robot) => Robot} change
   */
  function changeRobot(id, change) {
    const known = robots.get(id);
    if (!known) return;
    const robot = change(known);
    robots.set(id, robot);
    values.set(`robots/${id}`, robot);
    hub.tell(`robots/${id}`, robot);
  }

  /** @param {Person[]} all */
  function keepPeople(all) {
    people = new Map(all.map((person) => [person.person_id, person]));
  }

  /** @param {Entry} entry */
  function keepEntry(entry) {
    if (log.length && entry.id <= log[log.length - 1].id) return false;
    log.push(entry);
    if (log.length > LOG_SIZE) log.splice(0, log.length - LOG_SIZE);
    return true;
  }

  /** Lines of before the server's restart. @param {Entry[]} entries oldest first */
  function keepEarlier(entries) {
    const first = log.length ? log[0].id : Infinity;
    const before = entries.filter(({ id }) => id < first);
    log = [...before, ...log].slice(-LOG_SIZE);
    return before.length > 0;
  }

  /** Makes room, so that months of commands cost no more than the last ones. */
  function keepCommand(/** @type {string} */ topic) {
    commands.delete(topic);
    commands.add(topic);
    const [oldest] = commands;
    if (commands.size <= COMMANDS_SIZE) return;
    commands.delete(oldest);
    values.delete(oldest);
  }

  /**
   * Keeps who has changed until it is told who there is; who has not grows older.
   *
   * @param {string} id
   * @param {any} data
   */
  function changePeople(id, data) {
    if (id !== "ids") return void people.set(id, data);
    const known = people;
    people = new Map();
    for (const one of data) {
      const person = known.get(one);
      if (person) people.set(one, person);
    }
    values.set("people", [...people.values()]);
    hub.tell("people", values.get("people"));
  }

  /**
   * Keeps one value; false when it is older than what is known.
   *
   * @param {string} topic
   * @param {any} data
   */
  function keep(topic, data) {
    const [head, id, leaf] = topic.split("/");
    if (topic === "log") return keepEntry(data);
    if (topic === "log/earlier") return keepEarlier(data);
    if (head === "commands") keepCommand(topic);
    if (head === "robots" && !leaf) return keepRobot(data);
    if (head === "robots") scans.set(id, data);
    else if (head === "detections") looks.set(id, data);
    else if (topic === "people") keepPeople(data);
    values.set(topic, data);
    return true;
  }

  /**
   * @param {Snapshot} snapshot
   * @param {number} atMs
   */
  function applySnapshot(snapshot, atMs) {
    values = new Map();
    robots = new Map();
    people = new Map();
    scans = new Map();
    looks = new Map();
    commands = new Set();
    log = (snapshot.log ?? []).slice(-LOG_SIZE);
    values.set("snapshot", snapshot);
    const brought = topicsOf(snapshot);
    for (const [topic, data] of brought) keep(topic, received(data, atMs));
    // Told only when all of it is here, so nobody sees half of a snapshot.
    hub.tell("snapshot", snapshot);
    for (const [topic, data] of brought) hub.tell(topic, data);
  }

  /** @param {string} robotId @returns {number} */
  function slotOf(robotId) {
    const slot = slots.get(robotId) ?? slots.size;
    slots.set(robotId, slot);
    return (slot % ROBOT_HUES) + 1;
  }

  return {
    /**
     * Takes one message in.  `robots/{id}/move` and `robots/{id}/state` tell a part of a
     * robot, `people/{id}` and then `people/ids` who has changed and who there is; they
     * are kept and told whole.
     *
     * @param {string} topic
     * @param {any} data
     * @param {number} [receivedAtMs] `performance.now()` when it arrived
     */
    apply(topic, data, receivedAtMs = now()) {
      const [, id, leaf] = topic.split("/");
      if (topic === "snapshot") applySnapshot(data, receivedAtMs);
      else if (topic.startsWith("people/"))
        changePeople(id, received(data, receivedAtMs));
      else if (leaf === "move") changeRobot(id, moved(data, receivedAtMs));
      else if (leaf === "state") changeRobot(id, changed(data, receivedAtMs));
      else if (keep(topic, received(data, receivedAtMs))) hub.tell(topic, data);
    },
    /** The newest value of a topic. @param {string} topic @returns {any} */
    get: (topic) => values.get(topic),
    /**
     * Calls `fn(data, topic)` for a topic, or for every topic one level below a prefix:
     * `people`, `robots/AGI`, `robots/` (each robot, not its scan), `robots/+/scan`.
     *
     * @param {string} pattern
     * @param {Listener} fn
     * @returns {() => void} ends the subscription
     */
    subscribe: (pattern, fn) => hub.subscribe(pattern, fn),
    /**
     * Calls `fn` for every message at once, before the next frame: for the map, that
     * must ask for its frame the moment a message comes.
     *
     * @param {Listener} fn
     * @returns {() => void}
     */
    watch: (fn) => hub.watch(fn),
    /** @returns {ReadonlyMap<string, Robot>} in the server's order */
    robots: () => robots,
    /** @returns {ReadonlyMap<string, Scan>} newest sweep per robot */
    scans: () => scans,
    /** @returns {ReadonlyMap<string, Look>} newest look per robot */
    looks: () => looks,
    /** @returns {Person[]} */
    people: () => values.get("people") ?? [],
    /** @returns {GreenhouseMap | null} */
    map: () => values.get("map") ?? null,
    /** @returns {readonly Entry[]} oldest first, at most LOG_SIZE */
    log: () => log,
    /** Which `--robot-n` is a robot's own (1–8), the same on map and cards. */
    slotOf,
    /** @returns {Connection} */
    get connection() {
      return connection;
    },
    /**
     * Told by the socket; heard under the topic `connection`.
     *
     * @param {ConnectionState} state
     * @param {number} [sinceMs]
     */
    setConnection(state, sinceMs = now()) {
      if (state === connection.state) return;
      connection = { state, since: sinceMs };
      hub.tell("connection", connection);
    },
  };
}

/**
 * Notes on a value, and on each value of a list, when it arrived.
 *
 * @template T
 * @param {T} data
 * @param {number} atMs
 * @returns {T}
 */
function received(data, atMs) {
  const values = Array.isArray(data) ? data : [data];
  for (const value of values) {
    if (value && typeof value === "object") value.receivedAtMs = atMs;
  }
  return data;
}

/**
 * Whether a robot's state was taken in before the one that is known.  Times of one
 * server in one format compare as text.
 *
 * @param {Robot} robot
 * @param {Robot} known
 */
function isOlder(robot, known) {
  if (!robot.received_at || !known.received_at) return false;
  return robot.received_at < known.received_at;
}

/**
 * A robot that has moved.  Ages within its state count from when that was told, so the
 * age of the pose, which is younger, is written as of then, too.
 *
 * @param {Robot} move `age_s`, `pose`, `twist`, `stamp`
 * @param {number} atMs
 * @returns {(known: Robot) => Robot}
 */
function moved(move, atMs) {
  return (known) => {
    const sinceS = (atMs - (known.receivedAtMs ?? atMs)) / 1000;
    const age_s = typeof move.age_s === "number" ? move.age_s - sinceS : null;
    return { ...known, ...move, age_s };
  };
}

/**
 * A robot of which something else has changed; its pose grows older meanwhile.
 *
 * @param {Partial<Robot>} changes
 * @param {number} atMs
 * @returns {(known: Robot) => Robot}
 */
function changed(changes, atMs) {
  return (known) => {
    const sinceS = (atMs - (known.receivedAtMs ?? atMs)) / 1000;
    const age_s = typeof known.age_s === "number" ? known.age_s + sinceS : null;
    return { ...known, ...changes, age_s, receivedAtMs: atMs };
  };
}

/**
 * A snapshot, as the messages that would have brought the same.
 *
 * @param {Snapshot} snapshot
 * @returns {[string, unknown][]}
 */
function topicsOf(snapshot) {
  return [
    ["map", snapshot.map],
    ...(snapshot.robots ?? []).map(under("robots", "robot_id")),
    ["people", snapshot.people ?? []],
    ...Object.entries(snapshot.detections ?? {}).map(
      ([id, look]) => /** @type {[string, unknown]} */ ([`detections/${id}`, look]),
    ),
    ...(snapshot.commands ?? []).map(under("commands", "command_id")),
    ["alerts", snapshot.alerts ?? []],
    ["flood", snapshot.flood ?? null],
    ["rule", snapshot.rule],
    ["health", snapshot.health],
    ["climate", snapshot.climate],
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
