import { Store } from "../../iveg/static/js/core/store.js";
import { createMap } from "../../iveg/static/js/map/map.js";
import { detection, person, robot, snapshot } from "./builders.js";
import { equal, test } from "./harness.js";

/** A map of 600 × 400 px on the page, and its store. */
function mapOnPage(options = {}) {
  const canvas = document.createElement("canvas");
  canvas.style.width = "600px";
  canvas.style.height = "400px";
  document.body.replaceChildren(canvas);
  const store = new Store();
  const map = createMap(canvas, store, { storage: null, ...options });
  return { canvas, store, map };
}

const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));

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
  const obstacle = { x: 10, y: 8, width_m: 0.5, moved: false };
  const said = { reason: "obstacle", cause: null, age_s: 0, feedback_age_s: 0 };
  const applied = { ...said, faults: [], obstacle };
  const driving = { navigation, encounters, applied };
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

test("a tap in a zone picks its person, on the robot the robot", async () => {
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
