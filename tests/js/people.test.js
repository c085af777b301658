import { labelled } from "../../iveg/static/js/map/layers/people.js";
import { linesOf } from "../../iveg/static/js/panels/people.js";
import { person } from "./builders.js";
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

test("how sure it is that somebody is a person is told from two looks on", () => {
  const words = /** @type {any} */ ({
    t: (/** @type {string} */ key, /** @type {any} */ slots) =>
      key === "people.evidence" ? `${slots.looks} in ${slots.over} s` : key,
  });
  const told = (/** @type {number} */ looks) => {
    const evidence = { looks, least: 0.68, most: 0.75, over_s: 1.2, probability: 0.93 };
    return linesOf(person({ evidence }), words).filter((line) => line.includes(" in "));
  };
  equal([told(1), told(4)], [[], ["4 in 1.2 s"]]);
});
