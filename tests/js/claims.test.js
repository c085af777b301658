import { claim, mayStand } from "../../iveg/static/js/map/layers/claims.js";
import { laneNames } from "../../iveg/static/js/map/layers/greenhouse.js";
import { createPlaces } from "../../iveg/static/js/map/layers/places.js";
import { equal, test } from "./harness.js";

/** A frame of 20 × 20 m at 30 px a metre, its south-western corner at 0, 600. */
const frame = () =>
  /** @type {import("../../iveg/static/js/map/layers/paint.js").Paint} */ (
    /** @type {unknown} */ ({
      view: { scale: 30, x: 10, y: 10, width: 600, height: 600 },
      labels: { lane: (/** @type {string} */ label) => label },
      places: createPlaces(),
      scene: {
        map: { lanes: [{ label: "Pasillo 1", xmin: 0, ymin: 0, xmax: 2, ymax: 20 }] },
        people: [{ x: 10, y: 10 }],
        robots: [{ pose: { x: 15, y: 5, yaw: 0 }, length: 1, width: 0.6 }],
      },
    })
  );

test("13.19: words give way to an aisle's name, to figures and to robots", () => {
  const paint = frame();
  const at = (/** @type {number} */ x, /** @type {number} */ y) =>
    mayStand(paint, "1,4 m", x, y, 11);
  equal([at(30, 560), at(300, 300), at(450, 450)], [false, false, false]);
  equal([at(30, 100), at(300, 330), at(450, 500)], [true, true, true]);
});

test("a robot beside somebody keeps its place, too", () => {
  const paint = frame();
  paint.scene.robots[0].pose = { x: 10.5, y: 10, yaw: 0 };
  equal(mayStand(paint, "R1", 327, 300, 11), false);
});

test("28.7: an aisle's name gives way to a robot, and stays where it went", () => {
  const paint = frame();
  const [robot] = paint.scene.robots;
  const nameAt = (/** @type {number} */ y) => {
    robot.pose = { x: 1, y, yaw: 0 };
    return Math.round([...laneNames(paint)][0].y);
  };
  const [south, north] = [nameAt(10), nameAt(1)];
  equal([south > 500, north < 100], [true, true]);
  // The robot has left, and the name has no reason to move.
  equal([nameAt(10), nameAt(19), nameAt(10)], [north, south, south]);
});

test("13.19: of two words at one place the first one is written", () => {
  const paint = frame();
  equal(mayStand(paint, "recorrido", 400, 100, 11), true);
  equal(mayStand(paint, "farmer 75 %", 420, 104, 11), false);
  equal(mayStand(frame(), "farmer 75 %", 420, 104, 11), true);
});

test("words give way to no place that is out of sight", () => {
  const at = (/** @type {number} */ top) => ({
    left: 400,
    right: 460,
    top,
    bottom: top + 24,
  });
  const paint = frame();
  equal(claim(paint, [at(560)]), 0);
  equal(claim(paint, [at(570), at(590), at(520)]), 2);
  equal(claim(paint, [at(570), at(590)]), null);
});
