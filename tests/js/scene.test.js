import { LIMITS } from "../../iveg/static/js/core/limits.js";
import { Store } from "../../iveg/static/js/core/store.js";
import { borderTowards } from "../../iveg/static/js/map/layers/encounters.js";
import { isSeenHeld } from "../../iveg/static/js/map/layers/tags.js";
import { marked, readPerson, readScene } from "../../iveg/static/js/map/scene.js";
import { command, detection, person, robot, situation, snapshot } from "./builders.js";
import { equal, near, test } from "./harness.js";

/** @type {import("../../iveg/static/js/core/protocol.js").Encounter} */
const ENCOUNTER = {
  ...{ cause: "P1", reason: "person", in_s: 1.8, probability: 0.9, radius_m: 2 },
  ...{ place: { x: 2, y: 2 }, centre: { x: 4, y: 2 } },
};

/** @param {Partial<import("./builders.js").Snapshot>} [changes] */
function storeOf(changes) {
  const store = new Store({ now: () => 0, schedule: () => {} });
  store.apply("snapshot", snapshot(changes), 0);
  store.setConnection("open", 0);
  return store;
}

test("a robot without a word becomes a ghost at its last pose", () => {
  const store = storeOf({ robots: [robot({ age_s: 0 })] });
  const links = [500, 2000, 4000].map((ms) => readScene(store, ms).robots[0].link);
  equal(links, ["LIVE", "LATE", "LOST"]);
  equal(readScene(store, 4000).robots[0].pose, { x: 1, y: 2, yaw: 0 });
});

test("what the server calls live is not live once it is old", () => {
  const store = storeOf({ robots: [robot({ link: "LIVE", age_s: 5 })] });
  equal(readScene(store, 0).robots[0].link, "LOST");
});

test("a robot without a pose is not drawn", () => {
  equal(readScene(storeOf({ robots: [robot({ pose: null })] }), 0).robots, []);
});

test("a person just seen has a still ring of the rule's radius", () => {
  const scene = readPerson({ ...person(), receivedAtMs: 0 }, 800);
  equal([scene.stage, scene.ringM], ["seen", 2]);
});

test("a remembered person's ring grows at walking speed up to six metres", () => {
  const left = { ...person({ stage: "remembered", age_s: 1.32, radius_m: 3.6 }) };
  near(readPerson({ ...left, receivedAtMs: 0 }, 0).ringM, 3.6);
  near(readPerson({ ...left, receivedAtMs: 0 }, 1000).ringM, 5.2);
  near(readPerson({ ...left, receivedAtMs: 0 }, 5000).ringM, 6);
});

test("without news a seen person becomes remembered, then last seen", () => {
  const alone = { ...person({ age_s: 0 }), receivedAtMs: 0 };
  const stages = [900, 1100, 10_100].map((ms) => readPerson(alone, ms).stage);
  equal(stages, ["seen", "remembered", "last_seen"]);
});

test("a ring that the server drew wider than six metres is not made smaller", () => {
  const wide = person({ stage: "remembered", age_s: 9, radius_m: 7 });
  near(readPerson({ ...wide, receivedAtMs: 0 }, 500).ringM, 7);
});

test("somebody whose place was seen to be empty has no ring that grows", () => {
  const checked = person({ stage: "remembered", age_s: 3, radius_m: null });

  const scene = readPerson({ ...checked, receivedAtMs: 0 }, 5000);

  equal([scene.stage, scene.ringM], ["last_seen", 0]);
});

test("a stop that nobody confirmed widens with the last known speed", () => {
  const stop = command({
    state: "UNCONFIRMED",
    robot: { v: -0.5, report_age_s: 1, moved_m: 0.4 },
  });
  const store = storeOf({ robots: [robot({ stop })], commands: [stop] });
  near(readScene(store, 2000).robots[0].unsureM, 1.4);
});

test("a robot that drives on widens by its newest word, not by that of the last step", () => {
  const step = command({
    state: "STILL_MOVING",
    robot: { v: 0.5, report_age_s: 0, moved_m: 0 },
  });
  const store = storeOf({ robots: [robot({ stop: step })], commands: [step] });
  const newest = { ...step, robot: { v: 0.2, report_age_s: 0, moved_m: 0 } };
  store.apply("robots/AGI", robot({ stop: newest }), 1500);
  near(readScene(store, 2000).robots[0].unsureM, 0.1);
});

test("I12 a padlock is drawn from what a robot said just now alone", () => {
  const standing = situation({ level: "locked", state: "standing" });
  const store = storeOf({ robots: [robot({ situation: standing, age_s: 0 })] });
  const seen = [0, 1500, 1600, 60_000].map((ms) =>
    isSeenHeld(readScene(store, ms).robots[0]),
  );
  equal(seen, [true, true, false, false]);
  equal(isSeenHeld({ situation: situation(), ageS: 0 }), false);
  const ageS = Number.POSITIVE_INFINITY;
  equal(isSeenHeld({ situation: standing, ageS }), false);
});

test("a moving robot that is not heard has one at once, growing at its last speed", () => {
  const store = storeOf({
    robots: [robot({ twist: { linear: -0.8, angular: 0 }, age_s: 0 })],
  });
  const seen = [900, 1100, 4000, 60_000].map(
    (ms) => readScene(store, ms).robots[0].unsureM,
  );
  for (const [i, wanted] of [0, 0.88, 3.2, 0.8 * LIMITS.ring_lasts_s].entries())
    near(seen[i], wanted);
});

test("a robot that stood, and one of a recording, have none", () => {
  const still = { twist: { linear: 0.01, angular: 0 }, age_s: 0 };
  const played = { twist: { linear: 0.8, angular: 0 }, age_s: 0, replay: true };
  for (const one of [still, played])
    equal(readScene(storeOf({ robots: [robot(one)] }), 4000).robots[0].unsureM, 0);
});

test("a confirmed stop has no such disc", () => {
  const stop = command({
    state: "STANDING",
    robot: { v: 0, report_age_s: 0.1, moved_m: 0.4 },
  });
  const store = storeOf({ robots: [robot({ stop })], commands: [stop] });
  near(readScene(store, 900).robots[0].unsureM, 0);
});

test("an encounter ahead is drawn of a robot that is live alone", () => {
  const encounters = [ENCOUNTER];
  const store = storeOf({ robots: [robot({ encounters, age_s: 0 })] });
  equal(readScene(store, 500).robots[0].encounters, encounters);
  equal(readScene(store, 1100).robots[0].encounters, []);
});

test("a line leads from where a zone is met to the zone, and none from inside it", () => {
  equal(borderTowards({ x: 5, y: 1 }, { x: 1, y: 1 }, 2), { x: 3, y: 1 });
  equal(borderTowards({ x: 2, y: 1 }, { x: 1, y: 1 }, 2), null);
});

test("a sweep fades while late and is gone when lost", () => {
  const store = storeOf();
  const sweep = { robot_id: "AGI", stamp: "s", age_s: 0 };
  store.apply("robots/AGI/scan", { ...sweep, points: new Float32Array([1, 2]) }, 0);
  equal(readScene(store, 500).scans[0].strength, 1);
  equal(readScene(store, 2000).scans[0].strength < 1, true);
  equal(readScene(store, 3500).scans, []);
});

test("a box in the robot's frame turns with the robot, one in the map does not", () => {
  const store = storeOf({ robots: [robot({ pose: { x: 0, y: 0, yaw: 1.5 } })] });
  const sides = { xmin: 3, xmax: 3.4, ymin: -0.3, ymax: 0.3, zmin: 0, zmax: 1.8 };
  const box = { ...sides, frame_id: "base_link" };
  const items = [detection({ box }), detection()];
  store.apply("detections/AGI", { robot_id: "AGI", stamp: "s", items }, 0);
  const [turned, straight] = readScene(store, 100).detections;
  equal([turned.yaw, straight.yaw], [1.5, 0]);
  near(turned.length, 0.4);
});

test("a detection frame older than a second shows nothing", () => {
  const store = storeOf();
  const frame = { robot_id: "AGI", stamp: "s", items: [detection()] };
  store.apply("detections/AGI", frame, 0);
  equal(readScene(store, 1100).detections, []);
});

test("the veil falls a second after the line was lost", () => {
  const store = storeOf();
  store.setConnection("lost", 10_000);
  equal(readScene(store, 10_900).isVeiled, false);
  equal(readScene(store, 11_100).isVeiled, true);
});

test("13.3: one mark a person, and none after a minute", () => {
  const lost = { stage: "last_seen", peer: false, y: 0 };
  const at = (/** @type {number} */ x, /** @type {number} */ ageS) =>
    /** @type {any} */ ({ ...lost, x, ageS });
  const shown = marked([at(1, 50), at(1.4, 20), at(9, 59), at(5, 61)]);
  equal(
    shown.map(({ x }) => x),
    [1.4, 9],
  );
});

test("13.3: nobody who has a ring gives way to a mark", () => {
  const here = { peer: false, x: 0, y: 0 };
  const seen = /** @type {any} */ ({ ...here, stage: "seen", ageS: 0 });
  const other = /** @type {any} */ ({ ...here, x: 0.1, stage: "seen", ageS: 0 });
  const lost = /** @type {any} */ ({ ...here, stage: "last_seen", ageS: 12 });
  equal(marked([lost, seen, other]), [seen, other]);
});
