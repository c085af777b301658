import { createGround } from "../../iveg/static/js/map/layers/ground.js";
import { createPlaces } from "../../iveg/static/js/map/layers/places.js";
import { createScanLayer } from "../../iveg/static/js/map/layers/scan.js";
import { createStaticImage } from "../../iveg/static/js/map/layers/static.js";
import { equal, test } from "./harness.js";

/** @typedef {import("../../iveg/static/js/map/layers/paint.js").Paint} Paint */

const VIEW = { width: 100, height: 80, scale: 10, x: 0, y: 0 };

/** @param {number[][]} scans points of each (m) @param {number} [nowMs] */
function sceneOf(scans, nowMs = 0) {
  return {
    ...{ nowMs, robots: [], map: null, coverage: null, costmap: null, tiles: [] },
    ...{ people: [], detections: [] },
    scans: scans.map((points, i) => ({
      ...{ robotId: `R${i}`, slot: i + 1, strength: 1 },
      points: new Float32Array(points),
    })),
  };
}

/**
 * The pixels that a layer colours, by row.
 *
 * @param {number[][]} scans
 * @param {{ratio?: number, strength?: number}} [how]
 */
function coloured(scans, { ratio = 1, strength = 1 } = {}) {
  const [width, height] = [VIEW.width * ratio, VIEW.height * ratio];
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
    new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true })
  );
  const scene = sceneOf(scans);
  for (const scan of scene.scans) scan.strength = strength;
  const theme = { robots: ["#f00", "rgb(0 0 255)"] };
  createScanLayer()(/** @type {any} */ ({ ctx, view: VIEW, theme, scene, ratio }));
  const { data } = ctx.getImageData(0, 0, width, height);
  /** @type {{x: number, y: number, red: boolean, alpha: number}[]} */
  const found = [];
  for (let i = 0; i < data.length; i += 4) {
    const [x, y] = [(i / 4) % width, Math.floor(i / 4 / width)];
    const red = data[i] > data[i + 2];
    if (data[i + 3]) found.push({ x, y, red, alpha: data[i + 3] });
  }
  return found;
}

/** @param {number[][]} scans @param {number} [ratio] */
const placesOf = (scans, ratio) =>
  coloured(scans, { ratio }).map(({ x, y }) => [x, y].join());

test("a point of a scan is a square of whole device pixels about its place", () => {
  const square = ["59,19", "60,19", "59,20", "60,20"];
  equal(placesOf([[1, 2]]), square);
  equal(placesOf([[1.03, 2.04]]), square);
  const large = placesOf([[1, 2]], 2);
  equal([large.length, large[0], large[15]], [16, "118,38", "121,41"]);
});

test("points outside the view are not drawn, nor at its other side", () => {
  equal(placesOf([[-6, 0, 6, 0, 0, 5, 0, -5, 5, 0, 0, -4, Number.NaN, 0]]), []);
  equal(placesOf([[4.9, 0]]).length, 4);
});

test("each robot has its own hue, and what it saw last second is fainter", () => {
  const both = [
    [1, 2],
    [3, 2],
  ];
  equal(
    coloured(both).map(({ red }) => red),
    [true, true, false, false, true, true, false, false],
  );
  const [fresh, late] = [1, 0.35].map((strength) => coloured(both, { strength })[0]);
  equal([fresh.alpha, late.alpha], [217, 76]);
});

test("a scan is drawn in place of the one before", () => {
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
    new OffscreenCanvas(VIEW.width, VIEW.height).getContext("2d", {
      willReadFrequently: true,
    })
  );
  const layer = createScanLayer();
  const theme = { robots: ["#f00"] };
  for (const points of [
    [1, 2],
    [-1, -2],
  ]) {
    ctx.clearRect(0, 0, VIEW.width, VIEW.height);
    layer(/** @type {any} */ ({ ctx, view: VIEW, theme, scene: sceneOf([points]) }));
  }
  const at = (/** @type {number} */ x, /** @type {number} */ y) =>
    ctx.getImageData(x, y, 1, 1).data[3] > 0;
  equal([at(60, 20), at(40, 60)], [false, true]);
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
  /** @param {number[][]} scans @param {number} nowMs @param {object} [known] */
  function update(scans, nowMs, view = VIEW, known = {}) {
    const scene = { ...sceneOf(scans, nowMs), ...known };
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

/** A robot at a place, with nothing to do. @param {number} x */
const robotAt = (x) => {
  const [pose, path, encounters] = [{ x, y: 0, yaw: 0 }, nothing, nothing];
  return { id: "AGI", link: "LIVE", pose, goal: null, path, task: null, encounters };
};
/** @type {never[]} */
const nothing = [];

test("detections, people and plans are drawn anew with the scans, when they change", () => {
  const { told, update } = countedGround();
  const item = { class_id: "farmer" };
  const person = { x: 1, y: 2, stage: "seen", observers: nothing, acting: nothing };
  const robots = [robotAt(1)];
  let nowMs = 1100;
  /** @param {object} known */
  const drawnFor = (known) => {
    // Trails fade by their own clock, four times a second.
    nowMs += 1000;
    told.redrawn = 0;
    update([], nowMs - 70, VIEW, { robots });
    told.redrawn = 0;
    update([], nowMs, VIEW, { robots, ...known });
    return told.redrawn;
  };
  equal([drawnFor({}), drawnFor({ robots: [robotAt(1.01)] })], [0, 0]);
  equal([drawnFor({ detections: [{ item }] }), drawnFor({ people: [person] })], [1, 1]);
  equal(drawnFor({ robots: [{ ...robotAt(1), encounters: [{}] }] }), 1);
  equal(drawnFor({ robots: [{ ...robotAt(1), link: "LOST" }] }), 1);
});

test("a link to somebody follows its robot, as often as scans are drawn", () => {
  const { told, update } = countedGround();
  const people = [{ x: 1, y: 2, stage: "seen", observers: ["AGI"], acting: nothing }];
  const drawnAt = (/** @type {number} */ x, /** @type {number} */ nowMs) =>
    update([], nowMs, VIEW, { people, robots: [robotAt(x)] });
  equal([drawnAt(1, 1000), drawnAt(1.01, 1016)], [0, 50]);
  equal([drawnAt(1.02, 1066), told.redrawn], [0, 2]);
});

test("words under the robots keep their places until they are drawn again", () => {
  const rect = { left: 10, right: 40, top: 20, bottom: 30 };
  const still = { image: () => new OffscreenCanvas(100, 80) };
  const words = (/** @type {Paint} */ paint) => void paint.places?.claim([rect]);
  const ground = createGround(
    still,
    [["intent", words]],
    () => [],
    () => 0,
  );
  const free = [1000, 1016].map((nowMs) => {
    const places = createPlaces();
    const paint = { view: VIEW, theme: null, labels: null, scene: sceneOf([], nowMs) };
    ground.update(/** @type {any} */ ({ ...paint, places }), 1, () => true);
    return places.claim([rect]);
  });
  equal(free, [null, null]);
});

test("the static image is drawn for what is known, and once a second for its age", () => {
  const told = { drawn: 0 };
  /** @type {import("../../iveg/static/js/map/layers/static.js").StaticLayer} */
  const layer = [
    "coverage",
    () => {
      told.drawn += 1;
    },
  ];
  const still = createStaticImage([layer]);
  const theme = { bg: "#fff" };
  /** @param {number} nowMs @param {object} [known] */
  function drawnAt(nowMs, known = {}) {
    const scene = { ...sceneOf([], nowMs), ...known };
    const paint = { view: VIEW, theme, labels: null, scene };
    still.image(/** @type {any} */ (paint), 1, () => true);
    return told.drawn;
  }
  const coverage = { lanes: [] };
  equal([drawnAt(0), drawnAt(5000)], [1, 1]);
  equal([drawnAt(5000, { coverage }), drawnAt(5900, { coverage })], [2, 2]);
  equal([drawnAt(6000, { coverage }), drawnAt(6000, { costmap: {} })], [3, 4]);
});
