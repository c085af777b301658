/** The greenhouse: walls, lanes with their labels, crop rows, posts, crates and trolleys. */

import { screenX, screenY } from "../viewport.js";
import { circle, isolated, label } from "./paint.js";

/**
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("../../core/protocol.js").Box2D} Box2D
 */

/** Distance of plants and of their lines (m); drawn where they can be told apart. */
const PLANT_EVERY_M = 0.5;
const PLANT_LINE_M = 0.8;
const PLANT_FROM_SCALE = 14;
/** No greenhouse is this long. */
const OPEN_FIELD_M = 10_000;

/** @param {Paint} paint */
export function draw(paint) {
  const { ctx, scene } = paint;
  const map = scene.map;
  if (!map) return;
  isolated(ctx, () => {
    if (hasArea(map.bounds)) drawWalls(paint, map.bounds);
    for (const lane of map.lanes) fillBox(paint, lane, paint.theme.lane);
    for (const row of map.rows) drawRow(paint, row);
    for (const thing of map.obstacles) drawObstacle(paint, thing);
    for (const post of map.posts) drawPost(paint, post);
    drawLaneNames(paint);
  });
}

/**
 * Whether a map has walls; an open field has none, or none within sight.
 *
 * @param {Box2D | null | undefined} bounds
 * @returns {bounds is Box2D}
 */
export function hasArea(bounds) {
  if (!bounds) return false;
  const [across, along] = [bounds.xmax - bounds.xmin, bounds.ymax - bounds.ymin];
  return across > 0 && along > 0 && Math.max(across, along) < OPEN_FIELD_M;
}

/** @param {Paint} paint @param {Box2D} bounds */
function drawWalls(paint, bounds) {
  const { ctx, theme } = paint;
  const [x, y, width, height] = rectOf(paint, bounds);
  ctx.save();
  ctx.globalAlpha = 0.4;
  ctx.fillStyle = theme.lane;
  ctx.fillRect(x, y, width, height);
  ctx.restore();
  ctx.strokeStyle = theme.post;
  ctx.lineWidth = 3;
  ctx.beginPath();
  ctx.roundRect(x - 1.5, y - 1.5, width + 3, height + 3, 4);
  ctx.stroke();
}

/** @param {Paint} paint @param {Box2D} row */
function drawRow(paint, row) {
  const { ctx, theme, view } = paint;
  const [x, y, width, height] = rectOf(paint, row);
  ctx.fillStyle = theme.crop;
  ctx.beginPath();
  ctx.roundRect(x, y, width, height, Math.min(6, width / 3, height / 3));
  ctx.fill();
  if (view.scale >= PLANT_FROM_SCALE) drawPlants(paint, row);
}

/**
 * Leaves as discs lighter than the row: texture that tells crop from wall at a glance.
 *
 * @param {Paint} paint
 * @param {Box2D} row
 */
function drawPlants({ ctx, view, theme }, row) {
  ctx.save();
  ctx.globalAlpha = 0.28;
  ctx.fillStyle = theme.lane;
  ctx.beginPath();
  for (const { x, y, radius } of plantsIn(row)) {
    const [px, py, r] = [screenX(view, x), screenY(view, y), radius * view.scale];
    ctx.moveTo(px + r, py);
    ctx.arc(px, py, r, 0, 2 * Math.PI);
  }
  ctx.fill();
  ctx.restore();
}

/**
 * Plants in lines along the longer side of a row (m).
 *
 * @param {Box2D} row
 */
function* plantsIn(row) {
  const [width, height] = [row.xmax - row.xmin, row.ymax - row.ymin];
  const lines = width < height ? PLANT_LINE_M : PLANT_EVERY_M;
  const across = Math.max(1, Math.round(width / lines));
  const along = width < height ? PLANT_EVERY_M : PLANT_LINE_M;
  const up = Math.max(1, Math.round(height / along));
  const radius = 0.38 * Math.min(PLANT_EVERY_M, width / across, height / up);
  for (let i = 0; i < across; i += 1) {
    for (let j = 0; j < up; j += 1) {
      const x = row.xmin + ((i + 0.5) * width) / across;
      yield { x, y: row.ymin + ((j + 0.5) * height) / up, radius };
    }
  }
}

/** @param {Paint} paint @param {{x: number, y: number, radius: number}} post */
function drawPost({ ctx, view, theme }, post) {
  const radius = Math.max(2, post.radius * view.scale);
  circle(ctx, screenX(view, post.x), screenY(view, post.y), radius);
  ctx.fillStyle = theme.post;
  ctx.fill();
}

/**
 * A crate stack carries a cross, anything else on wheels two axles.
 *
 * @param {Paint} paint
 * @param {{kind: string} & Box2D} thing
 */
function drawObstacle(paint, thing) {
  const { ctx, theme } = paint;
  const [x, y, width, height] = rectOf(paint, thing);
  ctx.strokeStyle = theme.post;
  ctx.fillStyle = theme.bg;
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.roundRect(x, y, width, height, 2);
  ctx.fill();
  ctx.stroke();
  ctx.beginPath();
  if (thing.kind.startsWith("crate")) {
    ctx.moveTo(x, y);
    ctx.lineTo(x + width, y + height);
    ctx.moveTo(x + width, y);
    ctx.lineTo(x, y + height);
  } else {
    ctx.moveTo(x, y + height / 4);
    ctx.lineTo(x + width, y + height / 4);
    ctx.moveTo(x, y + (3 * height) / 4);
    ctx.lineTo(x + width, y + (3 * height) / 4);
  }
  ctx.lineWidth = 1;
  ctx.stroke();
}

/**
 * Which place of its lane each name has; one that is free is kept, so that none jumps to
 * and fro.
 *
 * @type {WeakMap<object, number>}
 */
const kept = new WeakMap();
/** Between a name and a robot's body (px). */
const CLEAR_PX = 4;
/** The whole name first: at the near end, at the far one, in the middle; then its number. */
const ORDER = [0, 2, 1, 3, 5, 4];

/**
 * @typedef {{text: string, size: number, isTall: boolean, x: number, y: number}} Name
 *   x, y: its middle (px)
 */

/**
 * Names of lanes where no robot covers them, turned along a lane that is taller than wide;
 * a number alone where there is no room for more, and none where a lane is too small.
 *
 * @param {Paint} paint
 */
export function* laneNames(paint) {
  for (const lane of paint.scene.map?.lanes ?? []) {
    const text = paint.labels.lane(lane.label);
    const number = text.match(/\d\S*$/)?.[0] ?? text;
    const names = [text, number].flatMap((one) => namesIn(paint, lane, one));
    if (!names.length) continue;
    const before = kept.get(lane) ?? 0;
    const places = [before, ...ORDER].filter((place) => place < names.length);
    const free = places.find((place) => {
      // A number makes room for its whole name only where that will stay.
      const clear = place < 3 && before >= 3 ? paint.view.scale : CLEAR_PX;
      return isFree(paint, names[place], clear);
    });
    kept.set(lane, free ?? 0);
    yield names[free ?? 0];
  }
}

/**
 * At the near end of what is in sight, in the middle and at the far end.
 *
 * @param {Paint} paint @param {Box2D} lane @param {string} text
 * @returns {Name[]}
 */
function namesIn(paint, lane, text) {
  const [x, y, width, height] = rectOf(paint, lane);
  const isTall = height > width;
  const [thickness, length] = isTall ? [width, height] : [height, width];
  const size = Math.min(13, thickness * 0.6);
  if (size < 8 || length < text.length * size * 0.7) return [];
  const { view } = paint;
  const half = halfOf({ text, size }) + 8;
  const [start, most] = isTall ? [y, view.height] : [x, view.width];
  const [from, to] = [Math.max(start, 0), Math.min(start + length, most)];
  const along = [from + half, (from + to) / 2, to - half].map((at) =>
    Math.min(Math.max(at, start + half), start + length - half),
  );
  if (!isTall)
    return along.map((at) => ({ text, size, isTall, x: at, y: y + height / 2 }));
  // A number stands upright.
  const name = { text, size, isTall: text.length > 2, x: x + width / 2 };
  return along.reverse().map((at) => ({ ...name, y: at }));
}

/** Half the length of a name (px). @param {{text: string, size: number}} name */
const halfOf = ({ text, size }) => text.length * size * 0.3;

/** @param {Paint} paint @param {Name} name @param {number} clear (px) */
function isFree({ view, scene }, name, clear) {
  const half = halfOf(name);
  const [across, up] = name.isTall ? [name.size / 2, half] : [half, name.size / 2];
  return !scene.robots.some(({ pose, length }) => {
    const away = (length * view.scale) / 2 + clear;
    return (
      Math.abs(screenX(view, pose.x) - name.x) < across + away &&
      Math.abs(screenY(view, pose.y) - name.y) < up + away
    );
  });
}

/** @param {Paint} paint */
function drawLaneNames(paint) {
  const { ctx, theme } = paint;
  const onLanes = { ...paint, theme: { ...theme, bg: theme.lane } };
  for (const { text, size, isTall, x, y } of laneNames(paint)) {
    ctx.save();
    ctx.globalAlpha = 0.72;
    ctx.translate(x, y);
    if (isTall) ctx.rotate(-Math.PI / 2);
    label(onLanes, text, 0, 0, { size });
    ctx.restore();
  }
}

/** @param {Paint} paint @param {Box2D} box @param {string} colour */
function fillBox(paint, box, colour) {
  const [x, y, width, height] = rectOf(paint, box);
  paint.ctx.fillStyle = colour;
  paint.ctx.fillRect(x, y, width, height);
}

/**
 * @param {Paint} paint
 * @param {Box2D} box (m)
 * @returns {[number, number, number, number]} x, y, width, height (px)
 */
function rectOf({ view }, box) {
  const x = screenX(view, box.xmin);
  const y = screenY(view, box.ymax);
  const width = (box.xmax - box.xmin) * view.scale;
  return [x, y, width, (box.ymax - box.ymin) * view.scale];
}
