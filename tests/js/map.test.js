import { installPaintHook } from "../../iveg/static/js/core/painthook.js";
import { Store } from "../../iveg/static/js/core/store.js";
import { coverOf } from "../../iveg/static/js/map/layers/scalebar.js";
import { createMap } from "../../iveg/static/js/map/map.js";
import { screenX, screenY } from "../../iveg/static/js/map/viewport.js";
import { detection, person, robot, STAMP, snapshot } from "./builders.js";
import { equal, near, test } from "./harness.js";

/** A map of 600 × 400 px on the page, its store, and what it said it painted. */
function mapOnPage(options = {}) {
  const canvas = document.createElement("canvas");
  canvas.style.width = "600px";
  canvas.style.height = "400px";
  document.body.replaceChildren(canvas);
  const store = new Store();
  const map = createMap(canvas, store, { storage: null, ...options });
  installPaintHook(store, map);
  /** @type {{robot: string, kind: string, stamp: string}[]} */
  const painted = [];
  /** @type {any} */ (globalThis).__onPaint = (/** @type {any} */ it) =>
    painted.push(it);
  return { canvas, store, map, painted };
}

const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));

/** Sizes are told after a frame, and drawn in the next. */
async function settled() {
  await frame();
  await frame();
}

/** The whole picture. @param {HTMLCanvasElement} canvas */
function fingerprint(canvas) {
  return canvas.toDataURL();
}

/**
 * @param {HTMLElement} target
 * @param {string} type
 * @param {number} x (px)
 * @param {number} y (px)
 * @param {number} [pointerId] 1 is the mouse
 */
function point(target, type, x, y, pointerId = 1) {
  const { left, top } = target.getBoundingClientRect();
  const place = { clientX: left + x, clientY: top + y, pointerId, bubbles: true };
  target.dispatchEvent(new PointerEvent(type, place));
}

test("a message is painted in the next frame and told with its own stamp", async () => {
  const { store, map, painted } = mapOnPage();
  store.apply("snapshot", snapshot());
  await frame();
  painted.length = 0;
  store.apply("robots/AGI", robot({ stamp: "odd stamp 1" }));
  const points = new Float32Array([1, 2]);
  const sweep = { robot_id: "AGI", stamp: "s2", age_s: 0, points };
  store.apply("robots/AGI/scan", sweep);
  const items = [detection()];
  const look = { robot_id: "AGI", stamp: "s3", items };
  store.apply("detections/AGI", look);
  equal(painted, []);
  await frame();
  equal(painted, [
    { robot: "AGI", kind: "odom", stamp: "odd stamp 1" },
    { robot: "AGI", kind: "lidar", stamp: "s2" },
    { robot: "AGI", kind: "detection", stamp: "s3" },
  ]);
  map.destroy();
});

/** @param {string} robot_id @param {string} stamp @param {number} count of points */
function sweepOf(robot_id, stamp, count) {
  const points = Float32Array.from({ length: 2 * count }, (_, i) => i % 10);
  return { robot_id, stamp, age_s: 0, points };
}

test("scans of a fleet are drawn together, and told when they are", async () => {
  let nowMs = 1000;
  const { store, map, painted } = mapOnPage({ now: () => nowMs });
  store.apply("snapshot", snapshot());
  store.apply("robots/AGI/scan", sweepOf("AGI", "s1", 5000));
  await settled();
  painted.length = 0;
  store.apply("robots/AGI/scan", sweepOf("AGI", "s2", 5000));
  store.apply("robots/AGI", robot({ stamp: "o2" }));
  await frame();
  store.apply("robots/AGI/scan", sweepOf("AGI", "s3", 5000));
  await frame();
  equal(painted, [{ robot: "AGI", kind: "odom", stamp: "o2" }]);
  nowMs += 66;
  await new Promise((done) => setTimeout(done, 150));
  equal(painted[1], { robot: "AGI", kind: "lidar", stamp: "s3" });
  equal(painted.length, 2);
  map.destroy();
});

test("what lies under a robot is not drawn again because it moves", async () => {
  const { store, map } = mapOnPage();
  store.apply("snapshot", snapshot());
  store.apply("robots/AGI/scan", sweepOf("AGI", "s1", 100));
  await settled();
  const real = CanvasRenderingContext2D.prototype.fillRect;
  let rectangles = 0;
  CanvasRenderingContext2D.prototype.fillRect = function (...place) {
    rectangles += 1;
    return real.apply(this, place);
  };
  try {
    for (const step of [1, 2, 3, 4, 5]) {
      const pose = { x: 1 + 0.01 * step, y: 2, yaw: 0 };
      store.apply("robots/AGI", robot({ stamp: `o${step}`, pose }));
      await frame();
    }
  } finally {
    CanvasRenderingContext2D.prototype.fillRect = real;
  }
  equal(rectangles < 300, true);
  map.destroy();
});

test("while no script listens for painting, nobody watches for it", () => {
  let watching = 0;
  const watch = () => {
    watching += 1;
    return () => {
      watching -= 1;
    };
  };
  const page = /** @type {any} */ (globalThis);
  delete page.__onPaint;
  const end = installPaintHook({ watch }, { onDrawn: watch });
  const counts = [watching];
  for (const listener of [() => {}, () => {}, undefined]) {
    page.__onPaint = listener;
    counts.push(watching);
  }
  end();
  equal(counts, [0, 2, 2, 0]);
  equal("__onPaint" in page, false);
});

test("a stamp that was painted is not told again", async () => {
  const { store, map, painted } = mapOnPage();
  store.apply("snapshot", snapshot());
  await frame();
  store.apply("robots/AGI", robot({ mode: "SLOW" }));
  await frame();
  equal(painted, [{ robot: "AGI", kind: "odom", stamp: STAMP }]);
  map.destroy();
});

test("a map opens with the whole greenhouse in view, above the bar of its scale", async () => {
  const { store, map } = mapOnPage();
  store.apply("snapshot", snapshot());
  await frame();
  const { scale, x } = map.view();
  equal(x, 10);
  equal(20 * scale <= 600 && 10 * scale <= 400 && 20 * scale > 450, true);
  equal(screenY(map.view(), 10) >= 0, true);
  equal(screenY(map.view(), 0) <= coverOf({ height: 400 }).top, true);
  map.destroy();
});

test("the greenhouse lies beside tools that grow, until it is moved", async () => {
  const { canvas, store, map } = mapOnPage();
  map.destroy();
  const tools = document.createElement("div");
  tools.dataset.overMap = "";
  document.body.append(tools);
  const { left, top } = canvas.getBoundingClientRect();
  /** Down the right edge. @param {number} width (px) */
  const widen = (width) => {
    const place = {
      left: `${left + 600 - width}px`,
      top: `${top}px`,
      width: `${width}px`,
    };
    Object.assign(tools.style, { position: "absolute", height: "300px", ...place });
    return settled();
  };
  await widen(60);
  const again = createMap(canvas, store, { storage: null });
  const edge = () => screenX(again.view(), 20);
  store.apply("snapshot", snapshot());
  await settled();
  near(edge(), 600 - 60 - 8);

  await widen(150);
  near(edge(), 600 - 150 - 8);

  again.zoomBy(1);
  const moved = edge();
  await widen(170);
  near(edge(), moved);
  again.fit();
  near(edge(), 600 - 170 - 8);
  again.destroy();
});

test("every layer shows, and its switch takes it off the picture", async () => {
  const { canvas, store, map } = mapOnPage();
  const navigation = { task: "", goal: { x: 8, y: 8 }, path: /** @type {any} */ ([]) };
  const acting = [{ robot_id: "AGI", distance_m: 3, in_sight: false }];
  const people = [person({ position: { x: 9, y: 6, z: 1 }, acting })];
  const encounters = [
    {
      cause: "P1",
      reason: "person",
      in_s: 1.8,
      probability: 0.9,
      place: { x: 6, y: 3 },
      centre: { x: 7, y: 4 },
      radius_m: 2,
    },
  ];
  const driving = { navigation, encounters };
  store.apply("snapshot", snapshot({ robots: [robot(driving)], people }));
  store.setConnection("open");
  const faint = detection({ person_id: null, position: { x: 13, y: 2, z: 1 } });
  const look = { robot_id: "AGI", stamp: "s", items: [faint] };
  const points = new Float32Array([17, 9, 17.5, 9]);
  const origin = { x: 12, y: 8 };
  const grid = { resolution: 0.5, width: 2, height: 1, origin, data: [100, 40] };
  store.apply("costmap", grid);
  const aisle = { label: "", xmin: 1, ymin: 1, xmax: 3, ymax: 3, columns: 1, rows: 1 };
  store.apply("coverage", { cameras: 1, lanes: [{ ...aisle, ages_s: [null] }] });
  const known = { x: 10, y: 8, radius_m: 0.5, since: "", thing_id: null };
  store.apply("known-here", { items: [known] });
  const name = { es: "", en: "" };
  const place = { x: 5, y: 8 };
  const tile = { state: "ok", value: 2, unit: "bar", decimals: 1, name, place };
  store.apply("equipment", [tile]);
  map.setLayer("costmap", true);
  for (const x of [0, 0.5, 1]) {
    store.apply("robots/AGI", robot({ ...driving, pose: { x, y: 2, yaw: 0 } }));
  }
  /** @type {string[]} */
  const invisible = [];
  for (const { name } of map.layers()) {
    // Fresh looks and sweeps, so that their age fades nothing between two pictures.
    store.apply("detections/AGI", look);
    store.apply("robots/AGI/scan", { robot_id: "AGI", stamp: "s", age_s: 0, points });
    await frame();
    const before = fingerprint(canvas);
    map.setLayer(name, false);
    await frame();
    if (fingerprint(canvas) === before) invisible.push(name);
    map.setLayer(name, true);
  }
  equal(invisible, []);
  map.destroy();
});

test("switches and trail length are remembered", () => {
  const { canvas, store, map } = mapOnPage();
  map.destroy();
  localStorage.clear();
  const first = createMap(canvas, store);
  first.setLayer("scan", false);
  first.setTrail(600);
  first.destroy();
  const second = createMap(canvas, store);
  equal(
    second.layers().filter(({ on }) => !on),
    [
      { name: "costmap", on: false },
      { name: "scan", on: false },
    ],
  );
  equal(second.trailSeconds(), 600);
  second.destroy();
  localStorage.clear();
});

test("a double tap follows a robot through a zoom, and a drag lets it go", async () => {
  const { canvas, store, map } = mapOnPage();
  store.apply(
    "snapshot",
    snapshot({ robots: [robot({ pose: { x: 10, y: 5, yaw: 0 } })] }),
  );
  await frame();
  for (const type of ["pointerdown", "pointerup", "pointerdown", "pointerup"]) {
    point(canvas, type, 300, 200);
  }
  equal(map.followed(), "AGI");
  const wheel = { deltaY: -100, clientX: 20, clientY: 20, cancelable: true };
  canvas.dispatchEvent(new WheelEvent("wheel", wheel));
  store.apply("robots/AGI", robot({ pose: { x: 12, y: 6, yaw: 0 } }));
  await frame();
  equal([map.followed(), map.view().x, map.view().y], ["AGI", 12, 6]);
  point(canvas, "pointerdown", 300, 200);
  point(canvas, "pointermove", 340, 200);
  equal(map.followed(), null);
  map.destroy();
});

test("a pinch on a followed robot zooms without letting it go", async () => {
  const { canvas, store, map } = mapOnPage();
  store.apply("snapshot", snapshot());
  await frame();
  map.follow("AGI");
  const { scale } = map.view();
  point(canvas, "pointerdown", 250, 200, 7);
  point(canvas, "pointerdown", 350, 200, 8);
  point(canvas, "pointermove", 450, 200, 8);
  near(map.view().scale, 2 * scale);
  equal(map.followed(), "AGI");
  map.destroy();
});

test("keys fit the greenhouse, follow a robot and show the fleet", async () => {
  const { store, map } = mapOnPage();
  const far = robot({ robot_id: "AGII", pose: { x: 18, y: 9, yaw: 0 } });
  store.apply("snapshot", snapshot({ robots: [robot(), far] }));
  await frame();
  const press = (/** @type {string} */ key) =>
    document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  press("2");
  equal(map.followed(), "AGII");
  press("0");
  near(map.view().x, 9.5);
  press("f");
  near(map.view().x, 10);
  map.setShortcuts(false);
  press("1");
  equal(map.followed(), null);
  map.destroy();
});

test("a tap in a ring picks its person, on the robot the robot", async () => {
  const { canvas, store, map } = mapOnPage();
  const people = [person({ position: { x: 14, y: 5, z: 1 } })];
  store.apply("snapshot", snapshot({ people, robots: [robot()] }));
  await frame();
  const { scale } = map.view();
  /** @param {number} x @param {number} y */
  const tapAt = (x, y) =>
    new Promise((resolve) => {
      const end = map.onPick((picked) => {
        end();
        resolve(picked);
      });
      const [px, py] = [300 + (x - 10) * scale, 200 - (y - 5) * scale];
      point(canvas, "pointerdown", px, py);
      point(canvas, "pointerup", px, py);
    });
  equal(await tapAt(15.6, 5), { kind: "person", id: "p1" });
  equal(await tapAt(1, 2), { kind: "robot", id: "AGI" });
  map.destroy();
});

test("an open field opens around what is seen in it", async () => {
  const { store, map } = mapOnPage();
  const far = { xmin: -1e6, ymin: -1e6, xmax: 1e6, ymax: 1e6 };
  const field = { name: "none", bounds: far, lanes: [], rows: [], posts: [] };
  const robots = [robot({ pose: { x: 100, y: 40, yaw: 0 } })];
  store.apply("snapshot", snapshot({ map: { ...field, obstacles: [] }, robots }));
  await frame();
  equal([map.view().x, map.view().y], [100, 40]);
  map.destroy();
});

test("ten robots with 720 points each are drawn within a frame's budget", async () => {
  const { store, map } = mapOnPage();
  const ids = Array.from({ length: 10 }, (_, i) => `R${i}`);
  const robots = ids.map((robot_id, i) =>
    robot({ robot_id, pose: { x: 2 * i, y: 5, yaw: i } }),
  );
  store.apply("snapshot", snapshot({ robots }));
  const points = Float32Array.from({ length: 1440 }, (_, i) => (i % 37) / 2);
  /** @type {number[]} */
  const costs = [];
  for (let n = 0; n < 40; n += 1) {
    // Frame callbacks run in the order they were asked for: before, the map's, after.
    const before = new Promise((resolve) =>
      requestAnimationFrame(() => resolve(performance.now())),
    );
    for (const id of ids) {
      const sweep = { robot_id: id, stamp: `${n}`, age_s: 0, points };
      store.apply(`robots/${id}/scan`, sweep);
    }
    const after = new Promise((resolve) =>
      requestAnimationFrame(() => resolve(performance.now())),
    );
    costs.push(Number(await after) - Number(await before));
  }
  costs.sort((a, b) => a - b);
  equal(costs[20] < 16, true);
  map.destroy();
});
