/** A veil over everything when the server is unreachable: the map below is of the past. */

import { isolated } from "./paint.js";

const STRIPE_EVERY_PX = 18;

/** @param {import("./paint.js").Paint} paint */
export function drawVeil({ ctx, view, theme }) {
  isolated(ctx, () => {
    ctx.globalAlpha = 0.55;
    ctx.fillStyle = theme.bg;
    ctx.fillRect(0, 0, view.width, view.height);
    ctx.globalAlpha = 0.22;
    ctx.strokeStyle = theme.muted;
    ctx.lineWidth = 4;
    ctx.beginPath();
    for (let x = -view.height; x < view.width; x += STRIPE_EVERY_PX) {
      ctx.moveTo(x, view.height);
      ctx.lineTo(x + view.height, 0);
    }
    ctx.stroke();
  });
}
