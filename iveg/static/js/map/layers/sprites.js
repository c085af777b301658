/**
 * Images of signs that look alike, each drawn once: to copy one costs less than its
 * circles and strokes.
 *
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {ReturnType<typeof createSprites>} Sprites
 * @typedef {{name: string, reach: number, x: number, y: number}} Sign `name`: of all that
 *   look the same; `reach`: from its centre (px); `x`, `y`: of its centre (px)
 */

import { isolated } from "./paint.js";

/** Larger signs (device pixels each way) are drawn themselves. */
const LARGEST_PX = 512;
/** A zoom leaves sizes behind that are not wanted again (device pixels of all images). */
const KEPT_PX = 6e6;

export function createSprites() {
  /** @type {Map<string, ImageBitmap>} */
  const images = new Map();
  /** @type {import("./theme.js").Theme | null} */
  let theme = null;
  let keptPx = 0;

  function clear() {
    for (const image of images.values()) image.close();
    images.clear();
    keptPx = 0;
  }

  /** @param {Paint} paint @param {number} size @param {(paint: Paint) => void} draw */
  function imageOf(paint, size, draw) {
    const canvas = new OffscreenCanvas(size, size);
    const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
      canvas.getContext("2d")
    );
    const { ratio = 1 } = paint;
    ctx.setTransform(ratio, 0, 0, ratio, size / 2, size / 2);
    draw({ ...paint, ctx });
    return canvas.transferToImageBitmap();
  }

  return {
    /**
     * Draws a sign on whole device pixels.
     *
     * @param {Paint} paint
     * @param {Sign} sign
     * @param {(paint: Paint) => void} draw it about the origin
     */
    copy(paint, { name, reach, x, y }, draw) {
      const { ctx, ratio = 1 } = paint;
      const size = 2 * Math.ceil(reach * ratio);
      if (size > LARGEST_PX) return drawItself(paint, { x, y }, draw);
      if (theme !== paint.theme || keptPx > KEPT_PX) clear();
      theme = paint.theme;
      const key = `${name} ${size} ${ratio}`;
      let image = images.get(key);
      if (!image) {
        image = imageOf(paint, size, draw);
        images.set(key, image);
        keptPx += size ** 2;
      }
      const [left, top] = [x, y].map((at) => Math.round(at * ratio) - size / 2);
      // The context's unit is a CSS pixel.
      const [aside, down, across] = [left / ratio, top / ratio, size / ratio];
      ctx.drawImage(image, aside, down, across, across);
    },
  };
}

/**
 * A copy of a sign where images are kept, else the sign itself.
 *
 * @param {Paint} paint
 * @param {Sprites | undefined} sprites
 * @param {Sign} sign
 * @param {(paint: Paint) => void} draw it about the origin
 */
export function drawSign(paint, sprites, sign, draw) {
  if (sprites) sprites.copy(paint, sign, draw);
  else drawItself(paint, sign, draw);
}

/**
 * @param {Paint} paint
 * @param {{x: number, y: number}} place
 * @param {(paint: Paint) => void} draw
 */
function drawItself(paint, { x, y }, draw) {
  isolated(paint.ctx, () => {
    paint.ctx.translate(x, y);
    draw(paint);
  });
}
