/**
 * Lines from observers to people, and from people to robots that act on them unseen.
 *
 * Solid from an observer to the person; dashed from the person to a robot that slows for
 * it without a line of sight: the point of sharing detections, made visible.
 */

import { isSilent } from "../../core/clock.js";
import { screenX, screenY } from "../viewport.js";
import { mayStand } from "./claims.js";
import { isolated, label } from "./paint.js";

/**
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("../scene.js").ScenePerson} ScenePerson
 * @typedef {import("../scene.js").SceneRobot} SceneRobot
 */

/** On a shorter link the text of the distance would cover person and robot. */
const WORDS_FROM_PX = 48;
const BESIDE_PX = 13;

/** @param {Paint} paint */
export function draw(paint) {
  const { ctx, scene } = paint;
  const robots = new Map(scene.robots.map((robot) => [robot.id, robot]));
  isolated(ctx, () => {
    for (const person of scene.people) {
      if (person.stage === "last_seen") continue;
      for (const id of person.observers) drawSight(paint, robots.get(id), person);
      for (const act of person.acting) {
        const robot = robots.get(act.robot_id);
        if (act.in_sight || !robot || isSilent(robot.link)) continue;
        drawBlind(paint, robot, person, act.distance_m);
      }
    }
  });
}

/**
 * @param {Paint} paint
 * @param {SceneRobot | undefined} robot
 * @param {ScenePerson} person
 */
function drawSight(paint, robot, person) {
  if (!robot || isSilent(robot.link)) return;
  const { ctx, theme } = paint;
  ctx.globalAlpha = person.stage === "seen" ? 0.8 : 0.35;
  ctx.strokeStyle = theme.robots[robot.slot - 1];
  ctx.lineWidth = 1.5;
  line(paint, robot, person);
}

/**
 * @param {Paint} paint
 * @param {SceneRobot} robot
 * @param {ScenePerson} person
 * @param {number} distanceM
 */
function drawBlind(paint, robot, person, distanceM) {
  const { ctx, theme, view, labels } = paint;
  ctx.globalAlpha = 1;
  ctx.strokeStyle = theme.robots[robot.slot - 1];
  ctx.lineWidth = 2.5;
  ctx.setLineDash([9, 6]);
  line(paint, robot, person);
  ctx.setLineDash([]);
  const [x1, y1] = [screenX(view, robot.pose.x), screenY(view, robot.pose.y)];
  const [x2, y2] = [screenX(view, person.x), screenY(view, person.y)];
  const length = Math.hypot(x2 - x1, y2 - y1);
  if (length < WORDS_FROM_PX) return;
  // Beside the line and not on it, nearer to the person than to the robot's body.
  const x = x1 + 0.6 * (x2 - x1) + (BESIDE_PX * (y1 - y2)) / length;
  const y = y1 + 0.6 * (y2 - y1) - (BESIDE_PX * Math.abs(x2 - x1)) / length;
  const said = labels.distance(distanceM);
  if (mayStand(paint, said, x, y, 11)) label(paint, said, x, y, { size: 11 });
}

/** @param {Paint} paint @param {SceneRobot} robot @param {ScenePerson} person */
function line({ ctx, view }, robot, person) {
  ctx.beginPath();
  ctx.moveTo(screenX(view, robot.pose.x), screenY(view, robot.pose.y));
  ctx.lineTo(screenX(view, person.x), screenY(view, person.y));
  ctx.stroke();
}
