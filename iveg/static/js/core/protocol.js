/**
 * The frames of `/live`: how they are read and written (docs/interfaces/live.md).
 *
 * Shapes come from the models of the server (`types.d.ts`); here they get the
 * page's own field: when a value arrived.  Lengths are metres, angles radians, frames `map`.
 *
 * @typedef {import("./clock.js").Aged} Aged
 * @typedef {import("../types.js").Point} Point
 * @typedef {import("../types.js").Position} Position
 * @typedef {import("../types.js").Pose} Pose
 * @typedef {import("../types.js").Area} Box2D
 * @typedef {Robot["link"]} Link
 * @typedef {import("../types.js").Encounter} Encounter
 * @typedef {Robot["mode"]} Mode
 * @typedef {import("../types.js").Hold} Hold
 * @typedef {import("../types.js").Margin} Margin
 * @typedef {Aged & import("../types.js").Robot} Robot
 * @typedef {Aged & import("../types.js").Person} Person
 * @typedef {import("../types.js").Detection} Detection
 * @typedef {Aged & import("../types.js").DetectionFrame} DetectionFrame
 * @typedef {Aged & import("../types.js").Command} Command
 * @typedef {import("../types.js").Alert} Alert
 * @typedef {import("../types.js").Rule} Rule
 * @typedef {import("../types.js").LogEntry} Entry
 * @typedef {Aged & import("../types.js").Health} Health
 * @typedef {Aged & import("../types.js").Climate} Climate
 * @typedef {Aged & import("../types.js").Tile} Tile
 * @typedef {import("../types.js").GreenhouseMap} GreenhouseMap
 * @typedef {Aged & {robot_id: string, stamp: string | null, points: Float32Array}} Scan
 * @typedef {Aged & import("../types.js").Costmap} Costmap
 * @typedef {Aged & import("../types.js").Coverage} Coverage when a camera last looked where
 * @typedef {Aged & import("../types.js").Snapshot} Snapshot
 *
 * @typedef {{topic: string, data: unknown, at?: number}} Message `at`: when it was true,
 *   on the server's monotonic clock (s)
 */

import { readTelemetry } from "./telemetry.js";
import { ProtocolError, parse, readHead } from "./wire.js";

export { ProtocolError };

/**
 * Reads one frame as the socket delivers it (`binaryType` "arraybuffer").
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
 * @param {ArrayBuffer} bytes a frame of telemetry
 * @returns {Message}
 */
function readBytes(bytes) {
  const { head, start } = readHead(bytes);
  if (typeof head?.frame !== "number") throw new ProtocolError("no frame number");
  return { topic: "telemetry", data: readTelemetry(head, bytes, start) };
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
 * @param {{at: number, within: number, wait?: number} | null} [drawn] when, on the
 *   server's monotonic clock, its uncertainty, and how long the next frame may wait (s);
 *   null if nothing was drawn or the moment is unknown
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
