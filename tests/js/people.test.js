import { labelled } from "../../iveg/static/js/map/layers/people.js";
import { equal, test } from "./harness.js";

/** @param {object[]} people @param {number} [scale] */
const paint = (people, scale = 30) =>
  /** @type {import("../../iveg/static/js/map/layers/paint.js").Paint} */ (
    /** @type {unknown} */ ({ scene: { people }, view: { scale } })
  );
const who = (
  /** @type {number} */ ageS,
  /** @type {number} */ x,
  stage = "last_seen",
) => ({
  ageS,
  x,
  y: 0,
  stage,
});

test("of words that would lie on each other the newest stand", () => {
  const old = who(58, 1);
  const fresh = who(5, 2);
  const far = who(59, 9);
  equal(labelled(paint([old, fresh, far])), [fresh, far]);
});

test("from near everybody has words", () => {
  const people = [who(5, 1), who(60, 2)];
  equal(labelled(paint(people, 120)).length, 2);
});

test("who is seen now needs no age", () => {
  equal(labelled(paint([who(0, 1, "seen")])), []);
});
