/**
 * What the history knows about one robot around a moment: its speed and limit, and how
 * far it was from somebody who was seen, with the radius of their zone.
 *
 * @typedef {import("./plot.js").Sample} Sample
 * @typedef {import("./plot.js").Span} Span
 * @typedef {{at: string, x: number, y: number, linear: number,
 *   limit_factor: number}} Pose a row of `/odometry`
 * @typedef {{at: string, x: number | null, y: number | null}} Sighting one of `/tracks`
 * @typedef {{span: Span, poses: Pose[], sightings: Sighting[],
 *   fastest: number | null}} Past rows oldest first; `fastest` in m/s
 */

import { readApi } from "../core/api.js";
import { zoneRadius } from "../core/limits.js";

const BEFORE_MS = 3000;
const AFTER_MS = 3000;
/** Of what goes on longer, the beginning is told. */
const LONGEST_MS = 60_000;
/** Between two poses farther apart nothing is known. */
const POSE_GAP_MS = 1500;
const RING_EVERY_MS = 250;
const ROWS = 1000;

/**
 * @param {string} began ISO-8601 @param {string | null} ended
 * @returns {Span}
 */
export function spanOf(began, ended) {
  const since = Date.parse(began);
  const until = Math.min(ended ? Date.parse(ended) : Date.now(), since + LONGEST_MS);
  return { since: since - BEFORE_MS, until: Math.max(since, until) + AFTER_MS };
}

/**
 * Empty where the history does not answer, or has forgotten it.
 *
 * @param {Span} span @param {string} robotId @param {string | null} personId
 * @returns {Promise<Past>}
 */
export async function readPast(span, robotId, personId) {
  const range = `since=${isoOf(span.since)}&until=${isoOf(span.until)}&limit=${ROWS}`;
  const who = personId && `tracks?${range}&person=${encodeURIComponent(personId)}`;
  const [poses, tracks, robot] = await Promise.all([
    readApi(`odometry?${range}&robot=${encodeURIComponent(robotId)}`),
    who ? readApi(who) : null,
    readApi(`robots/${encodeURIComponent(robotId)}`),
  ]);
  return {
    span,
    poses: oldestFirst(poses.body?.items),
    sightings: oldestFirst(tracks?.body?.items),
    fastest: robot.body?.profile?.max_speed ?? null,
  };
}

/** @param {number} at */
const isoOf = (at) => new Date(at).toISOString();

/** @template T @param {T[] | undefined} rows @returns {T[]} */
const oldestFirst = (rows = []) => [...rows].reverse();

/** Measured speed (m/s). @param {Past} past @returns {Sample[]} */
export const speedsOf = ({ poses }) =>
  poses.map(({ at, linear }) => ({ at: Date.parse(at), value: linear }));

/** The speed limit (m/s); nothing where the greatest speed is unknown.
 * @param {Past} past @returns {Sample[]} */
export function limitsOf({ poses, fastest }) {
  if (fastest === null) return [];
  return poses.map(({ at, limit_factor }) => ({
    at: Date.parse(at),
    value: fastest * limit_factor,
  }));
}

/**
 * From the robot to the person (m), at each sighting between two poses.
 *
 * @param {Past} past @returns {Sample[]}
 */
export function distancesOf({ poses, sightings }) {
  const found = sightings.map(({ at, x, y }) => {
    const moment = Date.parse(at);
    const robot = poseAt(poses, moment);
    const isKnown = robot !== null && x !== null && y !== null;
    const value = isKnown ? Math.hypot(robot.x - x, robot.y - y) : null;
    return { at: moment, value };
  });
  return found;
}

/**
 * Radius of the zone (m): it grows while the person is not seen.
 *
 * @param {Past} past @param {number} radiusM of somebody just seen
 * @returns {Sample[]}
 */
export function zonesOf({ sightings, span }, radiusM) {
  const seen = sightings.map(({ at }) => Date.parse(at));
  const until = span.until;
  /** @type {Sample[]} */
  const radii = [];
  let next = 0;
  for (let at = seen[0]; at <= until; at += RING_EVERY_MS) {
    while (seen[next + 1] <= at) next += 1;
    radii.push({ at, value: zoneRadius(radiusM, (at - seen[next]) / 1000) });
  }
  return radii;
}

/** @param {Pose[]} poses @param {number} moment */
function poseAt(poses, moment) {
  const after = poses.findIndex(({ at }) => Date.parse(at) >= moment);
  if (after < 1) return null;
  const [one, other] = [poses[after - 1], poses[after]];
  const [from, to] = [Date.parse(one.at), Date.parse(other.at)];
  if (to - from > POSE_GAP_MS) return null;
  const share = (moment - from) / (to - from || 1);
  return { x: one.x + share * (other.x - one.x), y: one.y + share * (other.y - one.y) };
}
