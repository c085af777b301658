/** The scale bar: the length of a metre on this screen. */

import { isolated, label } from "./paint.js";
import { drawSign } from "./sprites.js";

/** @typedef {import("./paint.js").Paint} Paint */

const LONGEST_PX = 130;
const MARGIN_PX = 16;
/** With its label. */
const TALL_PX = 22;
const STEPS_M = [200, 100, 50, 20, 10, 5, 2, 1, 0.5, 0.2, 0.1];

/** @param {number} scale (px/m) @returns {number} (m) */
export function barLength(scale) {
  return STEPS_M.find((m) => m * scale <= LONGEST_PX) ?? 0.1;
}

/**
 * Where a bar of any length may lie.
 *
 * @param {{height: number}} view
 * @returns {import("../viewport.js").Rect}
 */
export function coverOf({ height }) {
  const right = MARGIN_PX + LONGEST_PX;
  return { left: 0, top: height - MARGIN_PX - TALL_PX, right, bottom: height };
}

/** @param {Paint} paint */
export function draw(paint) {
  const { view, labels, sprites } = paint;
  const metres = barLength(view.scale);
  const length = metres * view.scale;
  const said = labels.metres(metres);
  const place = { x: MARGIN_PX + length / 2, y: view.height - MARGIN_PX };
  const sign = { name: `scale ${length} ${said}`, reach: length / 2 + 3, ...place };
  drawSign(paint, sprites, sign, (there) => drawBar(there, length / 2, said));
}

/** @param {Paint} paint @param {number} half its length (px) @param {string} said */
function drawBar(paint, half, said) {
  const { ctx, theme } = paint;
  isolated(ctx, () => {
    ctx.beginPath();
    ctx.moveTo(-half, -6);
    ctx.lineTo(-half, 0);
    ctx.lineTo(half, 0);
    ctx.lineTo(half, -6);
    ctx.strokeStyle = theme.bg;
    ctx.lineWidth = 5;
    ctx.stroke();
    ctx.strokeStyle = theme.text;
    ctx.lineWidth = 2;
    ctx.stroke();
    label(paint, said, 0, -13);
  });
}
