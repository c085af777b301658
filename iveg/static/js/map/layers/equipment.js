/** Other equipment that has a place: a small square each, and its number beside it. */

import { screenX, screenY } from "../viewport.js";
import { mayStand } from "./claims.js";
import { isolated, label } from "./paint.js";

/** @typedef {import("./paint.js").Paint} Paint */

const SIDE_PX = 9;
const TEXT_PX = 11;

/** @param {Paint} paint */
export function draw(paint) {
  for (const tile of paint.scene.tiles)
    isolated(paint.ctx, () => drawMark(paint, tile));
}

/** @param {Paint} paint @param {import("../../core/protocol.js").Tile} tile */
function drawMark(paint, tile) {
  const { ctx, view, theme, labels } = paint;
  if (!tile.place) return;
  const [x, y] = [screenX(view, tile.place.x), screenY(view, tile.place.y)];
  const colour = tile.state === "ok" ? theme.text : theme.alert[priorityOf(tile) - 1];
  ctx.fillStyle = theme.bg;
  ctx.strokeStyle = colour;
  ctx.lineWidth = 2;
  ctx.beginPath();
  ctx.rect(x - SIDE_PX / 2, y - SIDE_PX / 2, SIDE_PX, SIDE_PX);
  ctx.fill();
  ctx.stroke();
  const text = labels.tile(tile);
  const below = y + SIDE_PX + TEXT_PX / 2;
  if (!mayStand(paint, text, x, below, TEXT_PX)) return;
  label(paint, text, x, below, { size: TEXT_PX, colour });
}

/** As its alert has it. @param {import("../../core/protocol.js").Tile} tile */
const priorityOf = ({ state }) =>
  state === "low_low" || state === "high_high" ? 2 : 3;
