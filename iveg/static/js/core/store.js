/**
 * The newest value of every live topic, as the browser knows it, and its subscribers.
 *
 * A snapshot replaces everything; after it the newest value of each topic wins, so memory
 * is bounded by the fleet and not by time.  Subscribers hear of a topic at most once per
 * animation frame, of telemetry with the page's beat; `log` and `commands/{id}` are
 * delivered one by one, because each of them is a fact and not a state, and `snapshot`
 * before all that follows it.
 *
 * A snapshot is delivered as `snapshot` first and every topic in it after that, except
 * the entries of the log: a panel that shows the log rebuilds it from `log()` then.
 *
 * @typedef {import("./protocol.js").Robot} Robot
 * @typedef {import("./protocol.js").Person} Person
 * @typedef {import("./protocol.js").Scan} Scan
 * @typedef {import("./protocol.js").DetectionFrame} DetectionFrame
 * @typedef {import("./protocol.js").Entry} Entry
 * @typedef {import("./protocol.js").Snapshot} Snapshot
 * @typedef {import("./protocol.js").GreenhouseMap} GreenhouseMap
 * @typedef {"connecting" | "open" | "lost" | "signed-out"} ConnectionState
 * @typedef {{state: ConnectionState, since: number}} Connection `since` (ms,
 *   `performance.now()`)
 * @typedef {import("./hub.js").Listener} Listener
 */

import { onBeat } from "./beat.js";
import { changed, isOlder, moved, received, topicsOf } from "./changes.js";
import { createHub, onNextFrame } from "./hub.js";

/** Entries of the log that a browser keeps. */
export const LOG_SIZE = 500;

/** Commands that a browser keeps, closed ones among them. */
export const COMMANDS_SIZE = 200;

/** What the newest snapshot and the messages since then have brought. */
class Known {
  /** @type {Map<string, any>} newest value by topic */
  values = new Map();
  /** @type {Map<string, Robot>} */
  robots = new Map();
  /** @type {Map<string, Person>} */
  people = new Map();
  /** @type {Map<string, Scan>} */
  scans = new Map();
  /** @type {Map<string, DetectionFrame>} */
  detections = new Map();
  /** @type {Set<string>} topics of commands, least recently heard first */
  commands = new Set();
  /** @type {Entry[]} oldest first */
  log = [];
}

export class Store {
  #now;
  #hub;
  #known = new Known();
  /** @type {Connection} */
  #connection;

  /**
   * @param {{now?: () => number, schedule?: (flush: () => void) => void}} [options]
   *   `now` (ms) and the next animation frame; tests pass their own
   */
  constructor({ now = () => performance.now(), schedule } = {}) {
    this.#now = now;
    this.#hub = createHub(schedule ?? onNextFrame, schedule ?? onBeat);
    this.#connection = { state: "connecting", since: now() };
  }

  /**
   * Applies one message.  `robots/{id}/move` and `robots/{id}/state` carry a part of a
   * robot, `people/{id}` a person that has changed and `people/ids` all that there are;
   * robots and people are kept and delivered whole.
   *
   * @param {string} topic
   * @param {any} data
   * @param {number} [receivedAtMs] `performance.now()` when it arrived
   */
  apply(topic, data, receivedAtMs = this.#now()) {
    const [head, id, leaf] = topic.split("/");
    if (topic === "snapshot") this.#applySnapshot(data, receivedAtMs);
    else if (head === "people" && id)
      this.#changePeople(id, received(data, receivedAtMs));
    else if (leaf === "move") this.#changeRobot(id, moved, data, receivedAtMs);
    else if (leaf === "state") this.#changeRobot(id, changed, data, receivedAtMs);
    else if (this.#keep(topic, received(data, receivedAtMs)))
      this.#hub.tell(topic, data);
  }

  /** The newest value of a topic. @param {string} topic @returns {any} */
  get(topic) {
    return this.#known.values.get(topic);
  }

  /**
   * Calls `fn(data, topic)` for a topic, or for every topic one level below a prefix:
   * `people`, `robots/AGI`, `robots/` (each robot, not its scan), `robots/+/scan`.
   *
   * @param {string} pattern
   * @param {Listener} fn
   * @returns {() => void} ends the subscription
   */
  subscribe(pattern, fn) {
    return this.#hub.subscribe(pattern, fn);
  }

  /**
   * Calls `fn` for every message at once, before the next frame: the map asks for its
   * frame the moment a message comes.
   *
   * @param {Listener} fn
   * @returns {() => void}
   */
  watch(fn) {
    return this.#hub.watch(fn);
  }

  /** @returns {ReadonlyMap<string, Robot>} in the server's order */
  robots() {
    return this.#known.robots;
  }

  /** @returns {ReadonlyMap<string, Scan>} newest sweep per robot */
  scans() {
    return this.#known.scans;
  }

  /** @returns {ReadonlyMap<string, DetectionFrame>} newest per robot */
  detections() {
    return this.#known.detections;
  }

  /** @returns {Person[]} */
  people() {
    return this.get("people") ?? [];
  }

  /** @returns {GreenhouseMap | null} */
  map() {
    return this.get("map") ?? null;
  }

  /** @returns {readonly Entry[]} oldest first, at most LOG_SIZE */
  log() {
    return this.#known.log;
  }

  /** @returns {Connection} */
  get connection() {
    return this.#connection;
  }

  /**
   * Set by the socket; delivered under the topic `connection`.
   *
   * @param {ConnectionState} state
   * @param {number} [sinceMs]
   */
  setConnection(state, sinceMs = this.#now()) {
    if (state === this.#connection.state) return;
    this.#connection = { state, since: sinceMs };
    this.#hub.tell("connection", this.#connection);
  }

  /** @param {Snapshot} snapshot @param {number} atMs */
  #applySnapshot(snapshot, atMs) {
    this.#known = new Known();
    this.#known.log = (snapshot.log ?? []).slice(-LOG_SIZE);
    this.#known.values.set("snapshot", snapshot);
    const brought = topicsOf(snapshot);
    for (const [topic, data] of brought) this.#keep(topic, received(data, atMs));
    // Delivered only when all of it is here, so nobody sees half of a snapshot.
    this.#hub.tell("snapshot", snapshot);
    for (const [topic, data] of brought) this.#hub.tell(topic, data);
  }

  /**
   * Keeps one value; false when it is older than what is known.
   *
   * @param {string} topic
   * @param {any} data
   */
  #keep(topic, data) {
    const { values, scans, detections } = this.#known;
    const [head, id, leaf] = topic.split("/");
    if (topic === "log") return this.#keepEntry(data);
    if (head === "robots" && !leaf) return this.#keepRobot(data);
    if (head === "robots") scans.set(id, data);
    else if (head === "detections") detections.set(id, data);
    else if (head === "commands") this.#keepCommand(topic);
    else if (topic === "people") this.#keepPeople(data);
    values.set(topic, data);
    return true;
  }

  /** @param {Robot} robot */
  #keepRobot(robot) {
    const known = this.#known.robots.get(robot.robot_id);
    if (known && isOlder(robot, known)) return false;
    this.#setRobot(robot.robot_id, robot);
    return true;
  }

  /**
   * Keeps what has changed of a robot, and delivers the whole robot.
   *
   * @param {string} id
   * @param {typeof moved | typeof changed} change
   * @param {any} data
   * @param {number} atMs
   */
  #changeRobot(id, change, data, atMs) {
    const known = this.#known.robots.get(id);
    if (!known) return;
    const robot = change(known, data, atMs);
    this.#setRobot(id, robot);
    this.#hub.tell(`robots/${id}`, robot);
  }

  /** @param {string} id @param {Robot} robot */
  #setRobot(id, robot) {
    this.#known.robots.set(id, robot);
    this.#known.values.set(`robots/${id}`, robot);
  }

  /** @param {Person[]} all */
  #keepPeople(all) {
    this.#known.people = new Map(all.map((person) => [person.person_id, person]));
  }

  /**
   * Keeps a person that has changed until `ids` names all that there are; a person that
   * has not changed grows older.
   *
   * @param {string} id
   * @param {any} data
   */
  #changePeople(id, data) {
    const { people, values } = this.#known;
    if (id !== "ids") return void people.set(id, data);
    const present = data.flatMap((/** @type {string} */ one) => people.get(one) ?? []);
    this.#keepPeople(present);
    values.set("people", present);
    this.#hub.tell("people", present);
  }

  /** @param {Entry} entry */
  #keepEntry(entry) {
    const { log } = this.#known;
    if (log.length && entry.id <= log[log.length - 1].id) return false;
    log.push(entry);
    if (log.length > LOG_SIZE) log.splice(0, log.length - LOG_SIZE);
    return true;
  }

  /** Makes room: months of commands cost no more than the last ones.
   * @param {string} topic */
  #keepCommand(topic) {
    const { commands, values } = this.#known;
    commands.delete(topic);
    commands.add(topic);
    const [oldest] = commands;
    if (commands.size <= COMMANDS_SIZE) return;
    commands.delete(oldest);
    values.delete(oldest);
  }
}
