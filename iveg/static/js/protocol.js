/**
 * The words of `/live`: what a frame says, and nothing about what is done with it.
 *
 * Shapes are those of docs/interfaces.md section 8, field for field; lengths are metres,
 * angles radians, frames `map`.
 *
 * @typedef {import("./clock.js").Aged} Aged
 * @typedef {{x: number, y: number}} Point
 * @typedef {{x: number, y: number, z: number}} Position
 * @typedef {{x: number, y: number, yaw: number}} Pose
 * @typedef {{xmin: number, ymin: number, xmax: number, ymax: number}} Box2D
 * @typedef {"LIVE" | "LATE" | "LOST" | "UNKNOWN"} Link
 * @typedef {"RUNNING" | "SLOW" | "STOPPED"} Mode
 * @typedef {{id: string, source: string, ack: string}} Hold
 *
 * @typedef {{
 *   robot_id: string, person_id: string, gap_m: number, needs_m: number,
 *   margin_m: number, band: "clear" | "tight" | "inside" | "unknown",
 *   parts: {person_walks_m: number, reaction_m: number, braking_m: number,
 *     uncertainty_m: number},
 *   age_s: number, braking: number, walking_speed: number,
 * }} Margin what is left between a robot and a person, surface to surface (m)
 *
 * @typedef {Aged & {
 *   robot_id: string, link: Link, mode: Mode, pose: Pose | null,
 *   twist: {linear: number, angular: number} | null,
 *   stamp: string | null, received_at: string | null, age_estimated?: boolean,
 *   speed_factor: number | null,
 *   applied: {reason: string, cause: string | null, age_s: number,
 *     feedback_age_s: number | null,
 *     faults?: {code: string, about: string, for_s: number | null}[]} | null,
 *   mandate: {speed_factor: number, reason: string, cause: string | null,
 *     distance_m: number | null, decision_id: string | null} | null,
 *   holds: Hold[], stop: Command | null,
 *   navigation: {task: string, goal: Point | null, path: [number, number][]} | null,
 *   replay: boolean, clock_offset_s: number | null, road: string | null,
 *   transport?: "direct" | "fiware",
 *   profile: {drive: string, length: number, width: number, max_speed: number,
 *     turning_radius: number} | null,
 *   margin?: Margin | null, cmd_status: string | null,
 *   battery?: {percentage: number | null, charging: boolean | null,
 *     voltage: number | null, age_s: number | null} | null,
 * }} Robot
 *
 * @typedef {Aged & {
 *   person_id: string, class: "person" | "robot", class_id: string,
 *   stage: "seen" | "remembered" | "last_seen", position: Position, radius_m: number,
 *   confidence: number, first_seen: string, last_seen: string, observers: string[],
 *   decision_id: string | null, lane: string | null,
 *   acting: {robot_id: string, distance_m: number, in_sight: boolean}[],
 *   margin?: Margin | null, possible?: boolean, doubtful?: boolean,
 * }} Person
 *
 * @typedef {{
 *   robot_id: string, stamp: string, class: string | null, class_id: string,
 *   probability: number, position: Position,
 *   box: Box2D & {zmin?: number, zmax?: number, frame_id: string} | null,
 *   confident: boolean, person_id: string | null, road?: string,
 * }} Detection
 *
 * @typedef {Aged & {robot_id: string, stamp: string, road: string, items: Detection[]}
 * } Look
 *
 * @typedef {Aged & {
 *   command_id: string, robot_id: string, kind: "stop" | "release" | "resume",
 *   state: string, requested_by: string, requesters: string[],
 *   times: Record<string, string | null>, standstill_ms: number | null, tries: number,
 *   reason: string | null, roads: Record<string, string>,
 *   note?: {key: string, slots: Record<string, number>} | null,
 *   drill?: boolean,
 *   robot: {v: number | null, report_age_s: number | null, moved_m: number | null} | null,
 *   challenge_fresh: boolean,
 * }} Command
 *
 * @typedef {{
 *   priority: "P1" | "P2" | "P3", raised_at: string, cleared_at: string | null,
 *   acknowledged_at: string | null, acknowledged_by: string | null,
 *   note: string | null,
 * }} Occurrence one time that an alert was raised
 *
 * @typedef {{
 *   alert_id: string, priority: "P1" | "P2" | "P3", key: string,
 *   slots: Record<string, string | number | null>, robot_id: string | null,
 *   raised_at: string, last_raised_at: string, cleared_at: string | null,
 *   acknowledged_at: string | null, acknowledged_by: string | null,
 *   note: string | null, count: number, members: Occurrence[],
 * }} Alert all occurrences of one kind and subject; `members` the newest of them
 *
 * @typedef {{
 *   count: number, limit: number, window_s: number, since: string | null,
 * }} Flood alerts that sounded within the window; `since` null: no flood
 *
 * @typedef {{
 *   id: string, version: number, confidence_threshold: number, radius_m: number,
 *   factor: number, class_thresholds?: Record<string, number>,
 *   aliases?: Record<string, string>, possible_people?: boolean,
 *   author?: string | null, since?: string | null,
 * }} Rule the version in force
 *
 * @typedef {{
 *   id: number, at: string, kind: string, robot_id: string | null, key: string,
 *   slots: Record<string, string | number | boolean | null>, class: string | null,
 *   decision_id: string | null,
 * }} Entry
 *
 * @typedef {Aged & {
 *   ok: boolean,
 *   hops: {hop: string, state: "ok" | "late" | "down" | "unknown", age_s: number | null,
 *     key: string, detail: string | null, lag_s?: number | null, growing?: boolean}[],
 *   counters: Record<string, number>, safety?: Safety,
 *   earlier?: "known" | "reading" | "unknown",
 * }} Health
 *
 * @typedef {{
 *   alert_latency: {p50_ms: number | null, p95_ms: number | null, p99_ms: number | null,
 *     count: number, window_s: number, age_s: number | null},
 *   not_echoed: {count: number, of: number, within_s: number, window_s: number,
 *     age_s: number | null},
 *   negative_margin: {share: number | null, known_s: number, unknown_s: number,
 *     count: number, since: string | null, age_s: number | null},
 *   worst_margin: {margin: Margin | null, at: string | null, count: number,
 *     since: string | null, age_s: number | null},
 * }} Safety how soon the fleet obeys, and how close it comes to people
 *
 * @typedef {Aged & {temperature: number | null, relative_humidity: number | null,
 *   co2: number | null, received_at: string}} Climate
 *
 * @typedef {{
 *   name: string, bounds: Box2D | null, lanes: ({label: string} & Box2D)[],
 *   rows: Box2D[], posts: {x: number, y: number, radius: number}[],
 *   obstacles: ({kind: string} & Box2D)[],
 * }} GreenhouseMap
 *
 * @typedef {Aged & {robot_id: string, stamp: string, points: Float32Array}} Scan
 *
 * @typedef {Aged & {resolution: number, width: number, height: number, origin: Point,
 *   data: number[]}} Costmap `resolution` (m/cell); `data` row by row from the origin
 *   (its south-western corner, m), 0 free … 100 taken, −1 unknown (GET /costmap)
 *
 * @typedef {Box2D & {label: string, columns: number, rows: number,
 *   ages_s: (number | null)[]}} LaneCoverage rows from the south, each from west to east
 * @typedef {Aged & {at: string, cameras: number, within_s: number, share: number | null,
 *   lanes: LaneCoverage[]}} Coverage when a camera last looked where (GET /coverage)
 *
 * @typedef {Aged & {
 *   t: string, server: {boot: string, version: string, demo: boolean},
 *   user: {name: string, role: string} | null,
 *   rule: Rule | null,
 *   map: GreenhouseMap, robots: Robot[], people: Person[],
 *   detections: Record<string, Look>, commands: Command[], alerts: Alert[], flood: Flood | null,
 *   log: Entry[], health: Health | null, climate: Climate | null,
 * }} Snapshot
 *
 * @typedef {{topic: string, data: unknown, at?: number}} Message `at`: when it was true,
 *   on the server's monotonic clock (s)
 */

import { readTelemetry } from "./telemetry.js";
import { ProtocolError, parse, readHead } from "./wire.js";

export { ProtocolError };

/**
 * Reads one frame as the socket hands it over (`binaryType` "arraybuffer").
 *
 * @param {unknown} frame
 * @returns {Message}
 * @throws {ProtocolError}
 */
export function readFrame(frame) {
  if (typeof frame === "string") return readText(frame);
  if (frame instanceof ArrayBuffer) return readBytes(frame);
  throw new ProtocolError("neither text nor bytes");
}

/**
 * @param {string} text `{"topic": T, "data": D}`
 * @returns {Message}
 * @throws {ProtocolError}
 */
export function readText(text) {
  const message = parse(text);
  if (typeof message?.topic !== "string" || !("data" in message)) {
    throw new ProtocolError("no topic or no data");
  }
  return { topic: message.topic, data: message.data, at: message.at };
}

/**
 * @param {ArrayBuffer} bytes one scan, or a frame of telemetry
 * @returns {Message}
 */
function readBytes(bytes) {
  const { head, start } = readHead(bytes);
  if (typeof head?.frame !== "number") return readScan(bytes);
  return { topic: "telemetry", data: readTelemetry(head, bytes, start) };
}

/**
 * Reads a scan frame; the points stay where they arrived, no byte is copied.
 *
 * Little-endian, as every browser's hardware is: `uint32` length of the head, the head
 * (JSON, padded to a multiple of four), then `float32` pairs x, y in `map` (m).
 *
 * @param {ArrayBuffer} bytes
 * @returns {{topic: string, data: Scan}}
 * @throws {ProtocolError}
 */
export function readScan(bytes) {
  const { head, start } = readHead(bytes);
  if ((bytes.byteLength - start) % 8) throw new ProtocolError("half a point");
  if (typeof head?.topic !== "string" || typeof head.robot_id !== "string") {
    throw new ProtocolError("scan without topic or robot_id");
  }
  const { topic, robot_id, stamp, age_s } = head;
  const points = new Float32Array(bytes, start);
  return { topic, data: { robot_id, stamp, age_s, points } };
}

/**
 * @param {number} t `performance.now()` (ms); the server sends it back
 * @returns {string}
 */
export function writePing(t) {
  return JSON.stringify({ type: "ping", t });
}

/**
 * @param {number} frame the newest that was painted
 * @param {{at: number, within: number} | null} [drawn] when, on the server's monotonic
 *   clock, and how wrong that may be (s); null where nothing was drawn or nobody knows
 * @returns {string} as the server's counters know it: nothing before `type`, no spaces
 */
export function writePainted(frame, drawn = null) {
  return JSON.stringify({ type: "painted", frame, ...drawn });
}

/**
 * @param {string | null} robotId null = the whole fleet
 * @param {string} pressId the same for every repetition of one press
 * @param {number} pressedAt Unix time (s), corrected by the server clock's offset
 * @returns {string}
 */
export function writeStop(robotId, pressId, pressedAt) {
  const stop = { type: "stop", robot_id: robotId };
  return JSON.stringify({ ...stop, press_id: pressId, pressed_at: pressedAt });
}
