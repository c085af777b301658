/**
 * A frame of telemetry: the newest value of everything that has changed, in one message.
 *
 * docs/interfaces/live.md.  A move is an array, because it comes most often; a
 * scan's ranges follow the head as integers.
 *
 * @typedef {{topic: string, at: number, data: any}} Told `at`: when it was true, on the
 *   server's monotonic clock (s)
 * @typedef {{frame: number, told: Told[]}} Telemetry
 *
 * @typedef {{
 *   topic: string, at: number, robot_id: string, stamp: string, age_s: number | null,
 *   x: number, y: number, yaw: number, angle_min: number, angle_increment: number,
 *   unit_m: number, count: number,
 * }} Sweep `x`, `y`, `yaw`: the sensor in `map` (m, rad); `unit_m` of a range
 */

import { ProtocolError } from "./wire.js";

const NO_RETURN = 0xffff;
/** Kinds of scanners whose directions are kept; a fleet has a few. */
const SCANNERS = 16;

/** @type {Map<string, Float32Array>} */
const directions = new Map();

/**
 * @param {any} head
 * @param {ArrayBuffer} bytes
 * @param {number} start of the bodies
 * @returns {Telemetry}
 * @throws {ProtocolError}
 */
export function readTelemetry(head, bytes, start) {
  const { frame, parts = [], moves = [], scans = [] } = head;
  const told = [...parts.flatMap(readPart), ...moves.map(readMove)];
  let offset = start;
  for (const sweep of scans) {
    const size = 2 * (sweep.count + (sweep.count % 2));
    if (!(offset + size <= bytes.byteLength)) throw new ProtocolError("half a scan");
    told.push(readSweep(sweep, new Uint16Array(bytes, offset, sweep.count)));
    offset += size;
  }
  return { frame, told };
}

/**
 * A part about a robot has its changed fields; the part about people has all ids and each
 * person that has changed; every other part is whole.
 *
 * @param {Told} part
 * @returns {Told[]}
 */
function readPart({ topic, at, data }) {
  if (topic.startsWith("robots/")) return [{ topic: `${topic}/state`, at, data }];
  if (topic !== "people") return [{ topic, at, data }];
  const changed = data.changed.map((/** @type {any} */ person) => ({
    topic: `people/${person.person_id}`,
    at: person.at,
    data: person,
  }));
  return [...changed, { topic: "people/ids", at, data: data.ids }];
}

/**
 * @param {any[]} move
 * @returns {Told}
 */
function readMove([robot_id, at, age_s, x, y, yaw, linear, angular, stamp]) {
  const pose = { x, y, yaw };
  const data = { robot_id, age_s, pose, twist: { linear, angular }, stamp };
  return { topic: `robots/${robot_id}/move`, at, data };
}

/**
 * @param {Sweep} sweep
 * @param {Uint16Array} units
 * @returns {Told}
 */
function readSweep(sweep, units) {
  const { topic, at, robot_id, stamp, age_s } = sweep;
  const points = pointsOf(sweep, units);
  return { topic, at, data: { robot_id, stamp, age_s, points } };
}

/**
 * Where the ranges of a sweep end: x, y, x, y … in `map` (m).
 *
 * @param {Pick<Sweep, "x" | "y" | "yaw" | "angle_min" | "angle_increment" | "unit_m">
 *   } sweep
 * @param {Uint16Array} units
 * @returns {Float32Array}
 */
export function pointsOf(sweep, units) {
  const ways = directionsOf(sweep, units.length);
  const { x, y, unit_m } = sweep;
  const [ahead, aside] = [unit_m * Math.cos(sweep.yaw), unit_m * Math.sin(sweep.yaw)];
  const points = new Float32Array(2 * units.length);
  let n = 0;
  for (let i = 0; i < units.length; i += 1) {
    if (units[i] === NO_RETURN) continue;
    const [along, across] = [units[i] * ways[2 * i], units[i] * ways[2 * i + 1]];
    points[n] = x + along * ahead - across * aside;
    points[n + 1] = y + along * aside + across * ahead;
    n += 2;
  }
  return points.subarray(0, n);
}

/**
 * The directions of a scanner's rays, computed once: cosine, sine, cosine …
 *
 * @param {Pick<Sweep, "angle_min" | "angle_increment">} sweep
 * @param {number} count
 */
function directionsOf({ angle_min, angle_increment }, count) {
  const key = `${angle_min} ${angle_increment} ${count}`;
  const known = directions.get(key);
  if (known) return known;
  const ways = new Float32Array(2 * count);
  for (let i = 0; i < count; i += 1) {
    const angle = angle_min + i * angle_increment;
    ways[2 * i] = Math.cos(angle);
    ways[2 * i + 1] = Math.sin(angle);
  }
  if (directions.size >= SCANNERS) directions.clear();
  directions.set(key, ways);
  return ways;
}
