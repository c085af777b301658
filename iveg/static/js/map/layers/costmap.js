/**
 * The shared costmap: the higher the cost of a cell, the darker.
 *
 * One pixel a cell, painted once per grid and stretched by the canvas: a hundred
 * thousand cells cost one image a frame.
 *
 * @typedef {import("../../core/protocol.js").Costmap} Costmap
 */

import { screenX, screenY } from "../viewport.js";
import { isolated } from "./paint.js";

/** Opacity of a cell with cost 100; lower costs in proportion. */
const DARKEST = 0.2;

/** Draws grids, keeping the image of the newest. */
export function createCostmapLayer() {
  const image = new OffscreenCanvas(1, 1);
  /** @type {Costmap | null} */
  let drawn = null;
  let inkOf = "";

  /** @param {Costmap} grid @param {string} ink */
  function redraw(grid, ink) {
    image.width = grid.width;
    image.height = grid.height;
    const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
      image.getContext("2d")
    );
    const pixels = ctx.createImageData(grid.width, grid.height);
    writeAlpha(pixels.data, grid);
    ctx.putImageData(pixels, 0, 0);
    ctx.globalCompositeOperation = "source-in";
    ctx.fillStyle = ink;
    ctx.fillRect(0, 0, grid.width, grid.height);
    [drawn, inkOf] = [grid, ink];
  }

  /** @param {import("./paint.js").Paint} paint */
  return function draw({ ctx, view, theme, scene }) {
    const grid = scene.costmap;
    if (!grid?.width || !grid.height) return;
    if (grid !== drawn || inkOf !== theme.text) redraw(grid, theme.text);
    const [width, height] = [grid.width, grid.height].map(
      (cells) => cells * grid.resolution,
    );
    const x = screenX(view, grid.origin.x);
    const y = screenY(view, grid.origin.y + height);
    isolated(ctx, () => {
      ctx.imageSmoothingEnabled = false;
      ctx.drawImage(image, x, y, width * view.scale, height * view.scale);
    });
  };
}

/**
 * Costs as opacity; free and unknown cells stay clear.  A grid's first row is its
 * southernmost, an image's its uppermost.
 *
 * @param {Uint8ClampedArray} pixels Shape (height, width, 4)
 * @param {Costmap} grid
 */
export function writeAlpha(pixels, { width, height, data }) {
  for (let row = 0; row < height; row += 1) {
    for (let column = 0; column < width; column += 1) {
      const cost = Math.max(0, data[row * width + column]);
      const pixel = (height - 1 - row) * width + column;
      pixels[4 * pixel + 3] = Math.round((DARKEST * 255 * cost) / 100);
    }
  }
}
