/**
 * The layers under the robots, drawn when they have changed and copied in between: trails
 * and scans, over the static image.
 *
 * Robots move in every frame; scans come fifteen times a second, each robot's at moments
 * of its own.  They and the trails are thousands of points, so they are drawn together
 * and no more often than that.
 *
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {[name: string, draw: (paint: Paint) => void]} Layer
 */

import { matchPixels } from "./paint.js";
import { isSame, placeOf } from "./static.js";

/** Between two drawings because of scans and trails. */
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

  /** @param {Paint} paint @param {number} ratio @param {(layer: string) => boolean} isOn */
  function redraw(paint, ratio, isOn) {
    const ground = still.image(paint, ratio, isOn);
    matchPixels(canvas, paint.view, ratio);
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.drawImage(ground, 0, 0);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    for (const [name, draw] of layers) if (isOn(name)) draw({ ...paint, ctx });
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
      if (!isMoved && isSame(content, drawn)) return 0;
      const waitedMs = Math.abs(nowMs - drawnAtMs);
      if (!isMoved && waitedMs < TOGETHER_MS) return TOGETHER_MS - waitedMs;
      redraw(paint, ratio, isOn);
      [drawnFor, drawn, drawnAtMs] = [wanted, content, nowMs];
      return 0;
    },
  };
}

/** @param {Paint} paint */
function contentOf({ scene }) {
  return [
    Math.floor(scene.nowMs / FADING_MS),
    ...scene.robots.map(({ id }) => id),
    ...scene.scans.flatMap(({ points, strength }) => [points, strength]),
  ];
}
