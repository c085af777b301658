/** Laser scans, the points of each robot in its own hue. */

import { isolated } from "./paint.js";

/** From this scale on (px/m) points are larger. */
const NEAR_SCALE = 40;
const LAST_NUMBER = 65_535;

/**
 * Draws on whole device pixels, of the points of a scan that fall together only one, and
 * none outside the view: a fleet's scans are thousands of points, most of them on the
 * same walls, and each one drawn costs as much as a text.
 */
export function createScanLayer() {
  /** By pixel, the number of the scan that covered it last. */
  let covered = new Uint16Array(0);
  let n = 0;

  /** @param {number} pixels */
  function nextScan(pixels) {
    if (covered.length === pixels && n < LAST_NUMBER) {
      n += 1;
      return;
    }
    covered = new Uint16Array(pixels);
    n = 1;
  }

  /** @param {import("./paint.js").Paint} paint */
  return ({ ctx, view, theme, scene, ratio = 1 }) => {
    const scale = view.scale * ratio;
    const size = Math.round((view.scale > NEAR_SCALE ? 3 : 2) * ratio);
    const [width, height] = [view.width * ratio, view.height * ratio];
    const left = width / 2 - view.x * scale - size / 2;
    const top = height / 2 + view.y * scale - size / 2;
    // The last points of a row or column have their own pixels, too.
    const row = Math.ceil(width) + size;
    const rows = Math.ceil(height) + size;
    isolated(ctx, () => {
      ctx.setTransform(1, 0, 0, 1, 0, 0);
      for (const { points, slot, strength } of scene.scans) {
        nextScan(row * rows);
        ctx.globalAlpha = 0.85 * strength;
        ctx.fillStyle = theme.robots[slot - 1];
        // Rectangles one by one: quicker than one path, which would be tessellated.
        for (let i = 0; i + 1 < points.length; i += 2) {
          const x = Math.round(left + points[i] * scale);
          const y = Math.round(top - points[i + 1] * scale);
          if (x < 0 || y < 0 || x > width || y > height) continue;
          const first = y * row + x;
          if (covered[first] === n) continue;
          for (let at = first; at < first + size * row; at += row) {
            for (let k = 0; k < size; k += 1) covered[at + k] = n;
          }
          ctx.fillRect(x, y, size, size);
        }
      }
    });
  };
}
