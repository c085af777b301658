/**
 * Robots: to scale, with their heading, and never shown as fresher than they are.
 *
 * Live is filled; late has an amber outline and its age; lost is a dashed ghost at its
 * last pose.  Each kind of drive has its own body and the later hues a stripe,
 * so hue never carries identity alone.
 */

import { isSilent } from "../../core/clock.js";
import { isStriped } from "../../core/slots.js";
import { screenX, screenY } from "../viewport.js";
import { circle, isolated } from "./paint.js";
import { drawTag, placesOfTags } from "./tags.js";

/**
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("./paint.js").Context} Context
 * @typedef {import("../scene.js").SceneRobot} SceneRobot
 */

/** A body is never drawn shorter than this (px), however small the scale. */
const SHORTEST_PX = 20;

/** @param {Paint} paint */
export function draw(paint) {
  const places = placesOfTags(paint, paint.scene.robots);
  paint.scene.robots.forEach((robot, n) => {
    isolated(paint.ctx, () => drawRobot(paint, robot, places[n]));
  });
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

/** @param {Paint} paint @param {SceneRobot} robot
 * @param {import("./tags.js").Place} place of its name and tags */
function drawRobot(paint, robot, place) {
  const { ctx, view } = paint;
  const [length, width] = bodySize(robot, view.scale);
  ctx.translate(screenX(view, robot.pose.x), screenY(view, robot.pose.y));
  if (robot.unsureM > 0) drawUnsure(paint, robot, length);
  if (paint.followed === robot.id) drawFollowed(paint, length);
  ctx.save();
  ctx.rotate(-robot.pose.yaw);
  drawBody(paint, robot, length, width);
  ctx.restore();
  drawTag(paint, robot, place);
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
