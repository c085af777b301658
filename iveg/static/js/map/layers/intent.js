/** The plan of a robot: its path, its goal and the name of its task. */

import { screenX, screenY } from "../viewport.js";
import { mayStand } from "./claims.js";
import { circle, isolated, label } from "./paint.js";

/**
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("../scene.js").SceneRobot} SceneRobot
 */

/** @param {Paint} paint */
export function draw(paint) {
  const { ctx, scene } = paint;
  isolated(ctx, () => {
    for (const robot of scene.robots) {
      if (robot.link !== "LIVE" && robot.link !== "LATE") continue;
      ctx.strokeStyle = paint.theme.robots[robot.slot - 1];
      drawPath(paint, robot);
      if (robot.goal) drawGoal(paint, robot, robot.goal);
    }
  });
}

/** @param {Paint} paint @param {SceneRobot} robot */
function drawPath({ ctx, view }, robot) {
  if (!robot.path.length) return;
  ctx.globalAlpha = 0.55;
  ctx.lineWidth = 2;
  ctx.setLineDash([2, 6]);
  ctx.lineCap = "round";
  ctx.beginPath();
  for (const [x, y] of robot.path) ctx.lineTo(screenX(view, x), screenY(view, y));
  ctx.stroke();
  ctx.setLineDash([]);
}

/**
 * @param {Paint} paint
 * @param {SceneRobot} robot
 * @param {{x: number, y: number}} goal
 */
function drawGoal(paint, robot, goal) {
  const { ctx, view, labels } = paint;
  const [x, y] = [screenX(view, goal.x), screenY(view, goal.y)];
  ctx.globalAlpha = 0.8;
  ctx.lineWidth = 2;
  circle(ctx, x, y, 6);
  ctx.stroke();
  ctx.beginPath();
  for (const [dx, dy] of [
    [1, 0],
    [-1, 0],
    [0, 1],
    [0, -1],
  ]) {
    ctx.moveTo(x + 3 * dx, y + 3 * dy);
    ctx.lineTo(x + 10 * dx, y + 10 * dy);
  }
  ctx.stroke();
  if (!robot.task || view.scale < 18) return;
  const task = labels.task(robot.task);
  if (!mayStand(paint, task, x, y + 18, 11)) return;
  label(paint, task, x, y + 18, { size: 11, weight: 500 });
}
