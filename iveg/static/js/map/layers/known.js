/**
 * What lasers know to stand beside the plan, or an operator says so: quiet, for it slows
 * nobody, and never over anybody.
 *
 * @typedef {import("./paint.js").Paint} Paint
 */

import { screenX, screenY } from "../viewport.js";
import { circle, isolated } from "./paint.js";

const STRENGTH = 0.6;
const DASH_PX = [2, 3];
const DOT_PX = 1.5;

/** @param {Paint} paint */
export function draw({ ctx, view, scene, theme }) {
  if (!scene.known) return;
  const { items } = scene.known;
  isolated(ctx, () => {
    ctx.globalAlpha = STRENGTH;
    ctx.strokeStyle = theme.muted;
    ctx.fillStyle = theme.muted;
    ctx.lineWidth = 1;
    ctx.setLineDash(DASH_PX);
    for (const { x, y, radius_m } of items) {
      const [left, top] = [screenX(view, x), screenY(view, y)];
      circle(ctx, left, top, radius_m * view.scale);
      ctx.stroke();
      circle(ctx, left, top, DOT_PX);
      ctx.fill();
    }
  });
}

/** For the legend. */
export const SIGN = {
  name: "known",
  layer: "known",
  draw,
  scene: {
    known: { items: [{ x: 0, y: 0, radius_m: 0.3, since: "", thing_id: null }] },
  },
};
