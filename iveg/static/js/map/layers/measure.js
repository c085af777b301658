/**
 * The distance between two tapped points, like a tape measure on the floor.
 *
 * The points are in `map`, so the tape stays where it lies while the map moves.
 *
 * @typedef {import("../../core/protocol.js").Point} Point
 * @typedef {{points: readonly Point[]}} Tape none, one or two points (m)
 */

import { screenX, screenY } from "../viewport.js";
import { circle, isolated, label } from "./paint.js";

/**
 * The tape after a tap; a third tap begins a new tape.
 *
 * @param {Tape} tape
 * @param {Point} point (m)
 * @returns {Tape}
 */
export function laidTo(tape, point) {
  const points = tape.points.length < 2 ? tape.points : [];
  return { points: [...points, point] };
}

/** @param {Tape} tape @returns {number | null} (m); null before the second point */
export function lengthOf({ points: [a, b] }) {
  return a && b ? Math.hypot(a.x - b.x, a.y - b.y) : null;
}

/** @param {import("./paint.js").Paint} paint @param {Tape} tape */
export function draw(paint, tape) {
  const { ctx, view, theme, labels } = paint;
  const places = tape.points.map(({ x, y }) => [screenX(view, x), screenY(view, y)]);
  isolated(ctx, () => {
    ctx.beginPath();
    for (const [x, y] of places) ctx.lineTo(x, y);
    stroke(ctx, theme.bg, 5);
    stroke(ctx, theme.text, 2);
    for (const [x, y] of places) {
      circle(ctx, x, y, 5);
      ctx.fillStyle = theme.bg;
      ctx.fill();
      stroke(ctx, theme.text, 2);
    }
    const length = lengthOf(tape);
    if (length === null) return;
    const [[x1, y1], [x2, y2]] = places;
    label(paint, labels.measured(length), (x1 + x2) / 2, (y1 + y2) / 2 - 14, {
      size: 14,
      weight: 700,
    });
  });
}

/** @param {import("./paint.js").Context} ctx @param {string} colour @param {number} width */
function stroke(ctx, colour, width) {
  ctx.strokeStyle = colour;
  ctx.lineWidth = width;
  ctx.stroke();
}
