/**
 * The live map: one canvas, one frame loop that runs only when there is something new.
 *
 * A message asks for the very next animation frame the moment it arrives; however many
 * arrive before it, that frame draws the newest of each, so there is no queue to grow.
 *
 * @typedef {import("../core/store.js").Store} Store
 * @typedef {import("./camera.js").Camera} Camera
 * @typedef {import("./layers/labels.js").Translate} Translate
 * @typedef {import("./layers/pick.js").Picked} Picked
 * @typedef {(picked: Picked) => void} Picker
 * @typedef {{
 *   now?: () => number, storage?: Storage | null,
 *   onFollow?: (robotId: string | null) => void, onLegend?: () => void,
 *   onMeasure?: (measure: {on: boolean, points: number, metres: number | null}) => void,
 * }} MapOptions `now` is the clock of ages (ms): the page's own, or a replay's
 */

import { followShortcuts } from "../core/shortcuts.js";
import { createCamera } from "./camera.js";
import { createCovers, onResize } from "./covers.js";
import { listen } from "./gestures.js";
import { believedBy, hears } from "./layers/belief.js";
import { createLabels } from "./layers/labels.js";
import { laidTo, lengthOf } from "./layers/measure.js";
import { browserStorage, createChoices } from "./layers/memory.js";
import { pick } from "./layers/pick.js";
import { readTheme } from "./layers/theme.js";
import { createTrails } from "./layers/trail.js";
import { createPicture, LAYERS } from "./picture.js";
import { readScene } from "./scene.js";
import { worldX, worldY } from "./viewport.js";

export { LAYERS };

/** Ages and rings grow without any message. */
const AGEING_MS = 250;
const KEY_PAN_PX = 60;
const DOUBLE_TAP_ZOOM = 2;

/**
 * @param {HTMLCanvasElement} canvas sized by the page's style
 * @param {Store} store
 * @param {MapOptions} [options]
 */
export function createMap(canvas, store, options = {}) {
  const { now = () => performance.now(), storage = browserStorage() } = options;
  const choices = createChoices(storage, invalidate);
  const trails = createTrails();
  const covers = createCovers(canvas, invalidate);
  const picture = createPicture(canvas, trails, choices.isOn, choices.trailSeconds);
  /** @type {Set<Picker>} */
  const pickers = new Set();
  /** @type {Set<(hasScans: boolean) => void>} */
  const drawn = new Set();
  let theme = readTheme(canvas);
  let labels = createLabels();
  let scene = readScene(store, now());
  /** @type {import("./layers/measure.js").Tape} */
  let tape = { points: [] };
  let isMeasuring = false;
  let frame = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;
  const camera = redrawing(
    createCamera(() => scene, options.onFollow, covers),
    invalidate,
  );

  function invalidate() {
    if (!frame) frame = requestAnimationFrame(draw);
  }

  function draw() {
    frame = 0;
    scene = seen(readScene(store, now()));
    camera.settle();
    const view = camera.view();
    if (!view.width || !view.height) return;
    const followed = camera.followed();
    const missingMs = picture.draw({ view, theme, scene, labels, followed, tape });
    for (const fn of drawn) fn(missingMs === 0);
    clearTimeout(later);
    if (missingMs) later = setTimeout(invalidate, missingMs);
  }

  /** @param {import("./scene.js").Scene} whole */
  function seen(whole) {
    const robot = store.robots().get(choices.believer() ?? "");
    return robot ? believedBy(whole, robot.robot_id, hears(robot)) : whole;
  }

  /** @param {boolean} on */
  function setMeasuring(on) {
    isMeasuring = on;
    layTape({ points: [] });
  }

  /** @param {import("./layers/measure.js").Tape} next */
  function layTape(next) {
    tape = next;
    const [points, metres] = [tape.points.length, lengthOf(tape)];
    options.onMeasure?.({ on: isMeasuring, points, metres });
    invalidate();
  }

  /** @param {number} px @param {number} py */
  function mark(px, py) {
    if (!isMeasuring) return;
    const view = camera.view();
    layTape(laidTo(tape, { x: worldX(view, px), y: worldY(view, py) }));
  }

  function resize() {
    covers.forget();
    camera.resize(canvas.clientWidth, canvas.clientHeight);
    // Drawn at once: a resized canvas is blank until it is.
    cancelAnimationFrame(frame);
    draw();
  }

  /** @param {number} px @param {number} py */
  const pickAt = (px, py) => pick(scene, camera.view(), px, py, choices.isOn);
  /** @param {Picked} picked */
  const tell = (picked) => {
    for (const fn of pickers) fn(picked);
  };
  /** @param {number} px @param {number} py */
  function tap(px, py) {
    if (isMeasuring) return mark(px, py);
    const picked = pickAt(px, py);
    if (picked) tell(picked);
  }

  const endings = [
    wireGestures(canvas, camera, pickAt, tap, () => isMeasuring),
    wireKeys(canvas, camera, store, choices.hasShortcuts, {
      measure: () => setMeasuring(!isMeasuring),
      mark: () => mark(camera.view().width / 2, camera.view().height / 2),
      legend: () => options.onLegend?.(),
    }),
    store.watch((data, topic) => {
      leaveTrail(trails, store, topic, data);
      invalidate();
    }),
    every(AGEING_MS, invalidate),
    onResize([canvas], resize),
    covers.end,
    () => cancelAnimationFrame(frame),
    () => clearTimeout(later),
  ];
  invalidate();

  return {
    fit: camera.fit,
    fitFleet: camera.fitFleet,
    follow: camera.follow,
    followed: camera.followed,
    zoomBy: camera.zoomBy,
    view: camera.view,
    setLayer: choices.setLayer,
    /** @returns {{name: string, on: boolean}[]} from the ground up */
    layers: () => LAYERS.map((name) => ({ name, on: choices.isOn(name) })),
    /** Whose belief is drawn; null draws what all robots know together. */
    setBeliever: choices.setBeliever,
    believer: choices.believer,
    setMeasuring,
    isMeasuring: () => isMeasuring,
    setTrail: choices.setTrail,
    trailSeconds: choices.trailSeconds,
    setShortcuts: choices.setShortcuts,
    hasShortcuts: choices.hasShortcuts,
    /**
     * Reads the page's colours again; call it after the theme has changed.
     *
     * @param {Record<string, string>} [overrides] custom property → colour
     */
    setTheme(overrides) {
      theme = readTheme(canvas, overrides);
      invalidate();
    },
    /** @param {Translate} translate as for `createLabels` */
    setLanguage(translate) {
      labels = createLabels(translate);
      invalidate();
    },
    /** @param {Picker} fn @returns {() => void} */
    onPick(fn) {
      pickers.add(fn);
      return () => void pickers.delete(fn);
    },
    /**
     * Tells each frame that was drawn, and whether the newest scans are in it.
     *
     * @param {(hasScans: boolean) => void} fn
     * @returns {() => void}
     */
    onDrawn(fn) {
      drawn.add(fn);
      return () => void drawn.delete(fn);
    },
    /** Forgets trails: for a replay that jumps. */
    clearTrails() {
      trails.clear();
      invalidate();
    },
    destroy() {
      for (const end of endings) end();
      pickers.clear();
      drawn.clear();
    },
  };
}

/**
 * The same camera, whose every movement asks for a frame.
 *
 * @param {Camera} camera
 * @param {() => void} invalidate
 * @returns {Camera}
 */
function redrawing(camera, invalidate) {
  /** @template {any[]} A @param {(...args: A) => void} act */
  const then =
    (act) =>
    (/** @type {A} */ ...args) => {
      act(...args);
      invalidate();
    };
  return {
    ...camera,
    fit: then(camera.fit),
    fitFleet: then(camera.fitFleet),
    follow: then(camera.follow),
    pan: then(camera.pan),
    zoom: then(camera.zoom),
    zoomBy: then(camera.zoomBy),
    pinch: then(camera.pinch),
  };
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Camera} camera
 * @param {(px: number, py: number) => Picked | null} pickAt
 * @param {(px: number, py: number) => void} tap
 * @param {() => boolean} isMeasuring
 */
function wireGestures(canvas, camera, pickAt, tap, isMeasuring) {
  return listen(canvas, {
    pan: camera.pan,
    zoom: camera.zoom,
    pinch: camera.pinch,
    tap,
    doubleTap(px, py) {
      const picked = pickAt(px, py);
      if (picked?.kind === "robot") camera.follow(picked.id);
      else camera.zoom(px, py, DOUBLE_TAP_ZOOM);
    },
    hover(px, py) {
      const idle = pickAt(px, py) ? "pointer" : "grab";
      canvas.style.cursor = isMeasuring() ? "crosshair" : idle;
    },
  });
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Camera} camera
 * @param {Store} store
 * @param {() => boolean} isEnabled
 * @param {Pick<import("../core/shortcuts.js").Actions, "measure" | "mark" | "legend">} measuring
 */
function wireKeys(canvas, camera, store, isEnabled, measuring) {
  return followShortcuts(canvas, isEnabled, {
    ...measuring,
    fit: camera.fit,
    fitFleet: camera.fitFleet,
    robot: (n) => {
      const robotId = [...store.robots().keys()][n - 1];
      if (robotId) camera.follow(robotId);
    },
    zoom: camera.zoomBy,
    pan: (x, y) => camera.pan(x * KEY_PAN_PX, y * KEY_PAN_PX),
  });
}

/**
 * @param {import("./layers/trail.js").Trails} trails
 * @param {Store} store
 * @param {string} topic
 * @param {any} data
 */
function leaveTrail(trails, store, topic, data) {
  if (topic === "snapshot") trails.keepOnly(store.robots());
  const [head, id, leaf] = topic.split("/");
  if (head !== "robots" || leaf || !data?.pose) return;
  trails.add(id, data.pose, data.receivedAtMs);
}

/** @param {number} ms @param {() => void} fn */
function every(ms, fn) {
  const timer = setInterval(fn, ms);
  return () => clearInterval(timer);
}
