/**
 * Places of labels in a frame: names of lanes, people and bodies stay in place, and every
 * other label gives way to them.
 *
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("../viewport.js").Rect} Rect
 */

import { screenX, screenY } from "../viewport.js";
import { laneNames } from "./greenhouse.js";

/** Half a figure, and half the shortest body (px). */
const FIGURE_PX = 10;
/** Greatest width of a letter, as a share of its height. */
const LETTER = 0.6;

/** Frames in which the fixed labels have their places. */
const settled = new WeakSet();

/**
 * Takes the first place that is free and in sight.
 *
 * @param {Paint} paint
 * @param {readonly Rect[]} wished the best first
 * @returns {number | null} which one; null where there is none
 */
export function claim(paint, wished) {
  const { places, view } = paint;
  if (!places) return 0;
  if (!settled.has(places)) {
    settled.add(places);
    for (const rect of standing(paint)) places.take(rect);
  }
  const seen = wished.filter(({ top, bottom }) => top >= 0 && bottom <= view.height);
  const found = places.claim(seen);
  return found === null ? null : wished.indexOf(seen[found]);
}

/**
 * Whether a label fits there; the place is taken then.
 *
 * @param {Paint} paint
 * @param {string} text
 * @param {number} x centre (px)
 * @param {number} y middle (px)
 * @param {number} size of its letters (px)
 */
export function mayStand(paint, text, x, y, size) {
  const half = (text.length * size * LETTER) / 2;
  const rect = {
    left: x - half,
    right: x + half,
    top: y - size / 2,
    bottom: y + size / 2,
  };
  return claim(paint, [rect]) !== null;
}

/** @param {Paint} paint @returns {Iterable<Rect>} */
function* standing(paint) {
  const { scene, view } = paint;
  for (const { text, size, x, y, isTall } of laneNames(paint)) {
    const half = (text.length * size * LETTER) / 2;
    yield isTall ? around(x, y, size / 2, half) : around(x, y, half, size / 2);
  }
  for (const { x, y } of scene.people) {
    yield around(screenX(view, x), screenY(view, y), FIGURE_PX, FIGURE_PX);
  }
  for (const { pose, length, width } of scene.robots) {
    const half = Math.max(FIGURE_PX, (Math.min(length, width) * view.scale) / 2);
    yield around(screenX(view, pose.x), screenY(view, pose.y), half, half);
  }
}

/**
 * @param {number} x @param {number} y middle (px)
 * @param {number} across half the width (px)
 * @param {number} up half the height (px)
 * @returns {Rect}
 */
function around(x, y, across, up) {
  return { left: x - across, right: x + across, top: y - up, bottom: y + up };
}
