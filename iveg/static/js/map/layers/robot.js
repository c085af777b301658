/**
 * Robots: to scale, with their heading, and never shown as fresher than they are.
 *
 * Live is filled; late has an amber outline and its age; lost is a dashed ghost at its
 * last pose.  Each kind of drive has its own body and the later hues a stripe,
 * so hue never carries identity alone.
 */

import { isSilent } from "../../core/clock.js";
import { LIMITS } from "../../core/limits.js";
import { isStriped } from "../../core/slots.js";
import { screenX, screenY } from "../viewport.js";
import { claim } from "./claims.js";
import { circle, isolated, label, pill, widthOf, widthOfPill } from "./paint.js";

/**
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("./paint.js").Context} Context
 * @typedef {import("../scene.js").SceneRobot} SceneRobot
 */

/** A body is never drawn shorter than this (px), however small the scale. */
const SHORTEST_PX = 20;
const PADLOCK_PX = 12;
/** The letters of a name. */
const NAME = { size: 13, weight: 700 };
/** From one line of text to the next. */
const WORDS_PX = 28;

/** @param {Paint} paint */
export function draw(paint) {
  for (const robot of paint.scene.robots) {
    isolated(paint.ctx, () => drawRobot(paint, robot));
  }
}

/**
 * Length and width on screen (px).
 *
 * @param {SceneRobot} robot
 * @param {number} scale (px/m)
 * @returns {[number, number]}
 */
export function bodySize(robot, scale) {
  const length = Math.max(SHORTEST_PX, robot.length * scale);
  return [length, (length * robot.width) / robot.length];
}

/** @param {Paint} paint @param {SceneRobot} robot */
function drawRobot(paint, robot) {
  const { ctx, view } = paint;
  const [length, width] = bodySize(robot, view.scale);
  ctx.translate(screenX(view, robot.pose.x), screenY(view, robot.pose.y));
  if (robot.unsureM > 0) drawUnsure(paint, robot, length);
  if (paint.followed === robot.id) drawFollowed(paint, length);
  ctx.save();
  ctx.rotate(-robot.pose.yaw);
  drawBody(paint, robot, length, width);
  ctx.restore();
  drawTag(paint, robot, length);
}

/**
 * The disc in which the robot may be by now: red for a danger, else amber.
 *
 * @param {Paint} paint
 * @param {SceneRobot} robot
 * @param {number} length
 */
function drawUnsure({ ctx, view, theme }, robot, length) {
  const colour = theme.alert[robot.situation.level === "danger" ? 0 : 1];
  circle(ctx, 0, 0, robot.unsureM * view.scale + length / 2);
  ctx.globalAlpha = 0.12;
  ctx.fillStyle = colour;
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.strokeStyle = colour;
  ctx.lineWidth = 2;
  ctx.stroke();
}

/** @param {Paint} paint @param {number} length */
function drawFollowed({ ctx, theme }, length) {
  circle(ctx, 0, 0, length * 0.62 + 8);
  ctx.globalAlpha = 0.6;
  ctx.strokeStyle = theme.text;
  ctx.lineWidth = 1.5;
  ctx.setLineDash([2, 4]);
  ctx.stroke();
  ctx.setLineDash([]);
  ctx.globalAlpha = 1;
}

/**
 * @param {Paint} paint
 * @param {SceneRobot} robot
 * @param {number} length
 * @param {number} width
 */
function drawBody({ ctx, theme }, robot, length, width) {
  const isLost = isSilent(robot.link);
  const hue = isLost ? theme.muted : theme.robots[robot.slot - 1];
  outline(ctx, robot.drive, length, width);
  if (robot.link === "LATE") halo(ctx, theme.alert[1]);
  else if (!isLost) halo(ctx, theme.bg);
  if (!isLost) drawWheels(ctx, robot, length, width, theme.text);
  outline(ctx, robot.drive, length, width);
  ctx.globalAlpha = isLost ? 0.15 : 1;
  ctx.fillStyle = hue;
  ctx.fill();
  ctx.globalAlpha = 1;
  if (isStriped(robot.slot)) drawStripe(ctx, length, width, isLost ? hue : theme.bg);
  if (isLost) ghost(ctx, hue);
  drawHeading(ctx, length, width, hue, isLost ? hue : theme.bg);
}

/** @param {Context} ctx @param {string} colour */
function halo(ctx, colour) {
  ctx.strokeStyle = colour;
  ctx.lineWidth = 6;
  ctx.lineJoin = "round";
  ctx.stroke();
}

/** @param {Context} ctx @param {string} colour */
function ghost(ctx, colour) {
  ctx.strokeStyle = colour;
  ctx.lineWidth = 1.5;
  ctx.setLineDash([4, 3]);
  ctx.stroke();
  ctx.setLineDash([]);
}

/**
 * The body's path, nose along +x: a box that turns on the spot, a car with a drawn-in
 * nose that steers, six corners for anything else.
 *
 * @param {Context} ctx
 * @param {string} drive
 * @param {number} length
 * @param {number} width
 */
function outline(ctx, drive, length, width) {
  const [x, y] = [length / 2, width / 2];
  ctx.beginPath();
  if (drive === "differential") {
    ctx.roundRect(-x, -y, length, width, Math.min(x, y) * 0.35);
  } else if (drive === "ackermann") {
    ctx.moveTo(-x, -y);
    ctx.lineTo(x * 0.3, -y);
    ctx.quadraticCurveTo(x, -y * 0.75, x, 0);
    ctx.quadraticCurveTo(x, y * 0.75, x * 0.3, y);
    ctx.lineTo(-x, y);
    ctx.closePath();
  } else {
    const corners = [
      [x, 0],
      [x / 2, y],
      [-x / 2, y],
      [-x, 0],
      [-x / 2, -y],
      [x / 2, -y],
    ];
    for (const [cx, cy] of corners) ctx.lineTo(cx, cy);
    ctx.closePath();
  }
}

/**
 * @param {Context} ctx
 * @param {SceneRobot} robot
 * @param {number} length
 * @param {number} width
 * @param {string} colour
 */
function drawWheels(ctx, robot, length, width, colour) {
  if (length < 28) return;
  const [long, thick] = [length * 0.24, Math.max(3.5, width * 0.18)];
  const axles = robot.drive === "ackermann" ? [-0.3, 0.24] : [-0.26, 0.26];
  ctx.fillStyle = colour;
  for (const axle of axles) {
    for (const side of [-1, 1]) {
      const x = axle * length - long / 2;
      const y = (side * (width + thick)) / 2 - thick / 2;
      ctx.fillRect(x, y, long, thick);
    }
  }
}

/**
 * Across the body, behind its middle: the later half of the hues.
 *
 * @param {Context} ctx
 * @param {number} length
 * @param {number} width
 * @param {string} colour
 */
function drawStripe(ctx, length, width, colour) {
  ctx.fillStyle = colour;
  ctx.fillRect(-0.3 * length, -width / 2, 0.16 * length, width);
}

/**
 * A notch on the body and an arrow ahead of it.
 *
 * @param {Context} ctx
 * @param {number} length
 * @param {number} width
 * @param {string} hue
 * @param {string} ink
 */
function drawHeading(ctx, length, width, hue, ink) {
  const [nose, half] = [length * 0.34, Math.min(width * 0.3, length * 0.22)];
  ctx.strokeStyle = ink;
  ctx.lineWidth = Math.max(2, length * 0.05);
  ctx.lineJoin = "miter";
  ctx.beginPath();
  ctx.moveTo(nose - half, -half);
  ctx.lineTo(nose, 0);
  ctx.lineTo(nose - half, half);
  ctx.stroke();
  ctx.fillStyle = hue;
  ctx.beginPath();
  ctx.moveTo(length / 2 + 14, 0);
  ctx.lineTo(length / 2 + 5, -5);
  ctx.lineTo(length / 2 + 5, 5);
  ctx.closePath();
  ctx.fill();
}

/**
 * Whether a padlock is true: the robot is locked, and was heard a moment ago.
 *
 * @param {Pick<SceneRobot, "situation" | "ageS">} robot
 */
export const isSeenHeld = ({ situation, ageS }) =>
  situation.level === "locked" && ageS <= LIMITS.report_stale_s;

/**
 * A dark octagon with a padlock: held, and not by accident.
 *
 * @param {Paint} paint
 * @param {number} x (px)
 * @param {number} y (px)
 */
function drawPadlock({ ctx, theme }, x, y) {
  ctx.save();
  ctx.translate(x, y);
  ctx.beginPath();
  for (let i = 0; i < 8; i += 1) {
    const angle = (Math.PI / 4) * (i + 0.5);
    ctx.lineTo(PADLOCK_PX * Math.cos(angle), PADLOCK_PX * Math.sin(angle));
  }
  ctx.closePath();
  ctx.strokeStyle = theme.bg;
  ctx.lineWidth = 2;
  ctx.stroke();
  ctx.fillStyle = theme.text;
  ctx.fill();
  ctx.strokeStyle = theme.bg;
  ctx.lineWidth = 1.8;
  ctx.beginPath();
  ctx.arc(0, -1.5, 3, Math.PI, 2 * Math.PI);
  ctx.stroke();
  ctx.fillStyle = theme.bg;
  ctx.fillRect(-4.5, -1.5, 9, 7);
  ctx.restore();
}

/**
 * Name above, and beside it age, half speed and recording.
 *
 * @param {Paint} paint
 * @param {SceneRobot} robot
 * @param {number} length
 */
function drawTag(paint, robot, length) {
  const { theme } = paint;
  const { y, tags, aside } = placeOfTag(paint, robot, length);
  const isLost = isSilent(robot.link);
  label(paint, robot.id, aside, y, {
    ...NAME,
    colour: isLost ? theme.muted : theme.text,
  });
  const half = widthOf(paint, robot.id, NAME) / 2 + 6;
  if (isSeenHeld(robot)) drawPadlock(paint, aside - half - PADLOCK_PX, y);
  let x = aside + half;
  for (const [text, fill, ink] of tags) {
    x += pill(paint, text, x, y, fill, ink) + 4;
  }
}

/**
 * Above the robot, else below, else farther away: where no other label is.  Where there is
 * no room for all of it, its name stands alone; the card has the rest.  At an edge of the
 * map it moves aside.
 *
 * @param {Paint} paint
 * @param {SceneRobot} robot
 * @param {number} length
 * @returns {{y: number, aside: number, tags: Tag[]}} middle of the labels and of the
 *   name, from the robot's (px)
 */
function placeOfTag(paint, robot, length) {
  const near = length / 2 + 20;
  const heights = [-near, near, -near - WORDS_PX, near + WORDS_PX];
  const tags = tagsOf(paint, robot);
  for (const told of tags.length ? [tags, []] : [tags]) {
    const { rects, aside } = rectsOf(paint, robot, heights, told);
    const found = claim(paint, rects);
    if (found !== null) return { y: heights[found], aside, tags: told };
  }
  return { y: heights[0], aside: 0, tags };
}

/**
 * @param {Paint} paint @param {SceneRobot} robot
 * @param {number[]} heights @param {Tag[]} tags
 */
function rectsOf(paint, robot, heights, tags) {
  const { view } = paint;
  const half = widthOf(paint, robot.id, NAME) / 2;
  const widths = tags.map(([text]) => widthOfPill(paint, text));
  const x = screenX(view, robot.pose.x);
  const y = screenY(view, robot.pose.y);
  const left = x - half - (isSeenHeld(robot) ? 2 * PADLOCK_PX + 6 : 0);
  const right = x + half + widths.reduce((sum, width) => sum + width + 4, 6);
  const isInView = x >= 0 && x <= view.width;
  const aside = isInView ? Math.max(-left, Math.min(0, view.width - right)) : 0;
  const rects = heights.map((dy) => ({
    left: left + aside,
    right: right + aside,
    top: y + dy - PADLOCK_PX,
    bottom: y + dy + PADLOCK_PX,
  }));
  return { rects, aside };
}

/**
 * @typedef {[text: string, ground: string, ink: string]} Tag
 * @param {Pick<Paint, "theme" | "labels">} paint
 * @param {SceneRobot} robot
 * @returns {Tag[]}
 */
export function tagsOf({ theme, labels }, robot) {
  const { alert, bg, muted, onAlert2, text } = theme;
  /** @type {Tag[]} */
  const tags = [];
  if (robot.link === "LATE") tags.push([labels.age(robot.ageS), alert[1], onAlert2]);
  if (isSilent(robot.link)) tags.push([labels.ago(robot.ageS), muted, bg]);
  const { state, slots } = robot.situation;
  if ((state === "half" || state === "slow") && typeof slots.factor === "number") {
    tags.push([labels.percent(slots.factor), text, bg]);
  }
  if (robot.replay) tags.push([labels.replay(), muted, bg]);
  return tags;
}
