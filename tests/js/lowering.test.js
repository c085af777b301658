import {
  foreseen,
  loweringsOf,
  sightingsLost,
} from "../../iveg/static/js/pages/lowering.js";
import { equal, test } from "./harness.js";

const rule = /** @type {import("../../iveg/static/js/core/protocol.js").Rule} */ (
  /** @type {unknown} */ ({
    id: "fleet-alert",
    version: 3,
    confidence_threshold: 0.8,
    class_thresholds: {},
    radius_m: 2,
    factor: 0.5,
    foresight: true,
    foresight_s: 3,
    aliases: { person: "person", farmer: "person", husky: "robot" },
  })
);

/** @param {import("../../iveg/static/js/pages/lowering.js").Change} change */
const keys = (change) => loweringsOf(rule, change).map(({ key }) => key);

test("13.14 each way to lower protection is named", () => {
  equal(keys({ confidence_threshold: 0.9 }), ["lowering.threshold"]);
  equal(keys({ class_thresholds: { person: 0.9 } }), ["lowering.threshold"]);
  equal(keys({ radius_m: 1.5 }), ["lowering.radius"]);
  equal(keys({ aliases: { person: "person", husky: "robot" } }), ["lowering.words"]);
  equal(keys({ aliases: { ...rule.aliases, farmer: "robot" } }), ["lowering.words"]);
  equal(keys({ foresight: false, foresight_s: 1 }), ["lowering.foresight"]);
  equal(keys({ foresight_s: 2 }), ["lowering.horizon"]);
});

test("13.14 what protects as much or more asks for no second word", () => {
  equal(keys({}), []);
  equal(keys({ confidence_threshold: 0.7, radius_m: 2.5 }), []);
  equal(keys({ class_thresholds: { robot: 0.95 } }), []);
  const more = /** @type {Record<string, "person" | "robot">} */ ({
    ...rule.aliases,
    worker: "person",
  });
  equal(keys({ aliases: more }), []);
});

test("13.14 of today's sightings it is told how many would no longer count", () => {
  const seen = [0.75, 0.8, 0.85, 0.89, 0.9, 0.97].map((probability) => ({
    probability,
  }));
  equal(sightingsLost(seen, 0.8, 0.9), { count: 3, total: 5 });
});

test("what foresight did is told of the encounters of the day", () => {
  const met = { count: 6, slowed: 6, foretold: 4, foretold_s: 1.25 };
  equal(foreseen(met), { count: 4, total: 6, seconds: 1.25 });
  const none = { count: 2, slowed: 1, foretold: 0, foretold_s: null };
  equal(foreseen(none), { count: 0, total: 2, seconds: 0 });
});
