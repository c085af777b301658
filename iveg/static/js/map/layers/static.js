/**
 * The layers that hardly ever change, drawn once per viewport, theme, language, greenhouse,
 * what is known of it, and where the names of its lanes are.
 *
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {[name: string, draw: (paint: Paint) => void]} StaticLayer
 */

import { laneNames } from "./greenhouse.js";
import { matchPixels } from "./paint.js";

/** The hatching of what no camera sees grows denser with time alone. */
const DENSER_MS = 1000;

/** @param {StaticLayer[]} layers from the ground up */
export function createStaticImage(layers) {
  const canvas = new OffscreenCanvas(1, 1);
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
    canvas.getContext("2d", { alpha: false })
  );
  /** @type {unknown[]} */
  let drawnFor = [];

  /** @param {Paint} paint @param {number} ratio @param {StaticLayer[]} shown */
  function redraw(paint, ratio, shown) {
    const { view, theme } = paint;
    matchPixels(canvas, view, ratio);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.fillStyle = theme.bg;
    ctx.fillRect(0, 0, view.width, view.height);
    for (const [, draw] of shown) draw({ ...paint, ctx });
  }

  return {
    /**
     * @param {Paint} paint
     * @param {number} ratio device pixels per CSS pixel
     * @param {(layer: string) => boolean} isOn
     * @returns {OffscreenCanvas}
     */
    image(paint, ratio, isOn) {
      const shown = layers.filter(([name]) => isOn(name));
      const { coverage, nowMs } = paint.scene;
      const age = coverage && Math.floor(nowMs / DENSER_MS);
      const names = [...laneNames(paint)]
        .map(({ text, x, y }) => `${text} ${x} ${y}`)
        .join();
      const wanted = [...placeOf(paint, ratio), age, names, ...shown];
      if (!isSame(wanted, drawnFor)) redraw(paint, ratio, shown);
      drawnFor = wanted;
      return canvas;
    },
  };
}

/**
 * All that decides where things lie and how they look, but for what moves.
 *
 * @param {Paint} paint
 * @param {number} ratio device pixels per CSS pixel
 */
export function placeOf({ view, theme, labels, scene }, ratio) {
  const { width, height, scale, x, y } = view;
  const told = [scene.map, scene.coverage, scene.costmap];
  return [width, height, scale, x, y, ratio, theme, labels, ...told];
}

/** @param {unknown[]} one @param {unknown[]} other */
export function isSame(one, other) {
  return one.length === other.length && one.every((it, i) => it === other[i]);
}
