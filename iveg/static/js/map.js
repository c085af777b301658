/**
 * The live map: one canvas, one frame loop that runs only when there is something new.
 *
 * A message asks for the very next animation frame the moment it arrives; however many
 * arrive before it, that frame draws the newest of each, so there is no queue to grow.
 * What does not move is drawn once per viewport and theme and copied after that.
 *
 * @typedef {import("./store.js").Store} Store
 * @typedef {import("./viewport.js").Viewport} Viewport
 * @typedef {import("./layers/paint.js").Paint} Paint
 * @typedef {import("./layers/words.js").Translate} Translate
 * @typedef {import("./layers/pick.js").Picked} Picked
 * @typedef {{
 *   now?: () => number, storage?: Storage | null,
 *   onFollow?: (robotId: string | null) => void,
 * }} MapOptions `now` is the clock of ages (ms): the page's own, or a replay's
 */

import { listen } from "./gestures.js";
import { createCostmapLayer } from "./layers/costmap.js";
import * as detections from "./layers/detections.js";
import * as greenhouse from "./layers/greenhouse.js";
import * as grid from "./layers/grid.js";
import * as intent from "./layers/intent.js";
import * as links from "./layers/links.js";
import { browserStorage, keepChoices, readChoices } from "./layers/memory.js";
import * as people from "./layers/people.js";
import { pick } from "./layers/pick.js";
import * as robot from "./layers/robot.js";
import * as scalebar from "./layers/scalebar.js";
import * as scan from "./layers/scan.js";
import { createStaticImage } from "./layers/static.js";
import { readTheme } from "./layers/theme.js";
import * as trail from "./layers/trail.js";
import { drawVeil } from "./layers/veil.js";
import { createWords } from "./layers/words.js";
import { createPaintHook } from "./painthook.js";
import { readScene } from "./scene.js";
import { followShortcuts } from "./shortcuts.js";
import * as viewport from "./viewport.js";

/** Layers from the ground up; the first two do not move, nothing ever hides a person. */
export const LAYERS = [
  "grid",
  "greenhouse",
  "costmap",
  "trail",
  "scan",
  "intent",
  "links",
  "detections",
  "robot",
  "people",
  "scalebar",
];

/** Ages and rings grow without any message. */
const AGEING_MS = 250;
/** An open field is fitted to what is seen in its first second. */
const OPENING_MS = 1000;
const FOLLOW_FROM_SCALE = 24;
const KEY_PAN_PX = 60;
const KEY_ZOOM = 1.4;
const DOUBLE_TAP_ZOOM = 2;
/** More than any layer nests its drawing states. */
const DEEPEST_SAVE = 8;

/**
 * @param {HTMLCanvasElement} canvas sized by the page's style
 * @param {Store} store
 * @param {MapOptions} [options]
 */
export function createMap(canvas, store, options = {}) {
  const { now = () => performance.now(), onFollow } = options;
  const storage = options.storage === undefined ? browserStorage() : options.storage;
  const ctx = /** @type {CanvasRenderingContext2D} */ (
    canvas.getContext("2d", { alpha: false })
  );
  const choices = readChoices(storage);
  const off = new Set(choices.off);
  const trails = trail.createTrails();
  const still = createStaticImage([
    ["grid", grid.draw],
    ["greenhouse", greenhouse.draw],
  ]);
  const hook = createPaintHook();
  /** @type {Set<(picked: Picked) => void>} */
  const pickers = new Set();
  /** @type {Set<string>} */
  const broken = new Set();
  /** @type {Record<string, (paint: Paint) => void>} */
  const moving = {
    costmap: createCostmapLayer(),
    trail: (paint) => trail.draw(paint, trails, trailS),
    scan: scan.draw,
    intent: intent.draw,
    links: links.draw,
    people: people.draw,
    detections: detections.draw,
    robot: robot.draw,
    scalebar: scalebar.draw,
  };

  let view = viewport.createViewport(canvas.clientWidth, canvas.clientHeight);
  let theme = readTheme(canvas);
  let words = createWords();
  let scene = readScene(store, now());
  let trailS = choices.trailS;
  let shortcuts = choices.shortcuts;
  /** @type {string | null} */
  let followed = null;
  /** @type {string | null} */
  let openedOn = null;
  let openedAtMs = 0;
  let isMoved = false;
  let frame = 0;

  const isOn = (/** @type {string} */ layer) => !off.has(layer);
  const remember = () => keepChoices(storage, { off: [...off], trailS, shortcuts });

  function invalidate() {
    if (!frame) frame = requestAnimationFrame(drawFrame);
  }

  function drawFrame() {
    frame = 0;
    if (!view.width || !view.height) return;
    scene = readScene(store, now());
    open();
    keepFollowed();
    matchPixels();
    paintAll({ ctx, view, theme, scene, words, followed });
    hook.painted();
  }

  /** @param {Paint} paint */
  function paintAll(paint) {
    const ratio = devicePixelRatio;
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.drawImage(still.image(paint, ratio, isOn), 0, 0);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    for (const layer of LAYERS) if (isOn(layer)) guarded(layer, paint);
    if (scene.isVeiled) drawVeil(paint);
  }

  /**
   * One layer's bad datum must not take the robots off the map; told once a layer.
   *
   * @param {string} layer
   * @param {Paint} paint
   */
  function guarded(layer, paint) {
    try {
      moving[layer]?.(paint);
      broken.delete(layer);
    } catch (error) {
      if (!broken.has(layer)) reportError(error);
      broken.add(layer);
      recover(ctx);
    }
  }

  function matchPixels() {
    const width = Math.round(view.width * devicePixelRatio);
    const height = Math.round(view.height * devicePixelRatio);
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
  }

  /** Fits the first sight of a house; never again once a person has moved the map. */
  function open() {
    const name = scene.map?.name ?? null;
    if (name === null || isMoved) return;
    if (openedOn !== name) {
      if (!bounds()) return;
      openedOn = name;
      openedAtMs = now();
    }
    const isHouse = greenhouse.hasArea(scene.map?.bounds);
    if (isHouse || now() - openedAtMs < OPENING_MS) fitView();
  }

  function bounds() {
    const house = scene.map?.bounds;
    return greenhouse.hasArea(house) ? house : viewport.boundsOf(seenPoints(), 2);
  }

  function* seenPoints() {
    for (const { pose } of scene.robots) yield pose;
    for (const { points } of scene.scans) {
      for (let i = 0; i < points.length; i += 16) {
        yield { x: points[i], y: points[i + 1] };
      }
    }
  }

  function fitView() {
    const box = bounds();
    if (box) view = viewport.fitTo(view, box);
  }

  function keepFollowed() {
    const robot = scene.robots.find(({ id }) => id === followed);
    if (robot) view = viewport.centredOn(view, robot.pose.x, robot.pose.y);
  }

  /** @param {Viewport} next */
  function moveTo(next) {
    view = next;
    isMoved = true;
    invalidate();
  }

  /** @param {string | null} robotId */
  function follow(robotId) {
    if (robotId !== followed) onFollow?.(robotId);
    followed = robotId;
    if (robotId) moveTo({ ...view, scale: Math.max(view.scale, FOLLOW_FROM_SCALE) });
    invalidate();
  }

  function fit() {
    follow(null);
    isMoved = false;
    fitView();
    invalidate();
  }

  function fitFleet() {
    follow(null);
    const box = viewport.boundsOf(
      scene.robots.map(({ pose }) => pose),
      3,
    );
    if (box) moveTo(viewport.fitTo(view, box));
  }

  /** @param {number} px @param {number} py @param {number} factor */
  function zoom(px, py, factor) {
    const [x, y] = followed ? [view.width / 2, view.height / 2] : [px, py];
    moveTo(viewport.zoomAt(view, x, y, factor));
  }

  /** @param {number} dx @param {number} dy */
  function pan(dx, dy) {
    if (followed) follow(null);
    moveTo(viewport.panBy(view, dx, dy));
  }

  /** @param {number} px @param {number} py */
  const pickAt = (px, py) => pick(scene, view, px, py, isOn);

  const unlisten = listen(canvas, {
    pan,
    zoom,
    pinch(dx, dy, px, py, factor) {
      // A pinch on a followed robot means its size: fingers never move quite evenly.
      if (!followed) pan(dx, dy);
      zoom(px, py, factor);
    },
    tap(px, py) {
      const picked = pickAt(px, py);
      if (picked) for (const fn of pickers) fn(picked);
    },
    doubleTap(px, py) {
      const picked = pickAt(px, py);
      if (picked?.kind === "robot") follow(picked.id);
      else zoom(px, py, DOUBLE_TAP_ZOOM);
    },
    hover(px, py) {
      canvas.style.cursor = pickAt(px, py) ? "pointer" : "grab";
    },
  });
  const unfollowKeys = followShortcuts(canvas, () => shortcuts, {
    fit,
    fitFleet,
    robot: (n) => follow([...store.robots().keys()][n - 1] ?? followed),
    zoom: (n) => zoom(view.width / 2, view.height / 2, KEY_ZOOM ** n),
    pan: (x, y) => pan(x * KEY_PAN_PX, y * KEY_PAN_PX),
  });
  const unwatch = store.watch((data, topic) => {
    hook.arrived(topic, data);
    if (topic === "snapshot") trails.keepOnly(store.robots());
    const [head, id, leaf] = topic.split("/");
    const pose = head === "robots" && !leaf && data?.pose;
    if (pose) trails.add(id, pose, data.receivedAtMs);
    invalidate();
  });
  const observer = new ResizeObserver(() => {
    view = viewport.resized(view, canvas.clientWidth, canvas.clientHeight);
    if (openedOn !== null && !isMoved) fitView();
    // Drawn at once: a resized canvas is blank until it is.
    cancelAnimationFrame(frame);
    drawFrame();
  });
  observer.observe(canvas);
  const ageing = setInterval(invalidate, AGEING_MS);
  invalidate();

  return {
    fit,
    fitFleet,
    follow,
    followed: () => followed,
    /** @param {number} steps positive = closer */
    zoomBy: (steps) => zoom(view.width / 2, view.height / 2, KEY_ZOOM ** steps),
    /**
     * @param {string} layer one of LAYERS
     * @param {boolean} on
     */
    setLayer(layer, on) {
      if (on) off.delete(layer);
      else off.add(layer);
      remember();
      invalidate();
    },
    /** @returns {{name: string, on: boolean}[]} from the ground up */
    layers: () => LAYERS.map((name) => ({ name, on: isOn(name) })),
    /** @param {number} seconds one of TRAIL_SPANS_S */
    setTrail(seconds) {
      trailS = seconds;
      remember();
      invalidate();
    },
    trailSeconds: () => trailS,
    /** Single-key shortcuts on or off (WCAG 2.1.4). @param {boolean} on */
    setShortcuts(on) {
      shortcuts = on;
      remember();
    },
    hasShortcuts: () => shortcuts,
    /**
     * Reads the page's colours again; call it after the theme has changed.
     *
     * @param {Record<string, string>} [overrides] custom property → colour
     */
    setTheme(overrides) {
      theme = readTheme(canvas, overrides);
      invalidate();
    },
    /** @param {Translate} translate as for `createWords` */
    setLanguage(translate) {
      words = createWords(translate);
      invalidate();
    },
    /** @param {(picked: Picked) => void} fn @returns {() => void} */
    onPick(fn) {
      pickers.add(fn);
      return () => void pickers.delete(fn);
    },
    /** Forgets trails: for a replay that jumps. */
    clearTrails() {
      trails.clear();
      invalidate();
    },
    /** @returns {Viewport} */
    view: () => view,
    destroy() {
      cancelAnimationFrame(frame);
      clearInterval(ageing);
      observer.disconnect();
      unwatch();
      unlisten();
      unfollowKeys();
      pickers.clear();
    },
  };
}

/**
 * Brings a context back from wherever a layer left it, without clearing the picture.
 *
 * @param {CanvasRenderingContext2D} ctx
 */
function recover(ctx) {
  for (let depth = 0; depth < DEEPEST_SAVE; depth += 1) ctx.restore();
  ctx.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
  ctx.globalAlpha = 1;
  ctx.setLineDash([]);
}
