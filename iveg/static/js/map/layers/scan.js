/** Laser scans, the points of each robot in its own hue. */

import { isolated, matchPixels } from "./paint.js";

/** From this scale on (px/m) points are larger. */
const NEAR_SCALE = 40;
const OPACITY = 0.85;

/**
 * @typedef {import("../viewport.js").Rect} Box (device px)
 */

/**
 * Writes the points into an image of the view: a fleet's scans are thousands of points,
 * and a rectangle for each costs more than all pixels of the view.  Only the part that has
 * points is cleared and copied.
 */
export function createScanLayer() {
  const canvas = new OffscreenCanvas(1, 1);
  const image = /** @type {OffscreenCanvasRenderingContext2D} */ (
    canvas.getContext("2d")
  );
  const hues = createHues();
  let pixels = image.createImageData(1, 1);
  let inks = new Uint32Array(pixels.data.buffer);
  let drawn = emptyBox();

  /** An image without points, of the canvas's size. */
  function clear() {
    const { width, height } = canvas;
    if (pixels.width === width && pixels.height === height) {
      for (let y = drawn.top; y < drawn.bottom; y += 1) {
        inks.fill(0, y * width + drawn.left, y * width + drawn.right);
      }
      return;
    }
    pixels = image.createImageData(width, height);
    inks = new Uint32Array(pixels.data.buffer);
    drawn = emptyBox();
  }

  /** @param {Box} box what has points now; what had before is cleared */
  function put(box) {
    const { left, top, right, bottom } = around(drawn, box);
    if (right > left) {
      image.putImageData(pixels, 0, 0, left, top, right - left, bottom - top);
    }
    drawn = box;
  }

  /** @param {import("./paint.js").Paint} paint */
  return ({ ctx, view, theme, scene, ratio = 1 }) => {
    if (!scene.scans.length) return;
    matchPixels(canvas, view, ratio);
    clear();
    const { width } = canvas;
    const scale = view.scale * ratio;
    const size = Math.round((view.scale > NEAR_SCALE ? 3 : 2) * ratio);
    const left = (view.width * ratio) / 2 - view.x * scale - size / 2;
    const top = (view.height * ratio) / 2 + view.y * scale - size / 2;
    let box = emptyBox();
    for (const { points, slot, strength } of scene.scans) {
      const ink = hues.ink(theme.robots[slot - 1], OPACITY * strength);
      const place = { points, scale, left, top, size, ink };
      box = around(box, write({ inks, width, height: canvas.height }, place));
    }
    put(box);
    const [across, down] = [box.right - box.left, box.bottom - box.top];
    if (across <= 0) return;
    isolated(ctx, () => {
      const { left: x, top: y } = box;
      ctx.setTransform(1, 0, 0, 1, 0, 0);
      ctx.drawImage(canvas, x, y, across, down, x, y, across, down);
    });
  };
}

/** @returns {Box} of nothing: around anything else it is that */
function emptyBox() {
  const [least, most] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
  return { left: least, top: least, right: most, bottom: most };
}

/** @param {Box} one @param {Box} other @returns {Box} */
function around(one, other) {
  return {
    left: Math.min(one.left, other.left),
    top: Math.min(one.top, other.top),
    right: Math.max(one.right, other.right),
    bottom: Math.max(one.bottom, other.bottom),
  };
}

/**
 * Squares of whole pixels, those that lie in the image as a whole.
 *
 * @param {{inks: Uint32Array, width: number, height: number}} image
 * @param {{points: Float32Array, scale: number, left: number, top: number,
 *   size: number, ink: number}} scan points (m), the rest in device pixels
 * @returns {Box} around all of them
 */
function write({ inks, width, height }, { points, scale, left, top, size, ink }) {
  let [least, highest, most, lowest] = [width, height, -size, -size];
  for (let i = 0; i + 1 < points.length; i += 2) {
    const x = Math.round(left + points[i] * scale);
    const y = Math.round(top - points[i + 1] * scale);
    if (!(x >= 0 && y >= 0 && x <= width - size && y <= height - size)) continue;
    if (x < least) least = x;
    if (x > most) most = x;
    if (y < highest) highest = y;
    if (y > lowest) lowest = y;
    const first = y * width + x;
    for (let at = first; at < first + size * width; at += width) {
      for (let k = 0; k < size; k += 1) inks[at + k] = ink;
    }
  }
  if (most < least) return emptyBox();
  return { left: least, top: highest, right: most + size, bottom: lowest + size };
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
