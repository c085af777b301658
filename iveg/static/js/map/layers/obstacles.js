/**
 * What robots' own lasers see near them and nothing explains: where their reports say.
 *
 * @typedef {import("./paint.js").Paint} Paint
 */

import { screenX, screenY } from "../viewport.js";
import { circle, isolated } from "./paint.js";

const LEAST_PX = 4;
const DASH_PX = [3, 2];

/** @param {Paint} paint */
export function draw({ ctx, view, scene, theme }) {
  isolated(ctx, () => {
    ctx.strokeStyle = theme.text;
    ctx.lineWidth = 2;
    ctx.setLineDash(DASH_PX);
    for (const { obstacle } of scene.robots) {
      if (!obstacle) continue;
      const { x, y, width_m } = obstacle;
      const radius = Math.max(LEAST_PX, (width_m / 2) * view.scale);
      circle(ctx, screenX(view, x), screenY(view, y), radius);
      ctx.stroke();
    }
  });
}
