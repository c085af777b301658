/**
 * Where a robot will reach a zone: a part of the zone as it will be then, a mark on the
 * robot's way, a thin line to where the zone is now, and how soon.
 *
 * A forecast of the server, faint and in the robot's hue: nothing has happened yet.
 */

import { screenX, screenY } from "../viewport.js";
import { mayStand } from "./claims.js";
import { circle, isolated, label } from "./paint.js";

/**
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("../../core/protocol.js").Encounter} Encounter
 * @typedef {import("../../core/protocol.js").Point} Point
 */

const STRENGTH = 0.7;
/** Of the zone, to either side of the mark (rad). */
const PART = 0.35;
const MARK_PX = 5;
const WORDS_BELOW_PX = 15;
const LETTERS_PX = 11;

/** @param {Paint} paint */
export function draw(paint) {
  const { ctx, scene, theme } = paint;
  isolated(ctx, () => {
    ctx.globalAlpha = STRENGTH;
    for (const robot of scene.robots) {
      ctx.strokeStyle = theme.robots[robot.slot - 1];
      for (const one of robot.encounters) drawMark(paint, one);
    }
    ctx.globalAlpha = 1;
    for (const { id, encounters } of scene.robots) {
      for (const one of encounters) drawWords(paint, id, one);
    }
  });
}

/** @param {Paint} paint @param {Encounter} encounter */
function drawMark(paint, { cause, place, centre, radius_m }) {
  const { ctx, view, scene } = paint;
  const [x, y] = [screenX(view, place.x), screenY(view, place.y)];
  const [cx, cy] = [screenX(view, centre.x), screenY(view, centre.y)];
  const towards = Math.atan2(y - cy, x - cx);
  ctx.lineWidth = 2;
  ctx.setLineDash([]);
  ctx.beginPath();
  ctx.arc(cx, cy, radius_m * view.scale, towards - PART, towards + PART);
  ctx.stroke();
  circle(ctx, x, y, MARK_PX);
  ctx.stroke();
  const person = scene.people.find(({ id }) => id === cause);
  const border = person && borderTowards(place, person, person.zoneM);
  if (!border) return;
  ctx.lineWidth = 1;
  ctx.setLineDash([3, 3]);
  ctx.beginPath();
  ctx.moveTo(x, y);
  ctx.lineTo(screenX(view, border.x), screenY(view, border.y));
  ctx.stroke();
}

/**
 * The point of a zone that is nearest to a place outside it; null from inside.
 *
 * @param {Point} place
 * @param {Point} centre
 * @param {number} radiusM
 * @returns {Point | null}
 */
export function borderTowards(place, centre, radiusM) {
  const [dx, dy] = [place.x - centre.x, place.y - centre.y];
  const away = Math.hypot(dx, dy);
  if (away <= radiusM) return null;
  const share = radiusM / away;
  return { x: centre.x + share * dx, y: centre.y + share * dy };
}

/** @param {Paint} paint @param {string} robotId @param {Encounter} encounter */
function drawWords(paint, robotId, { in_s, probability, place }) {
  const { view, labels, theme } = paint;
  const said = labels.encounter(robotId, in_s, probability);
  const x = screenX(view, place.x);
  const y = screenY(view, place.y) + WORDS_BELOW_PX;
  if (!mayStand(paint, said, x, y, LETTERS_PX)) return;
  label(paint, said, x, y, { size: LETTERS_PX, weight: 500, colour: theme.muted });
}
