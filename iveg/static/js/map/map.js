/**
 * The live map: composes the picture and draws it.
 *
 * @typedef {import("../core/store.js").Store} Store
 * @typedef {import("./camera.js").Camera} Camera
 * @typedef {import("./layers/labels.js").Translate} Translate
 * @typedef {import("./layers/pick.js").Picked} Picked
 * @typedef {(picked: Picked) => void} Picker
 * @typedef {{
 *   now?: () => number, storage?: Storage | null,
 *   onFollow?: (robotId: string | null) => void, onLegend?: () => void,
 *   onMeasure?: (measure: import("./measuring.js").Measure) => void,
 * }} MapOptions `now` is the clock of ages (ms): the page's own, or a replay's
 */

import { followShortcuts } from "../core/shortcuts.js";
import { createCamera } from "./camera.js";
import { createCovers, onResize } from "./covers.js";
import { createFrames } from "./frames.js";
import { listen } from "./gestures.js";
import { believedBy, hears } from "./layers/belief.js";
import { createLabels } from "./layers/labels.js";
import { browserStorage, createChoices } from "./layers/memory.js";
import { pick } from "./layers/pick.js";
import { readTheme } from "./layers/theme.js";
import { createTrails } from "./layers/trail.js";
import { createMeasuring } from "./measuring.js";
import { createPicture, LAYERS } from "./picture.js";
import { readScene } from "./scene.js";
import { worldX, worldY } from "./viewport.js";

export { LAYERS };

/** Ages and zones grow without any message. */
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
  const { onMeasure } = options;
  const trails = createTrails();
  const picture = createPicture(canvas, trails);
  const frames = createFrames(draw);
  const choices = createChoices(storage, frames.ask);
  const covers = createCovers(canvas, frames.ask);
  const measuring = createMeasuring((measure) => {
    onMeasure?.(measure);
    frames.ask();
  });
  const asking = createAsking(frames.ask);
  const looks = createLooks(canvas, frames.ask);
  let scene = readScene(store, now());
  const camera = redrawing(
    createCamera(() => scene, options.onFollow, covers),
    frames.ask,
  );
  const picking = createPicking((px, py) =>
    pick(scene, camera.view(), px, py, choices.isOn),
  );

  function draw() {
    scene = believed(readScene(store, now()), store, choices.believer());
    camera.settle();
    const view = camera.view();
    if (!view.width || !view.height) return null;
    return picture.draw({
      ...{ view, scene, followed: camera.followed(), tape: measuring.tape() },
      ...{ theme: looks.theme(), labels: looks.labels(), ratio: devicePixelRatio },
      ...{ off: choices.off(), trailS: choices.trailSeconds() },
    });
  }

  /** What a mark on the map does from now on: the answer, where one is asked for. */
  function marking() {
    const answer = asking.answering();
    return (/** @type {number} */ px, /** @type {number} */ py) => {
      const view = camera.view();
      (answer ?? measuring.mark)({ x: worldX(view, px), y: worldY(view, py) });
    };
  }

  const isMarking = () => asking.isOn() || measuring.isOn();

  function resize() {
    covers.forget();
    camera.resize(canvas.clientWidth, canvas.clientHeight);
    frames.drawNow();
  }

  const endings = [
    wireGestures(canvas, camera, picking, isMarking, marking),
    wireKeys(canvas, camera, store, choices.hasShortcuts, {
      measure: () => measuring.set(!measuring.isOn()),
      mark: () => marking()(camera.view().width / 2, camera.view().height / 2),
      legend: () => options.onLegend?.(),
    }),
    store.watch((data, topic) => {
      leaveTrail(trails, store, topic, data);
      frames.ask();
    }),
    every(AGEING_MS, frames.ask),
    onResize([canvas], resize),
    covers.end,
    frames.end,
    picking.end,
  ];
  frames.ask();

  return {
    ...{ fit: camera.fit, fitFleet: camera.fitFleet, follow: camera.follow },
    ...{ followed: camera.followed, zoomBy: camera.zoomBy, view: camera.view },
    ...choicesOf(choices),
    ...{ setTheme: looks.setTheme, setLanguage: looks.setLanguage },
    ...{ setMeasuring: measuring.set, isMeasuring: measuring.isOn },
    askPlace: asking.ask,
    ...{ onPick: picking.onPick, onDrawn: frames.onDrawn },
    afterDrawn: frames.afterDrawn,
    destroy() {
      for (const end of endings) end();
    },
  };
}

/** The switches of the map. @param {ReturnType<typeof createChoices>} choices */
function choicesOf(choices) {
  return {
    setLayer: choices.setLayer,
    /** @returns {{name: string, on: boolean}[]} from the ground up */
    layers: () => LAYERS.map((name) => ({ name, on: choices.isOn(name) })),
    /** The robot whose knowledge is drawn; null draws that of all robots together. */
    setBeliever: choices.setBeliever,
    believer: choices.believer,
    setTrail: choices.setTrail,
    trailSeconds: choices.trailSeconds,
    setShortcuts: choices.setShortcuts,
    hasShortcuts: choices.hasShortcuts,
  };
}

/**
 * The colours and labels of the map.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {() => void} onChange
 */
function createLooks(canvas, onChange) {
  let theme = readTheme(canvas);
  let labels = createLabels();
  return {
    theme: () => theme,
    labels: () => labels,
    /** Reads the page's colours again; call it after the theme has changed. */
    setTheme() {
      theme = readTheme(canvas);
      onChange();
    },
    /**
     * @param {Translate} translate as for `createLabels`
     */
    setLanguage(translate) {
      labels = createLabels(translate);
      onChange();
    },
  };
}

/**
 * The next tap on the map as an answer, where somebody has asked for a place.
 *
 * @param {() => void} onChange
 */
function createAsking(onChange) {
  /** @typedef {(place: {x: number, y: number}) => void} Answer in `map` (m) */
  /** @type {Answer | null} */
  let answer = null;

  /** @param {Answer | null} next null asks no more */
  function ask(next) {
    answer = next;
    onChange();
  }

  return {
    isOn: () => answer !== null,
    ask,
    /** The one who is answered from now on, once; null where nobody asks. */
    answering() {
      const asked = answer;
      if (!asked) return null;
      return (/** @type {{x: number, y: number}} */ place) => {
        if (asked !== answer) return;
        ask(null);
        asked(place);
      };
    },
  };
}

/** @param {(px: number, py: number) => Picked | null} at what lies there */
function createPicking(at) {
  /** @type {Set<Picker>} */
  const pickers = new Set();
  return {
    at,
    /** @param {number} px @param {number} py */
    tap(px, py) {
      const picked = at(px, py);
      if (picked) for (const fn of pickers) fn(picked);
    },
    /** @param {Picker} fn @returns {() => void} */
    onPick(fn) {
      pickers.add(fn);
      return () => void pickers.delete(fn);
    },
    end: () => pickers.clear(),
  };
}

/**
 * The scene as the chosen robot knows it; the whole scene where none is chosen.
 *
 * @param {import("./scene.js").Scene} whole
 * @param {Store} store
 * @param {string | null} believer
 */
function believed(whole, store, believer) {
  const robot = store.robots().get(believer ?? "");
  return robot ? believedBy(whole, robot.robot_id, hears(robot)) : whole;
}

/**
 * The same camera, with a new frame for every movement.
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
 * @param {ReturnType<typeof createPicking>} picking
 * @param {() => boolean} isMarking
 * @param {() => (px: number, py: number) => void} marking what a mark does from now on
 */
function wireGestures(canvas, camera, picking, isMarking, marking) {
  return listen(canvas, {
    pan: camera.pan,
    zoom: camera.zoom,
    pinch: camera.pinch,
    tapMeans: () => (isMarking() ? marking() : picking.tap),
    doubleTap(px, py) {
      const picked = picking.at(px, py);
      if (picked?.kind === "robot") camera.follow(picked.id);
      else camera.zoom(px, py, DOUBLE_TAP_ZOOM);
    },
    hover(px, py) {
      const idle = picking.at(px, py) ? "pointer" : "grab";
      canvas.style.cursor = isMarking() ? "crosshair" : idle;
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
 * @param {ReturnType<typeof createTrails>} trails
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
