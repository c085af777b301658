import { ageOf } from "../../iveg/static/js/core/clock.js";
import { PastStore } from "../../iveg/static/js/core/past_store.js";
import { equal, near, test } from "./harness.js";

/** @param {number} at_s @param {number} x */
const world = (at_s, x) =>
  /** @type {any} */ ({
    at_s,
    left_out: [],
    robots: [
      {
        robot_id: "AGI",
        received_at: new Date(1000 * at_s).toISOString(),
        age_s: 0.3,
        pose: { x },
      },
    ],
    people: [],
    detections: {},
    scans: [{ robot_id: "AGI", stamp: null, points: [[1, 2]] }],
    alerts: [],
    log: [],
    climate: null,
  });

test("the past goes back as well as on, though the present would call that old", () => {
  const past = new PastStore();
  for (const [at, x] of [
    [100, 1],
    [110, 2],
    [90, 3],
  ]) {
    past.take(world(at, x));
    equal(past.store.robots().get("AGI")?.pose?.x, x);
  }
  equal([...(past.store.scans().get("AGI")?.points ?? [])], [1, 2]);
});

test("what stands still grows no older, and says where it may differ", () => {
  const past = new PastStore();
  past.take(world(100, 1));
  const robot = past.store.robots().get("AGI");
  if (robot) robot.receivedAtMs = performance.now() - 5000;

  past.freshen();

  near(ageOf(past.store.robots().get("AGI")), 0.3, 0.2);
  equal(past.leftOut, []);
  past.take({ ...world(101, 1), left_out: ["moods"] });
  equal(past.leftOut, ["moods"]);
});
