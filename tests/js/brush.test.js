import { installPaintHook } from "../../iveg/static/js/core/painthook.js";
import { createPainting } from "../../iveg/static/js/core/painting.js";
import { Store } from "../../iveg/static/js/core/store.js";
import { createBrush } from "../../iveg/static/js/map/brush.js";
import { createFrames } from "../../iveg/static/js/map/frames.js";
import { createMap } from "../../iveg/static/js/map/map.js";
import { createPacker, createUnpacker } from "../../iveg/static/js/map/parcel.js";
import { person, robot, snapshot } from "./builders.js";
import { equal, test } from "./harness.js";

/** @typedef {import("../../iveg/static/js/map/brush.js").Brush} Brush */
/** @typedef {import("../../iveg/static/js/map/picture.js").Picture} Picture */

const SIZE = [400, 300];

/** A canvas of 400 × 300 px on the page. */
function canvasOnPage() {
  const canvas = document.createElement("canvas");
  Object.assign(canvas.style, { width: `${SIZE[0]}px`, height: `${SIZE[1]}px` });
  document.body.append(canvas);
  return canvas;
}

/** A greenhouse with somebody in it, and who looks, has looked, and has driven. */
function storeOfAGreenhouse() {
  const store = new Store();
  const navigation = { task: "", goal: { x: 8, y: 8 }, path: /** @type {any} */ ([]) };
  store.apply(
    "snapshot",
    snapshot({ robots: [robot({ navigation })], people: [person()] }),
  );
  const points = new Float32Array([17, 9, 17.5, 9, 12, 4]);
  store.apply("robots/AGI/scan", { robot_id: "AGI", stamp: "s", age_s: 0, points });
  return store;
}

/** Drives the robot of the greenhouse a metre. @param {Store} store */
function drive(store) {
  for (const x of [1.2, 1.4, 1.6, 1.8, 2]) {
    store.apply("robots/AGI", robot({ pose: { x, y: 2, yaw: 0 } }));
  }
}

/** What is on a canvas, whoever draws there. @param {HTMLCanvasElement} canvas */
function pixelsOf(canvas) {
  const copy = new OffscreenCanvas(SIZE[0], SIZE[1]);
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (copy.getContext("2d"));
  ctx.drawImage(canvas, 0, 0, SIZE[0], SIZE[1]);
  return ctx.getImageData(0, 0, SIZE[0], SIZE[1]).data;
}

/** Polls until something holds. @param {() => boolean} holds */
async function until(holds) {
  for (const endMs = performance.now() + 10_000; !holds(); ) {
    if (performance.now() > endMs) throw new Error("it never came to hold");
    await new Promise((done) => setTimeout(done, 20));
  }
}

/** The share of pixels that two canvases show differently. @param {HTMLCanvasElement} one
 * @param {HTMLCanvasElement} other */
function difference(one, other) {
  const [a, b] = [pixelsOf(one), pixelsOf(other)];
  let differing = 0;
  for (let i = 0; i < a.length; i += 4) {
    if (Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) > 60) differing += 1;
  }
  return differing / (a.length / 4);
}

/** @param {HTMLCanvasElement} canvas */
const isBlank = (canvas) => pixelsOf(canvas).every((value) => value === 0);

test("a worker draws what this thread would", async () => {
  document.body.replaceChildren();
  const [here, there] = [canvasOnPage(), canvasOnPage()];
  const store = storeOfAGreenhouse();
  const options = { storage: null, now: () => 1000 };
  const maps = [
    createMap(here, store, options),
    createMap(there, store, { ...options, brush: createBrush(there) }),
  ];
  drive(store);
  await until(() => !isBlank(there) && difference(here, there) < 0.01);
  throwsAsTaken(there);
  for (const map of maps) map.destroy();
});

/** Nobody but a worker can have drawn there. @param {HTMLCanvasElement} canvas */
function throwsAsTaken(canvas) {
  let isTaken = false;
  try {
    canvas.getContext("2d");
  } catch {
    isTaken = true;
  }
  equal(isTaken, true);
}

test("what a worker has drawn is told with its stamp, and once", async () => {
  document.body.replaceChildren();
  const canvas = canvasOnPage();
  const store = storeOfAGreenhouse();
  const map = createMap(canvas, store, { storage: null, brush: createBrush(canvas) });
  const end = installPaintHook(store, map);
  /** @type {string[]} */
  const stamps = [];
  /** @type {any} */ (globalThis).__onPaint = (/** @type {any} */ it) =>
    stamps.push(it.stamp);
  store.apply("robots/AGI", robot({ stamp: "of the robot" }));
  await until(() => stamps.length > 0);
  store.apply("robots/AGI", robot({ stamp: "of the robot", mode: "SLOW" }));
  await new Promise((done) => map.afterDrawn(() => done(null)));
  equal(stamps, ["of the robot"]);
  end();
  map.destroy();
});

test("where no worker comes up this thread draws", async () => {
  document.body.replaceChildren();
  const canvas = canvasOnPage();
  const real = globalThis.Worker;
  globalThis.Worker = /** @type {any} */ (
    class extends EventTarget {
      constructor() {
        super();
        setTimeout(() => this.dispatchEvent(new Event("error")), 50);
      }
      postMessage() {}
      terminate() {}
    }
  );
  const complaints = quietly();
  try {
    const brush = createBrush(canvas);
    const map = createMap(canvas, storeOfAGreenhouse(), { storage: null, brush });
    await until(() => !isBlank(canvas));
    map.destroy();
  } finally {
    globalThis.Worker = real;
    complaints.end();
  }
  equal(complaints.count(), 1);
});

/** Counts what is reported as an error, and keeps it from the page. */
function quietly() {
  let count = 0;
  const real = globalThis.reportError;
  globalThis.reportError = () => {
    count += 1;
  };
  return {
    count: () => count,
    end() {
      globalThis.reportError = real;
    },
  };
}

/** A brush whose pictures get drawn when the test says so. */
function brushByHand() {
  /** @type {import("../../iveg/static/js/map/brush.js").WhenDrawn[]} */
  const drawing = [];
  /** @type {Brush} */
  const brush = {
    trails: { add() {}, keepOnly() {} },
    soon: (compose) => compose(),
    draw: (_, whenDrawn) => void drawing.push(whenDrawn),
    end() {},
  };
  return { brush, drawing };
}

test("who asks is told when what it knew is on the canvas, not before", () => {
  const { brush, drawing } = brushByHand();
  const frames = createFrames(brush, () => /** @type {Picture} */ ({}));
  const told = { count: 0 };
  frames.ask();
  frames.afterDrawn(() => {
    told.count += 1;
  });
  drawing[0](0, 0);
  equal(told.count, 0);
  drawing[1](0, 0);
  drawing[1](0, 0);
  equal(told.count, 1);
});

test("a picture that was overtaken tells of itself by the one that overtook it", () => {
  const { brush, drawing } = brushByHand();
  const frames = createFrames(brush, () => /** @type {Picture} */ ({}));
  let told = 0;
  frames.afterDrawn(() => {
    told += 1;
  });
  frames.ask();
  drawing[1](0, 0);
  equal(told, 1);
});

test("a page without a map has painted in its next frame", async () => {
  const painting = createPainting();
  await new Promise((done) => painting.when(() => done(null)));
  const late = { count: 0 };
  painting.follow({ afterDrawn() {} });
  painting.when(() => {
    late.count += 1;
  });
  await until(() => late.count === 1);
});

/** @param {Partial<Picture["scene"]>} changes @returns {Picture} */
function pictureOf(changes) {
  const path = /** @type {[number, number][]} */ ([[1, 2]]);
  const scene = {
    ...{ nowMs: 1, map: { name: "house" }, isVeiled: false, people: [] },
    ...{ robots: [{ id: "AGI", slot: 1, path }], costmap: null, coverage: null },
    detections: [{ id: "AGI/0", item: { class_id: "farmer", received_at: null } }],
    scans: [{ robotId: "AGI", slot: 1, strength: 1, points: new Float32Array([1, 2]) }],
    ...changes,
  };
  return /** @type {any} */ ({ view: {}, theme: { bg: "red" }, labels: {}, scene });
}

test("a parcel tells what is large once, and the worker keeps it the same", () => {
  const [packer, unpacker] = [createPacker(), createUnpacker()];
  const picture = pictureOf({});
  const first = packer.pack(picture);
  const again = packer.pack({ ...picture, scene: { ...picture.scene, nowMs: 2 } });
  equal(Object.keys(first.news).sort(), [
    ...["coverage", "costmap", "map", "path/AGI", "scan/AGI", "theme"].sort(),
  ]);
  equal(again.news, {});
  const one = unpacker.open(structuredClone(first));
  const other = unpacker.open(structuredClone(again));
  equal(one.scene.map === other.scene.map, true);
  equal(one.theme === other.theme, true);
  equal(one.scene.scans[0].points === other.scene.scans[0].points, true);
  equal(other.scene.robots[0].path, [[1, 2]]);
  equal(other.scene.nowMs, 2);
  equal(other.scene.detections[0].item.class_id, "farmer");
});

test("a parcel tells anew what has become another", () => {
  const [packer, unpacker] = [createPacker(), createUnpacker()];
  unpacker.open(packer.pack(pictureOf({})));
  const points = new Float32Array([3, 4]);
  const scans = [{ robotId: "AGI", slot: 1, strength: 0.35, points }];
  const last = unpacker.open(packer.pack(pictureOf({ scans, robots: [], map: null })));
  equal([...last.scene.scans[0].points], [3, 4]);
  equal([last.scene.map, last.scene.robots], [null, []]);
});
