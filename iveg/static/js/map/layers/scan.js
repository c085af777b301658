/** Laser scans, the points of each robot in its own hue. */

import { isolated, matchPixels } from "./paint.js";

/** From this scale on (px/m) points are larger. */
const NEAR_SCALE = 40;
const OPACITY = 0.85;

/**
 * Writes the points into an image of the whole view: a fleet's scans are thousands of
 * points, and a rectangle for each costs more than all pixels of the view.
 */
export function createScanLayer() {
  const canvas = new OffscreenCanvas(1, 1);
  const image = /** @type {OffscreenCanvasRenderingContext2D} */ (
    canvas.getContext("2d")
  );
  const hues = createHues();
  let pixels = image.createImageData(1, 1);

  function clear() {
    const { width, height } = canvas;
    if (pixels.width === width && pixels.height === height) pixels.data.fill(0);
    else pixels = image.createImageData(width, height);
  }

  /** @param {import("./paint.js").Paint} paint */
  return ({ ctx, view, theme, scene, ratio = 1 }) => {
    if (!scene.scans.length) return;
    matchPixels(canvas, view, ratio);
    clear();
    const scale = view.scale * ratio;
    const size = Math.round((view.scale > NEAR_SCALE ? 3 : 2) * ratio);
    const left = (view.width * ratio) / 2 - view.x * scale - size / 2;
    const top = (view.height * ratio) / 2 + view.y * scale - size / 2;
    for (const { points, slot, strength } of scene.scans) {
      const ink = hues.ink(theme.robots[slot - 1], OPACITY * strength);
      write(pixels, { points, scale, left, top, size, ink });
    }
    image.putImageData(pixels, 0, 0);
    isolated(ctx, () => {
      ctx.setTransform(1, 0, 0, 1, 0, 0);
      ctx.drawImage(canvas, 0, 0);
    });
  };
}

/**
 * Squares of whole pixels, those that lie in the image as a whole.
 *
 * @param {ImageData} pixels
 * @param {{points: Float32Array, scale: number, left: number, top: number,
 *   size: number, ink: number}} scan points (m), the rest in device pixels
 */
function write({ data, width, height }, { points, scale, left, top, size, ink }) {
  const inks = new Uint32Array(data.buffer);
  for (let i = 0; i + 1 < points.length; i += 2) {
    const x = Math.round(left + points[i] * scale);
    const y = Math.round(top - points[i + 1] * scale);
    if (x < 0 || y < 0 || x > width - size || y > height - size) continue;
    const first = y * width + x;
    for (let at = first; at < first + size * width; at += width) {
      for (let k = 0; k < size; k += 1) inks[at + k] = ink;
    }
  }
}

/** Colours of any CSS syntax as pixels of an image. */
function createHues() {
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
    new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true })
  );
  /** @type {Map<string, Uint8ClampedArray>} */
  const known = new Map();
  return {
    /** @param {string} colour @param {number} opacity 0–1 */
    ink(colour, opacity) {
      const pixel = known.get(colour) ?? pixelOf(ctx, colour);
      known.set(colour, pixel);
      pixel[3] = Math.round(255 * opacity);
      return new Uint32Array(pixel.buffer)[0];
    },
  };
}

/** @param {OffscreenCanvasRenderingContext2D} ctx @param {string} colour */
function pixelOf(ctx, colour) {
  ctx.clearRect(0, 0, 1, 1);
  ctx.fillStyle = colour;
  ctx.fillRect(0, 0, 1, 1);
  return ctx.getImageData(0, 0, 1, 1).data;
}
