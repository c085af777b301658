import { loweringsOf } from "../../iveg/static/js/pages/lowering.js";
import { equal, test } from "./harness.js";
import { PARAMETERS } from "./rule_table.js";

const rule = /** @type {import("../../iveg/static/js/core/protocol.js").Rule} */ (
  /** @type {unknown} */ ({
    id: "fleet-alert",
    version: 3,
    confidence_threshold: 0.8,
    class_thresholds: {},
    radius_m: 2,
    class_radii_m: { robot: 3 },
    factor: 0.5,
    foresight: true,
    foresight_s: 3,
    aliases: { person: "person", farmer: "person", husky: "robot" },
  })
);

/** @param {import("../../iveg/static/js/pages/lowering.js").Change} change */
const keys = (change) =>
  loweringsOf(PARAMETERS, rule, change).map(({ key, slots }) =>
    [key, slots.class].filter(Boolean).join(" "),
  );

test("each way to lower protection is named", () => {
  equal(keys({ confidence_threshold: 0.9 }), [
    "lowering.threshold person",
    "lowering.threshold robot",
  ]);
  equal(keys({ class_thresholds: { person: 0.9 } }), ["lowering.threshold person"]);
  equal(keys({ class_thresholds: { robot: 0.9 } }), ["lowering.threshold robot"]);
  equal(keys({ radius_m: 1.5 }), ["lowering.radius person"]);
  equal(keys({ class_radii_m: {} }), ["lowering.radius robot"]);
  equal(keys({ aliases: { person: "person", husky: "robot" } }), ["lowering.words"]);
  equal(keys({ aliases: { ...rule.aliases, farmer: "robot" } }), ["lowering.words"]);
  equal(keys({ foresight: false }), ["lowering.foresight"]);
  equal(keys({ foresight_s: 2 }), ["lowering.foresight_s"]);
});

test("what protects as much or more asks for no second word", () => {
  equal(keys({}), []);
  equal(keys({ confidence_threshold: 0.7, radius_m: 2.5 }), []);
  equal(keys({ radius_m: 1, class_radii_m: { person: 2, robot: 3 } }), []);
  const more = /** @type {Record<string, "person" | "robot">} */ ({
    ...rule.aliases,
    worker: "person",
  });
  equal(keys({ aliases: more }), []);
});
