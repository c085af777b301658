import { createGround } from "../../iveg/static/js/map/layers/ground.js";
import { createScanLayer } from "../../iveg/static/js/map/layers/scan.js";
import { equal, test } from "./harness.js";

/** @typedef {import("../../iveg/static/js/map/layers/paint.js").Paint} Paint */

const VIEW = { width: 100, height: 80, scale: 10, x: 0, y: 0 };

/** @param {number[][]} scans points of each (m) @param {number} [nowMs] */
function sceneOf(scans, nowMs = 0) {
  return {
    ...{ nowMs, robots: [], map: null, coverage: null, costmap: null },
    scans: scans.map((points, i) => ({
      ...{ robotId: `R${i}`, slot: 1, strength: 1 },
      points: new Float32Array(points),
    })),
  };
}

/** The rectangles that a layer fills. @param {number[][]} scans @param {number} [ratio] */
function filled(scans, ratio = 1) {
  /** @type {number[][]} */
  const rectangles = [];
  const ctx = {
    ...{ save() {}, restore() {}, setTransform() {} },
    fillRect: (/** @type {number[]} */ ...rectangle) => rectangles.push(rectangle),
  };
  const theme = { robots: ["red"] };
  const paint = { ctx, view: VIEW, theme, scene: sceneOf(scans), ratio };
  createScanLayer()(/** @type {any} */ (paint));
  return rectangles;
}

test("a point of a scan is a square of whole device pixels about its place", () => {
  equal(filled([[1, 2]]), [[59, 19, 2, 2]]);
  equal(filled([[1.03, 2.04]]), [[59, 19, 2, 2]]);
  equal(filled([[1, 2]], 2), [[118, 38, 4, 4]]);
  equal(filled([[1, 2]], 1.5), [[89, 29, 3, 3]]);
});

test("of points of a scan that fall together one is drawn", () => {
  equal(filled([[1, 2, 1.01, 2.02, 1.04, 1.97]]).length, 1);
  equal(filled([[1, 2, 1.2, 2]]).length, 2);
});

test("a wall that beams hit everywhere has no gap", () => {
  const wall = Array.from({ length: 400 }, (_, i) => [-4 + i / 50, 1]).flat();
  const drawn = filled([wall]);
  const columns = new Set(drawn.flatMap(([x, , size]) => [x, x + size - 1]));
  const across = Math.max(...columns) - Math.min(...columns) + 1;
  equal([drawn.length <= 41, across >= 80, columns.size], [true, true, across]);
});

test("each robot's points are drawn, also where another one's are", () => {
  const one = [1, 2];
  equal(filled([one, one]).length, 2);
});

test("points outside the view are not drawn", () => {
  equal(filled([[-6, 0, 6, 0, 0, 5, 0, -5, 4.9, 0]]).length, 1);
});

/** A ground whose redrawing is counted, with trails of so many steps. */
function countedGround() {
  const told = { redrawn: 0, steps: 0 };
  const still = { image: () => new OffscreenCanvas(100, 80) };
  /** @type {import("../../iveg/static/js/map/layers/ground.js").Layer[]} */
  const layers = [
    [
      "scan",
      () => {
        told.redrawn += 1;
      },
    ],
  ];
  const ground = createGround(
    still,
    layers,
    () => [],
    () => told.steps,
  );
  /** @param {number[][]} scans @param {number} nowMs */
  function update(scans, nowMs, view = VIEW) {
    const scene = sceneOf(scans, nowMs);
    const paint = { view, theme: null, labels: null, scene };
    return ground.update(/** @type {any} */ (paint), 1, () => true);
  }
  return { told, update };
}

test("what lies under the robots waits for its turn, scan or step", () => {
  const { told, update } = countedGround();
  equal([update([[1, 2]], 1000), told.redrawn], [0, 1]);
  equal([update([[1, 3]], 1016), told.redrawn], [50, 1]);
  told.steps += 1;
  equal([update([[1, 3]], 1033), told.redrawn], [33, 1]);
  equal([update([[1, 3]], 1066), told.redrawn], [0, 2]);
});

test("what lies under the robots is drawn at once for another view", () => {
  const { told, update } = countedGround();
  update([[1, 2]], 1000);
  equal([update([[1, 2]], 1016, { ...VIEW, x: 1 }), told.redrawn], [0, 2]);
});
