/**
 * People, over everything that moves in each frame: drawn when something of them has
 * changed and copied in between.
 *
 * Zones and figures of a crowd are hundreds of copies a frame; their image is one.  Of few
 * people the copies are fewer pixels than the rectangle around them, so they are drawn
 * themselves.
 *
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("../viewport.js").Rect} Rect
 */

import { screenX, screenY } from "../viewport.js";
import { matchPixels } from "./paint.js";
import { isSame, placeOf } from "./static.js";

/** Ages have tenths of a second, and a zone grows by a pixel in about that time. */
const AGEING_MS = 100;
/** How far a figure and the age below or above it reach at least (px). */
const ASIDE_PX = 80;
const UP_PX = 34;
/** To begin one more copy costs as much as to copy so many pixels. */
const COPY_PX = 2000;

/** @param {(paint: Paint) => void} draw */
export function createAbove(draw) {
  const canvas = new OffscreenCanvas(1, 1);
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
    canvas.getContext("2d")
  );
  /** @type {unknown[]} */
  let drawnFor = [];
  /** @type {readonly Rect[]} those of the labels in it */
  let labels = [];

  /** @param {Paint} paint */
  function redraw(paint) {
    const { ratio = 1, places, view } = paint;
    const before = places?.labels().length ?? 0;
    matchPixels(canvas, view, ratio);
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.clearRect(0, 0, canvas.width, canvas.height);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    draw({ ...paint, ctx });
    labels = places?.labels().slice(before) ?? [];
  }

  /** @param {Paint} paint */
  return (paint) => {
    const { ratio = 1, places } = paint;
    const box = boxOf(paint);
    if (isFew(paint, box)) return draw(paint);
    const wanted = [...placeOf(paint, ratio), ...contentOf(paint)];
    if (isSame(wanted, drawnFor)) places?.keep(labels);
    else redraw(paint);
    drawnFor = wanted;
    const [left, top] = [Math.floor(box.left * ratio), Math.floor(box.top * ratio)];
    const across = Math.ceil(box.right * ratio) - left;
    const down = Math.ceil(box.bottom * ratio) - top;
    paint.ctx.save();
    paint.ctx.setTransform(1, 0, 0, 1, 0, 0);
    paint.ctx.drawImage(canvas, left, top, across, down, left, top, across, down);
    paint.ctx.restore();
  };
}

/**
 * What all of them cover of the view.
 *
 * @param {Paint} paint
 * @returns {Rect} (px)
 */
function boxOf({ scene, view }) {
  let [left, top, right, bottom] = [view.width, view.height, 0, 0];
  for (const { x, y, zoneM } of scene.people) {
    const [px, py, edge] = [screenX(view, x), screenY(view, y), zoneM * view.scale + 2];
    const [aside, up] = [Math.max(edge, ASIDE_PX), Math.max(edge, UP_PX)];
    left = Math.min(left, px - aside);
    right = Math.max(right, px + aside);
    top = Math.min(top, py - up);
    bottom = Math.max(bottom, py + up);
  }
  return {
    left: Math.max(0, left),
    top: Math.max(0, top),
    right: Math.min(view.width, right),
    bottom: Math.min(view.height, bottom),
  };
}

/** Whether drawing them costs less than to copy all. @param {Paint} paint @param {Rect} box */
function isFew({ scene, view }, { left, top, right, bottom }) {
  let pixels = 0;
  for (const { zoneM } of scene.people) {
    pixels += (2 * zoneM * view.scale) ** 2 + COPY_PX;
  }
  return right <= left || bottom <= top || pixels <= (right - left) * (bottom - top);
}

/** All that decides how they look. @param {Paint} paint */
function contentOf({ scene, view }) {
  /** @type {unknown[]} */
  const content = [scene.people.length];
  let ages = 0;
  for (const { stage, peer, unknown, isThing, x, y, zoneM } of scene.people) {
    const isSeen = stage === "seen";
    if (!isSeen) ages = Math.floor(scene.nowMs / AGEING_MS);
    content.push(stage, peer, unknown, isThing, x, y);
    if (isSeen) content.push(Math.round(zoneM * view.scale));
  }
  content.push(ages);
  return content;
}
