import { LIMITS } from "../../iveg/static/js/core/limits.js";
import { Store } from "../../iveg/static/js/core/store.js";
import { isSeenHeld } from "../../iveg/static/js/map/layers/tags.js";
import { readPerson, readScene } from "../../iveg/static/js/map/scene.js";
import { command, detection, person, robot, situation, snapshot } from "./builders.js";
import { equal, near, test } from "./harness.js";

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

test("a remembered person's zone grows at walking speed up to six metres", () => {
  const left = { ...person({ stage: "remembered", age_s: 1.32, radius_m: 3.6 }) };
  near(readPerson({ ...left, receivedAtMs: 0 }, 0).zoneM, 3.6);
  near(readPerson({ ...left, receivedAtMs: 0 }, 1000).zoneM, 5.2);
  near(readPerson({ ...left, receivedAtMs: 0 }, 5000).zoneM, 6);
});

test("without news a seen person becomes remembered, then last seen", () => {
  const alone = { ...person({ age_s: 0 }), receivedAtMs: 0 };
  const stages = [900, 1100, 10_100].map((ms) => readPerson(alone, ms).stage);
  equal(stages, ["seen", "remembered", "last_seen"]);
});

test("somebody whose place was seen to be empty has no zone that grows", () => {
  const checked = person({ stage: "remembered", age_s: 3, radius_m: null });

  const scene = readPerson({ ...checked, receivedAtMs: 0 }, 5000);

  equal([scene.stage, scene.zoneM], ["last_seen", 0]);
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
  const standing = situation({ level: "locked", kind: "locked", state: "standing" });
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
  for (const [i, wanted] of [0, 0.88, 3.2, 0.8 * LIMITS.zone_lasts_s].entries())
    near(seen[i], wanted);
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
