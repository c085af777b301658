/** Laser scans, the points of each robot in its own hue. */

import { isolated } from "./paint.js";

/** @param {import("./paint.js").Paint} paint */
export function draw({ ctx, view, theme, scene }) {
  const size = view.scale > 40 ? 3 : 2;
  const left = view.width / 2 - view.x * view.scale - size / 2;
  const top = view.height / 2 + view.y * view.scale - size / 2;
  isolated(ctx, () => {
    for (const { points, slot, strength } of scene.scans) {
      ctx.globalAlpha = 0.85 * strength;
      ctx.fillStyle = theme.robots[slot - 1];
      // Rectangles one by one: quicker than one path, which would be tessellated.
      for (let i = 0; i + 1 < points.length; i += 2) {
        const x = left + points[i] * view.scale;
        const y = top - points[i + 1] * view.scale;
        ctx.fillRect(x, y, size, size);
      }
    }
  });
}
