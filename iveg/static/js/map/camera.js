/**
 * The view of the map: fitted to the greenhouse, moved by hand, or following a robot.
 *
 *     fitted ──(pan, zoom)──> moved ──(F)──> fitted
 *        └──(1…9, double tap)──> following ──(pan, F, 0)──> moved or fitted
 *
 * A zoom while following keeps the robot in the middle.
 *
 * @typedef {import("./scene.js").Scene} Scene
 * @typedef {import("./viewport.js").Viewport} Viewport
 * @typedef {ReturnType<typeof createCamera>} Camera
 * @typedef {{now: () => viewport.Rect[], forget: () => void}} Covers what lies over the
 *   map, and how to measure that anew
 */

import { hasArea } from "./layers/greenhouse.js";
import * as viewport from "./viewport.js";

/** An open field is fitted to the detections and scans of its first second. */
const OPENING_MS = 1000;
const FOLLOW_FROM_SCALE = 24;
const STEP_ZOOM = 1.4;
const PADDING_PX = 28;
/** @type {Covers} */
const NOTHING = { now: () => [], forget: () => undefined };
const FLEET_MARGIN_M = 3;
const FIELD_MARGIN_M = 2;
/** One laser point of so many is enough to know how far a field reaches. */
const POINT_STRIDE = 8;

/**
 * @param {() => Scene} sceneNow the scene last drawn
 * @param {(robotId: string | null) => void} [onFollow]
 * @param {Covers} [covers]
 */
export function createCamera(sceneNow, onFollow, covers = NOTHING) {
  let view = viewport.createViewport(0, 0);
  /** @type {string | null} */
  let followed = null;
  /** @type {string | null} */
  let openedOn = null;
  let openedAtMs = 0;
  let isMoved = false;

  /** @param {Viewport} next */
  function move(next) {
    view = next;
    isMoved = true;
  }

  /** @param {import("./viewport.js").Box2D} box */
  const fitted = (box) => viewport.fitTo(view, box, PADDING_PX, covers.now());

  function fitView() {
    const box = boundsOfScene(sceneNow());
    if (box) view = fitted(box);
  }

  /** Fits the first scene of a greenhouse; never again once a person has moved the map. */
  function open() {
    const { map, nowMs } = sceneNow();
    if (!map || isMoved) return;
    if (openedOn !== map.name) {
      if (!boundsOfScene(sceneNow())) return;
      openedOn = map.name;
      openedAtMs = nowMs;
    }
    if (hasArea(map.bounds) || nowMs - openedAtMs < OPENING_MS) fitView();
  }

  function keepFollowed() {
    const robot = sceneNow().robots.find(({ id }) => id === followed);
    if (robot) view = viewport.centredOn(view, robot.pose.x, robot.pose.y);
  }

  /** @param {string | null} robotId */
  function follow(robotId) {
    if (robotId !== followed) onFollow?.(robotId);
    followed = robotId;
    if (robotId) move({ ...view, scale: Math.max(view.scale, FOLLOW_FROM_SCALE) });
  }

  /** @param {number} dx @param {number} dy */
  function pan(dx, dy) {
    if (followed) follow(null);
    move(viewport.panBy(view, dx, dy));
  }

  /** @param {number} px @param {number} py @param {number} factor */
  function zoom(px, py, factor) {
    const [x, y] = followed ? [view.width / 2, view.height / 2] : [px, py];
    move(viewport.zoomAt(view, x, y, factor));
  }

  return {
    view: () => view,
    followed: () => followed,
    /** Before each drawing. */
    settle() {
      open();
      keepFollowed();
    },
    /** @param {number} width (CSS px) @param {number} height (CSS px) */
    resize(width, height) {
      view = viewport.resized(view, width, height);
      if (openedOn !== null && !isMoved) fitView();
    },
    fit() {
      covers.forget();
      follow(null);
      isMoved = false;
      fitView();
    },
    fitFleet() {
      follow(null);
      const poses = sceneNow().robots.map(({ pose }) => pose);
      const box = viewport.boundsOf(poses, FLEET_MARGIN_M);
      if (box) move(fitted(box));
    },
    follow,
    pan,
    zoom,
    /** @param {number} steps positive = closer */
    zoomBy: (steps) => zoom(view.width / 2, view.height / 2, STEP_ZOOM ** steps),
    /**
     * A pinch on a followed robot zooms and does not pan: fingers never move quite evenly.
     *
     * @param {number} dx
     * @param {number} dy
     * @param {number} px
     * @param {number} py
     * @param {number} factor
     */
    pinch(dx, dy, px, py, factor) {
      if (!followed) pan(dx, dy);
      zoom(px, py, factor);
    },
  };
}

/**
 * Bounds of the greenhouse, in an open field of robots and scans (m); null without any.
 *
 * @param {Scene} scene
 */
function boundsOfScene(scene) {
  const greenhouse = scene.map?.bounds;
  return hasArea(greenhouse)
    ? greenhouse
    : viewport.boundsOf(seenPoints(scene), FIELD_MARGIN_M);
}

/** @param {Scene} scene */
function* seenPoints({ robots, scans }) {
  for (const { pose } of robots) yield pose;
  for (const { points } of scans) {
    for (let i = 0; i + 1 < points.length; i += 2 * POINT_STRIDE) {
      yield { x: points[i], y: points[i + 1] };
    }
  }
}
