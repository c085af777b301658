/** The metre grid under everything, for an open field without walls. */

import { screenX, screenY, visible } from "../viewport.js";
import { isolated } from "./paint.js";

/** Lines closer than this (px) would be a tint, not a grid. */
const CLOSEST_PX = 34;

/** @param {import("./paint.js").Paint} paint */
export function draw({ ctx, view, theme }) {
  const step = [1, 2, 5, 10, 20, 50, 100].find((m) => m * view.scale > CLOSEST_PX);
  if (!step) return;
  const { xmin, xmax, ymin, ymax } = visible(view);
  isolated(ctx, () => {
    ctx.strokeStyle = theme.grid;
    ctx.lineWidth = 1;
    ctx.beginPath();
    for (let x = Math.ceil(xmin / step) * step; x <= xmax; x += step) {
      const px = Math.round(screenX(view, x)) + 0.5;
      ctx.moveTo(px, 0);
      ctx.lineTo(px, view.height);
    }
    for (let y = Math.ceil(ymin / step) * step; y <= ymax; y += step) {
      const py = Math.round(screenY(view, y)) + 0.5;
      ctx.moveTo(0, py);
      ctx.lineTo(view.width, py);
    }
    ctx.stroke();
  });
}
