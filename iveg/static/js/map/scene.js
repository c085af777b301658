/**
 * The scene on the map at one instant, from the store and a time.
 *
 * Layers only paint; whether a robot is a ghost, how far a zone has grown, whether a
 * sweep is too old to show is decided here, by pure functions of values and `nowMs`.
 *
 * @typedef {import("../core/store.js").Store} Store
 * @typedef {import("../core/protocol.js").Robot} Robot
 * @typedef {import("../core/protocol.js").Person} Person
 * @typedef {import("../core/protocol.js").Detection} Detection
 * @typedef {import("../core/protocol.js").GreenhouseMap} GreenhouseMap
 * @typedef {import("../core/protocol.js").Pose} Pose
 * @typedef {import("../core/protocol.js").Point} Point
 *
 * @typedef {{
 *   id: string, slot: number, pose: Pose, link: import("../core/protocol.js").Link,
 *   ageS: number, situation: import("../core/situation.js").Situation, replay: boolean,
 *   drive: string, length: number, width: number,
 *   task: string | null, goal: Point | null, path: [number, number][],
 *   unsureM: number, isBlind: boolean, encounters: import("../core/protocol.js").Encounter[],
 *   obstacle: import("../types.js").SeenObstacle | null,
 * }} SceneRobot `slot` names its hue; `unsureM` how far it may have driven unseen (m):
 *   since an unconfirmed STOP, or since it was heard; `encounters` and `obstacle` of a
 *   LIVE one alone
 *
 * @typedef {{
 *   id: string, peer: boolean, unknown?: boolean, stage: "seen" | "remembered" | "last_seen",
 *   x: number, y: number, ageS: number, zoneM: number, confidence: number,
 *   observers: string[], acting: Person["acting"], decisionId: string | null,
 *   isThing: boolean,
 * }} ScenePerson
 *
 * @typedef {{
 *   id: string, robotId: string, slot: number, x: number, y: number, yaw: number,
 *   length: number, width: number, probability: number, confident: boolean,
 *   named: boolean, item: Detection,
 * }} SceneDetection `yaw` of its box (rad); `named` = already drawn as a person
 *
 * @typedef {{robotId: string, slot: number, strength: number, points: Float32Array}
 * } SceneScan `strength` 1 fresh … 0 gone
 *
 * @typedef {{
 *   nowMs: number, map: GreenhouseMap | null, isVeiled: boolean,
 *   robots: SceneRobot[], people: ScenePerson[], detections: SceneDetection[],
 *   scans: SceneScan[], costmap: import("../core/protocol.js").Costmap | null,
 *   coverage: import("../core/protocol.js").Coverage | null,
 *   tiles: import("../core/protocol.js").Tile[],
 * }} Scene
 */

import { ageOf, linkOf } from "../core/clock.js";
import { LIMITS, zoneRadius } from "../core/limits.js";
import { isBlind, situationOf } from "../core/situation.js";
import { slotOf } from "../core/slots.js";

/** The server is silent for two seconds when the line is called lost; one more. */
const VEIL_AFTER_MS = 1000;
/** Commands whose robot may still be driving unnoticed. */
const UNSURE_STATES = new Set(["UNCONFIRMED", "STILL_MOVING"]);
/** Age at which the mark of a lost person is removed (s): the place is unknown by then. */
export const MARK_LIMIT_S = 60;
/** Marks nearer to each other than this are one (m). */
const ONE_MARK_M = 1;
/** Body of a robot without a description (m). */
const PLAIN = { drive: "differential", length: 1, width: 0.6 };
const BOX_WITHOUT_SIZE_M = 0.5;
/** Of robots without any: the same ones in each frame, so that nothing seems to change.
 * @type {[number, number][]} */
const NO_PATH = [];
/** @type {import("../core/protocol.js").Encounter[]} */
const NO_ENCOUNTERS = [];

/** A scene without anything. */
export const NOTHING = {
  nowMs: 0,
  map: null,
  isVeiled: false,
  robots: [],
  people: [],
  detections: [],
  scans: [],
  costmap: null,
  coverage: null,
  tiles: [],
};

/**
 * @param {Store} store
 * @param {number} nowMs `performance.now()` (ms)
 * @returns {Scene}
 */
export function readScene(store, nowMs) {
  const { state, since } = store.connection;
  const isGone = state === "lost" || state === "signed-out";
  return {
    nowMs,
    map: store.map(),
    isVeiled: isGone && nowMs - since > VEIL_AFTER_MS,
    robots: readRobots(store, nowMs),
    people: marked(store.people().map((person) => readPerson(person, nowMs))),
    detections: readDetections(store, nowMs),
    scans: readScans(store, nowMs),
    costmap: store.get("costmap") ?? null,
    coverage: store.get("coverage") ?? null,
    tiles: readTiles(store),
  };
}

/** Tiles of other equipment that have a place. @param {Store} store */
function readTiles(store) {
  /** @type {import("../core/protocol.js").Tile[]} */
  const tiles = store.get("equipment") ?? [];
  return tiles.filter(({ place }) => place !== null);
}

/** @param {Store} store @param {number} nowMs */
function readRobots(store, nowMs) {
  /** @type {SceneRobot[]} */
  const robots = [];
  for (const robot of store.robots().values()) {
    if (robot.pose) robots.push(readRobot(robot, robot.pose, store, nowMs));
  }
  return robots;
}

/**
 * @param {Robot} robot
 * @param {Pose} pose
 * @param {Store} store
 * @param {number} nowMs
 * @returns {SceneRobot}
 */
function readRobot(robot, pose, store, nowMs) {
  const ageS = ageOf(robot, nowMs);
  const { drive, length, width } = robot.profile ?? PLAIN;
  const link = linkOf(ageS);
  return {
    id: robot.robot_id,
    slot: slotOf(robot.robot_id),
    pose,
    link,
    ageS,
    situation: situationOf(robot, nowMs),
    replay: robot.replay,
    isBlind: link === "LIVE" && isBlind(robot),
    drive,
    length,
    width,
    task: robot.navigation?.task ?? null,
    goal: robot.navigation?.goal ?? null,
    path: robot.navigation?.path ?? NO_PATH,
    unsureM: Math.max(unsureOfStop(robot, store, nowMs), unheard(robot, ageS)),
    encounters: (link === "LIVE" ? robot.encounters : null) ?? NO_ENCOUNTERS,
    obstacle: (link === "LIVE" ? robot.applied?.obstacle : null) ?? null,
  };
}

/**
 * How far a robot may have driven since a STOP that is unconfirmed: the server's figure,
 * and from then on its last speed times the silence.
 *
 * @param {Robot} robot
 * @param {Store} store
 * @param {number} nowMs
 */
function unsureOfStop(robot, store, nowMs) {
  const heardMs = robot.receivedAtMs ?? nowMs;
  const step = robot.stop && store.get(`commands/${robot.stop.command_id}`);
  // A step comes on its own topic; each try and each report on the robot's.
  const isStepNewer = (step?.receivedAtMs ?? 0) > heardMs;
  const stop = isStepNewer ? step : robot.stop;
  if (!stop?.robot || !UNSURE_STATES.has(stop.state)) return 0;
  const saidMs = isStepNewer ? step.receivedAtMs : heardMs;
  const waitedS = Math.max(0, nowMs - saidMs) / 1000;
  return (stop.robot.moved_m ?? 0) + Math.abs(stop.robot.v ?? 0) * waitedS;
}

/**
 * How far a robot that is not heard may have driven at its last speed (m).  As with
 * people, the disc grows for so long; nothing is known of the place after that.
 *
 * @param {Robot} robot
 * @param {number} ageS
 */
function unheard({ twist, replay }, ageS) {
  const speed = Math.abs(twist?.linear ?? 0);
  if (replay || linkOf(ageS) === "LIVE" || speed < LIMITS.standing_speed) return 0;
  return speed * Math.min(ageS, LIMITS.zone_lasts_s);
}

/**
 * @param {Person} person
 * @param {number} nowMs
 * @returns {ScenePerson}
 */
export function readPerson(person, nowMs) {
  const ageS = ageOf(person, nowMs);
  const stage = stageAt(person, ageS);
  return {
    id: person.person_id,
    peer: person.class === "robot",
    isThing: Boolean(person.thing_id),
    stage,
    x: person.position.x,
    y: person.position.y,
    ageS,
    zoneM: ringNow(person, stage, ageS),
    confidence: person.confidence,
    observers: person.observers,
    acting: person.acting,
    decisionId: person.decision_id,
  };
}

/**
 * The people that the map shows: the mark of a lost person is removed after a minute, and
 * of marks that overlap each other, or a person with a zone, only the newest stays.
 *
 * @param {ScenePerson[]} people
 */
export function marked(people) {
  /** @type {ScenePerson[]} */
  const shown = people.filter(({ stage }) => stage !== "last_seen");
  const lost = people.filter(
    ({ stage, ageS }) => stage === "last_seen" && ageS <= MARK_LIMIT_S,
  );
  for (const one of lost.sort((a, b) => a.ageS - b.ageS)) {
    const isSame = (/** @type {ScenePerson} */ it) =>
      it.peer === one.peer && Math.hypot(it.x - one.x, it.y - one.y) < ONE_MARK_M;
    if (!shown.some(isSame)) shown.push(one);
  }
  return shown;
}

/**
 * The zone as the server drew it, grown on for as long as the server has been silent.
 *
 * @param {Person} person
 * @param {ScenePerson["stage"]} stage
 * @param {number} ageS
 */
function ringNow(person, stage, ageS) {
  const radiusM = person.radius_m;
  if (radiusM === null) return 0;
  if (stage === "seen") return radiusM;
  return zoneRadius(radiusM, ageS, person.age_s ?? 0);
}

/**
 * A person never gets fresher here than the server said, only older.
 *
 * Without a zone (the place was seen to be empty) no person is remembered there.
 *
 * @param {Person} person
 * @param {number} ageS
 * @returns {ScenePerson["stage"]}
 */
function stageAt({ stage, radius_m }, ageS) {
  if (radius_m === null) return "last_seen";
  if (stage === "gone" || stage === "last_seen") return "last_seen";
  if (ageS > LIMITS.zone_lasts_s) return "last_seen";
  return stage === "seen" && ageS <= LIMITS.seen_s ? "seen" : "remembered";
}

/** @param {Store} store @param {number} nowMs */
function readDetections(store, nowMs) {
  /** @type {SceneDetection[]} */
  const detections = [];
  for (const [robotId, frame] of store.detections()) {
    if (ageOf(frame, nowMs) > LIMITS.live_s) continue;
    const yaw = store.robots().get(robotId)?.pose?.yaw ?? 0;
    const slot = slotOf(robotId);
    frame.items.forEach((item, i) => {
      detections.push(readDetection(item, `${robotId}/${i}`, slot, yaw));
    });
  }
  return detections;
}

/**
 * @param {Detection} item
 * @param {string} id
 * @param {number} slot
 * @param {number} robotYaw a box in the robot's frame is turned as the robot is
 * @returns {SceneDetection}
 */
function readDetection(item, id, slot, robotYaw) {
  const box = item.box;
  return {
    id,
    robotId: item.robot_id,
    slot,
    x: item.position.x,
    y: item.position.y,
    yaw: box && box.frame_id !== "map" ? robotYaw : 0,
    length: box ? box.xmax - box.xmin : BOX_WITHOUT_SIZE_M,
    width: box ? box.ymax - box.ymin : BOX_WITHOUT_SIZE_M,
    probability: item.probability,
    confident: item.confident,
    named: item.person_id !== null && item.person_id !== undefined,
    item,
  };
}

/** @param {Store} store @param {number} nowMs */
function readScans(store, nowMs) {
  /** @type {SceneScan[]} */
  const scans = [];
  for (const [robotId, { points, ...scan }] of store.scans()) {
    const strength = strengthAt(ageOf(scan, nowMs));
    if (!strength) continue;
    scans.push({ robotId, slot: slotOf(robotId), strength, points });
  }
  return scans;
}

/**
 * Old laser points show the past; they fade while LATE and go when LOST.
 *
 * @param {number} ageS
 */
function strengthAt(ageS) {
  if (ageS <= LIMITS.live_s) return 1;
  return ageS <= LIMITS.late_s ? 0.35 : 0;
}
