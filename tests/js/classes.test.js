import { writtenOf } from "../../iveg/static/js/pages/classes.js";
import { equal, test } from "./harness.js";

/** @param {object} differs */
const rule = (differs) =>
  /** @type {import("../../iveg/static/js/core/protocol.js").Rule} */ ({
    id: "ring",
    version: 3,
    confidence_threshold: 0.8,
    radius_m: 2,
    factor: 0.5,
    ...differs,
  });

test("the names of the classes themselves are not words to change", () => {
  const aliases = { person: "person", robot: "robot", farmer: "person", agi: "robot" };
  const { aliases: found } = writtenOf(rule({ aliases }));
  equal(Object.entries(found), [
    ["agi", "robot"],
    ["farmer", "person"],
  ]);
});

test("a class without a threshold of its own has none", () => {
  equal(writtenOf(rule({})).class_thresholds, {});
  const written = writtenOf(rule({ class_thresholds: { person: 0.7000001 } }));
  equal(written.class_thresholds, { person: 0.7 });
});
