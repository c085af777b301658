/** Detections of the newest frames: footprints, faint below the threshold. */

import { screenX, screenY } from "../viewport.js";
import { mayStand } from "./claims.js";
import { isolated, label } from "./paint.js";

/**
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("../scene.js").SceneDetection} SceneDetection
 */

/** Smaller boxes than this (px) would be invisible. */
const SMALLEST_PX = 10;
const WORDS_FROM_SCALE = 22;

/** @param {Paint} paint */
export function draw(paint) {
  for (const detection of paint.scene.detections) {
    isolated(paint.ctx, () => drawDetection(paint, detection));
  }
}

/** @param {Paint} paint @param {SceneDetection} detection */
function drawDetection(paint, detection) {
  const { ctx, view, theme, labels } = paint;
  const length = Math.max(SMALLEST_PX, detection.length * view.scale);
  const width = Math.max(SMALLEST_PX, detection.width * view.scale);
  ctx.translate(screenX(view, detection.x), screenY(view, detection.y));
  ctx.globalAlpha = detection.confident ? 0.9 : 0.4;
  ctx.strokeStyle = theme.robots[detection.slot - 1];
  ctx.lineWidth = detection.confident ? 2 : 1.5;
  ctx.setLineDash(detection.confident ? [] : [3, 3]);
  ctx.save();
  ctx.rotate(-detection.yaw);
  ctx.strokeRect(-length / 2, -width / 2, length, width);
  ctx.restore();
  if (detection.named || view.scale < WORDS_FROM_SCALE) return;
  const text = `${labels.seen(detection.item.class_id)} ${labels.percent(detection.probability)}`;
  const [x, y] = [screenX(view, detection.x), screenY(view, detection.y)];
  if (!mayStand(paint, text, x, y - width / 2 - 9, 11)) return;
  ctx.globalAlpha = detection.confident ? 1 : 0.75;
  label(paint, text, 0, -width / 2 - 9, { size: 11, weight: 500 });
}
