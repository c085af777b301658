import { drawDecision, sceneOf } from "../../iveg/static/js/panels/decision_map.js";
import { equal, test } from "./harness.js";

const words = /** @type {any} */ ({ t: (/** @type {string} */ key) => key });
const decision = /** @type {any} */ ({
  robot_id: "AGII",
  observer: "AGI",
  class: "person",
  in_sight: false,
  distance_m: 1.43,
  confidence: 0.94,
  position: { x: 4, y: 5, z: 0.9 },
  rule: { parameters: { ring_m: 2.5 } },
  places: [
    { robot_id: "AGII", x: 5, y: 6, yaw: 1 },
    { robot_id: "AGI", x: 2, y: 5, yaw: 0 },
  ],
});

test("13.13: the picture shows who was where, by the record alone", () => {
  const scene = sceneOf(decision, null);
  equal(
    scene?.robots.map(({ id, pose }) => [id, pose.x]),
    [
      ["AGII", 5],
      ["AGI", 2],
    ],
  );
  equal([scene?.people[0].ringM, scene?.people[0].observers], [2.5, ["AGI"]]);
  equal(scene?.people[0].acting[0].in_sight, false);
});

test("13.13: a decision without a place has no picture, one with a place has one", () => {
  equal(drawDecision({ ...decision, position: null }, null, words), null);
  equal(drawDecision(decision, null, words)?.width !== 0, true);
});
