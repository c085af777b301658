/**
 * The layers under the robots, drawn when they have changed and copied in between: trails,
 * scans, detections and all that robots mean to do, over the static image.
 *
 * Robots move in every frame; scans and detections come fifteen times a second, each
 * robot's at moments of its own.  They and the trails are thousands of points and strokes,
 * so they are drawn together and no more often than that.
 *
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {[name: string, draw: (paint: Paint) => void]} Layer
 */

import { matchPixels } from "./paint.js";
import { isSame, placeOf } from "./static.js";

/** Between two drawings because of what is in it. */
const TOGETHER_MS = 66;
/** Trails fade with time alone. */
const FADING_MS = 250;

/**
 * @param {{image: (paint: Paint, ratio: number, isOn: (layer: string) => boolean) =>
 *   OffscreenCanvas}} still the static layers under it
 * @param {Layer[]} layers from the ground up
 * @param {() => unknown[]} look the other values that decide how they look
 * @param {() => number} steps of all trails so far
 */
export function createGround(still, layers, look, steps) {
  const canvas = new OffscreenCanvas(1, 1);
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
    canvas.getContext("2d", { alpha: false })
  );
  /** @type {unknown[]} */
  let drawnFor = [];
  /** @type {unknown[]} */
  let drawn = [];
  let drawnAtMs = 0;
  /** @type {readonly import("../viewport.js").Rect[]} those of the labels in it */
  let labels = [];

  /** @param {Paint} paint @param {number} ratio @param {(layer: string) => boolean} isOn */
  function redraw(paint, ratio, isOn) {
    const ground = still.image(paint, ratio, isOn);
    matchPixels(canvas, paint.view, ratio);
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.drawImage(ground, 0, 0);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    for (const [name, draw] of layers) if (isOn(name)) draw({ ...paint, ctx });
    labels = [...(paint.places?.labels() ?? [])];
  }

  return {
    canvas,
    /**
     * Brings the picture up to date.
     *
     * @param {Paint} paint
     * @param {number} ratio device pixels per CSS pixel
     * @param {(layer: string) => boolean} isOn
     * @returns {number} when what is missing may be drawn (ms from now); 0: all is there
     */
    update(paint, ratio, isOn) {
      const { nowMs } = paint.scene;
      const wanted = [...placeOf(paint, ratio), ...look()];
      const content = [steps(), ...contentOf(paint)];
      const isMoved = !isSame(wanted, drawnFor);
      const waitedMs = Math.abs(nowMs - drawnAtMs);
      const isNew = !isSame(content, drawn);
      if (!isMoved && (!isNew || waitedMs < TOGETHER_MS)) {
        paint.places?.keep(labels);
        return isNew ? TOGETHER_MS - waitedMs : 0;
      }
      redraw(paint, ratio, isOn);
      [drawnFor, drawn, drawnAtMs] = [wanted, content, nowMs];
      return 0;
    },
  };
}

/** All that is drawn of what moves or changes. @param {Paint} paint */
function contentOf({ scene }) {
  const { robots, people, detections, scans, tiles } = scene;
  /** @type {unknown[]} */
  const content = [Math.floor(scene.nowMs / FADING_MS), ...tiles];
  // Links end at robots, and boxes turn with them.
  const isBound = people.length > 0 || detections.length > 0;
  for (const { id, link, pose, goal, path, task, encounters } of robots) {
    content.push(id, link, goal, path, task, encounters, isBound && pose);
  }
  for (const { x, y, stage, observers, acting } of people) {
    content.push(x, y, stage, observers, acting);
  }
  for (const { item } of detections) content.push(item);
  for (const { points, strength } of scans) content.push(points, strength);
  return content;
}
