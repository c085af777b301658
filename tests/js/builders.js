/**
 * Live messages with defaults; a test overrides what matters to it.
 *
 * @typedef {import("../../iveg/static/js/core/protocol.js").Robot} Robot
 * @typedef {import("../../iveg/static/js/core/situation.js").Situation} Situation
 * @typedef {import("../../iveg/static/js/core/protocol.js").Person} Person
 * @typedef {import("../../iveg/static/js/core/protocol.js").Detection} Detection
 * @typedef {import("../../iveg/static/js/core/protocol.js").Command} Command
 * @typedef {import("../../iveg/static/js/core/protocol.js").Entry} Entry
 * @typedef {import("../../iveg/static/js/core/protocol.js").GreenhouseMap} GreenhouseMap
 * @typedef {import("../../iveg/static/js/core/protocol.js").Snapshot} Snapshot
 */

import { SENSORS } from "../../iveg/static/js/core/sensors.js";

/** @typedef {typeof SENSORS[number]["name"]} SensorName */

const NO_READINGS = /** @type {Record<SensorName, null>} */ (
  Object.fromEntries(SENSORS.map(({ name }) => [name, null]))
);

export const STAMP = "2026-11-20T09:00:00.000Z";

const CLEAR = {
  speed_factor: 1,
  reason: "clear",
  cause: null,
  distance_m: null,
  decision_id: null,
  foretold_s: null,
};

/** At work, all clear. @param {Partial<Situation>} [changes] @returns {Situation} */
export const situation = (changes = {}) => ({
  level: "working",
  kind: "working",
  state: "clear",
  cause: "clear",
  why: null,
  about: null,
  action: "none",
  factor: 1,
  slots: {},
  ...changes,
});

/** @param {Partial<Robot>} [changes] @returns {Robot} */
export function robot(changes = {}) {
  return {
    robot_id: "AGI",
    link: "LIVE",
    situation: situation(),
    refused: false,
    mode: "RUNNING",
    pose: { x: 1, y: 2, yaw: 0 },
    lane: null,
    twist: { linear: 0.5, angular: 0 },
    stamp: STAMP,
    received_at: STAMP,
    age_s: 0.1,
    age_estimated: false,
    speed_factor: 1,
    applied: null,
    speed_limit: CLEAR,
    encounters: [],
    missing: [],
    detector: {
      required: true,
      missing: false,
      out_by: null,
      out_since: null,
      out_reason: null,
    },
    holds: [],
    stop: null,
    stop_state: "RUNNING",
    navigation: null,
    goal: null,
    ...{
      pressed_at: null,
      requested_at: "2026-01-01T00:00:00.000Z",
      standing_at: null,
    },
    ...{ sent_fiware_at: null, sent_direct_at: null },
    ...{ answer_fiware_at: null, answer_direct_at: null },
    replay: false,
    clock_offset_s: 0,
    transport: "direct",
    margin: null,
    ...NO_READINGS,
    profile: {
      drive: "differential",
      length: 1,
      width: 0.6,
      max_speed: 1,
      turning_radius: 0,
    },
    cmd_status: null,
    ...changes,
  };
}

/** @param {Partial<Person>} [changes] @returns {Person} */
export function person(changes = {}) {
  return {
    person_id: "p1",
    class: "person",
    class_id: "farmer",
    stage: "seen",
    position: { x: 4, y: 2, z: 0.9 },
    radius_m: 2,
    confidence: 0.94,
    first_seen: STAMP,
    last_seen: STAMP,
    age_s: 0.1,
    observers: ["AGI"],
    decision_id: "d1",
    lane: null,
    acting: [],
    possible: false,
    evidence: null,
    thing_id: null,
    doubtful: false,
    ...changes,
  };
}

/** @param {Partial<Detection>} [changes] @returns {Detection} */
export function detection(changes = {}) {
  return {
    robot_id: "AGI",
    stamp: STAMP,
    class: "person",
    class_id: "farmer",
    probability: 0.94,
    position: { x: 4, y: 2, z: 0.9 },
    box: {
      xmin: 3.8,
      xmax: 4.2,
      ymin: 1.7,
      ymax: 2.3,
      zmin: 0,
      zmax: 1.8,
      frame_id: "map",
    },
    confident: true,
    person_id: "p1",
    peer: null,
    transport: "direct",
    ...changes,
  };
}

/** @param {Partial<Command>} [changes] @returns {Command} */
export function command(changes = {}) {
  return {
    command_id: "c1",
    robot_id: "AGI",
    kind: "stop",
    state: "SENT",
    requested_by: "ana",
    requesters: ["ana"],
    times: {
      pressed: null,
      requested: STAMP,
      sent: {},
      answer: {},
      standing: null,
    },
    pressed_at: null,
    requested_at: STAMP,
    sent_fiware_at: null,
    sent_direct_at: null,
    answer_fiware_at: null,
    answer_direct_at: null,
    standing_at: null,
    goal: null,
    standstill_ms: null,
    tries: 1,
    reason: null,
    hold_id: null,
    age_s: null,
    transports: {},
    outcome: null,
    was_loud: false,
    steps: [],
    robot: null,
    challenge_fresh: false,
    ...changes,
  };
}

/** @param {number} id @returns {Entry} */
export function entry(id) {
  const words = { kind: "system", key: "log.link.live", slots: {} };
  return { id, at: STAMP, ...words, robot_id: null, class: null, decision_id: null };
}

/** @param {Partial<GreenhouseMap>} [changes] @returns {GreenhouseMap} */
export function greenhouse(changes = {}) {
  return {
    name: "test",
    bounds: { xmin: 0, ymin: 0, xmax: 20, ymax: 10 },
    lanes: [{ label: "1", xmin: 0, ymin: 0, xmax: 20, ymax: 3 }],
    rows: [{ xmin: 1, ymin: 4, xmax: 19, ymax: 5 }],
    posts: [{ x: 10, y: 4, radius: 0.1 }],
    obstacles: [{ kind: "crate", xmin: 15, ymin: 7, xmax: 16, ymax: 8 }],
    ...changes,
  };
}

/** @param {Partial<Snapshot>} [changes] @returns {Snapshot} */
export function snapshot(changes = {}) {
  return {
    t: STAMP,
    server: { boot: "b1", version: "0", demo: false, wall: 0 },
    user: { name: "ana", role: "operator" },
    rule: /** @type {any} */ (null),
    map: greenhouse(),
    robots: [robot()],
    people: [],
    detections: {},
    commands: [],
    alerts: [],
    log: [],
    health: /** @type {any} */ (null),
    climate: null,
    equipment: [],
    ...changes,
  };
}

/**
 * A frame of telemetry as the server writes it.
 *
 * @param {{frame: number, parts?: unknown[], moves?: unknown[], scans?: unknown[]}} head
 * @param {number[]} [units] ranges of all scans, each scan's padded to an even count
 * @returns {ArrayBuffer}
 */
export function telemetryFrame(head, units = []) {
  const words = new TextEncoder().encode(JSON.stringify(head));
  const length = Math.ceil(words.length / 4) * 4;
  const bytes = new ArrayBuffer(4 + length + 2 * units.length);
  new DataView(bytes).setUint32(0, length, true);
  new Uint8Array(bytes, 4, length).fill(32);
  new Uint8Array(bytes, 4, length).set(words);
  new Uint16Array(bytes, 4 + length).set(units);
  return bytes;
}
