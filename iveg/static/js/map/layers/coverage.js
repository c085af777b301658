/**
 * Areas without coverage: the longer no camera has seen a spot of a lane, the denser its
 * hatching.  A hatched spot without a person drawn in it may have one; it is quiet all
 * the same, for what is seen has to stand out.
 *
 * @typedef {import("../../core/protocol.js").Coverage} Coverage
 * @typedef {import("./paint.js").Paint} Paint
 */

import { screenX, screenY } from "../viewport.js";
import { isolated } from "./paint.js";

/** Age from which a cell is hatched (s), and how strongly; the last is for never seen. */
const STEPS = [
  { fromS: 10, alpha: 0.16 },
  { fromS: 60, alpha: 0.28 },
  { fromS: 600, alpha: 0.42 },
];
const HATCH_PX = 9;

/**
 * Strength of a cell's hatching, 0–1.
 *
 * @param {number | null} ageS null: never seen
 */
export function hatchAt(ageS) {
  if (ageS === null) return STEPS[STEPS.length - 1].alpha;
  return STEPS.findLast(({ fromS }) => ageS >= fromS)?.alpha ?? 0;
}

/** @param {Paint} paint */
export function draw(paint) {
  const { ctx, scene, theme } = paint;
  const coverage = scene.coverage;
  if (!coverage) return;
  const sinceS = Math.max(0, scene.nowMs - (coverage.receivedAtMs ?? 0)) / 1000;
  isolated(ctx, () => {
    ctx.fillStyle = hatchOf(ctx, theme.muted);
    for (const lane of coverage.lanes) drawLane(paint, lane, sinceS);
  });
}

/**
 * @param {Paint} paint
 * @param {Coverage["lanes"][number]} lane
 * @param {number} sinceS since the ages were told
 */
function drawLane({ ctx, view }, lane, sinceS) {
  const [width, height] = [
    ((lane.xmax - lane.xmin) / lane.columns) * view.scale,
    ((lane.ymax - lane.ymin) / lane.rows) * view.scale,
  ];
  const [left, bottom] = [screenX(view, lane.xmin), screenY(view, lane.ymin)];
  for (let row = 0; row < lane.rows; row += 1) {
    for (let column = 0; column < lane.columns; column += 1) {
      const told = lane.ages_s[row * lane.columns + column];
      ctx.globalAlpha = hatchAt(told === null ? null : told + sinceS);
      if (!ctx.globalAlpha) continue;
      const [x, y] = [left + column * width, bottom - (row + 1) * height];
      ctx.fillRect(x, y, width, height);
    }
  }
}

/** @type {Map<string, OffscreenCanvas>} */
const tiles = new Map();

/**
 * Slanting lines that run on from cell to cell.
 *
 * @param {import("./paint.js").Context} ctx
 * @param {string} ink
 */
function hatchOf(ctx, ink) {
  const tile = tiles.get(ink) ?? makeTile(ink);
  tiles.set(ink, tile);
  return /** @type {CanvasPattern} */ (ctx.createPattern(tile, "repeat"));
}

/** @param {string} ink */
function makeTile(ink) {
  const tile = new OffscreenCanvas(HATCH_PX, HATCH_PX);
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (tile.getContext("2d"));
  ctx.strokeStyle = ink;
  ctx.lineWidth = 1;
  ctx.beginPath();
  for (const shift of [-HATCH_PX, 0, HATCH_PX]) {
    ctx.moveTo(shift, HATCH_PX);
    ctx.lineTo(shift + HATCH_PX, 0);
  }
  ctx.stroke();
  return tile;
}
