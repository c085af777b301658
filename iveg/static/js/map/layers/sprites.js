/**
 * Images of signs that look alike, each drawn once: to copy one costs a tenth of its
 * circles and strokes.
 *
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {ReturnType<typeof createSprites>} Sprites
 */

import { isolated } from "./paint.js";

/** Larger signs (device pixels each way) are drawn themselves. */
const LARGEST_PX = 512;
/** A zoom leaves sizes behind that are not wanted again. */
const KEPT = 64;

export function createSprites() {
  /** @type {Map<string, ImageBitmap>} */
  const images = new Map();
  /** @type {import("./theme.js").Theme | null} */
  let theme = null;

  /** @param {Paint} paint @param {number} size @param {(paint: Paint) => void} sign */
  function imageOf(paint, size, sign) {
    const canvas = new OffscreenCanvas(size, size);
    const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
      canvas.getContext("2d")
    );
    const { ratio = 1 } = paint;
    ctx.setTransform(ratio, 0, 0, ratio, size / 2, size / 2);
    sign({ ...paint, ctx });
    return canvas.transferToImageBitmap();
  }

  return {
    /**
     * Draws a sign on whole device pixels.
     *
     * @param {Paint} paint
     * @param {{name: string, reach: number, x: number, y: number}} place `name`: of all
     *   that look the same; `reach`: of the sign from its centre (px)
     * @param {(paint: Paint) => void} sign draws it about the origin
     */
    draw(paint, { name, reach, x, y }, sign) {
      const { ctx, ratio = 1 } = paint;
      const size = 2 * Math.ceil(reach * ratio);
      isolated(ctx, () => {
        if (size > LARGEST_PX) {
          ctx.translate(x, y);
          sign(paint);
          return;
        }
        if (theme !== paint.theme || images.size > KEPT) images.clear();
        theme = paint.theme;
        const key = `${name} ${size} ${ratio}`;
        const image = images.get(key) ?? imageOf(paint, size, sign);
        images.set(key, image);
        ctx.setTransform(1, 0, 0, 1, 0, 0);
        const [left, top] = [x, y].map((at) => Math.round(at * ratio) - size / 2);
        ctx.drawImage(image, left, top);
      });
    },
  };
}
