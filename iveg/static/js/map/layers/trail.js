/**
 * Trails of the robots, for ten seconds, one minute or ten.
 *
 * A trail keeps a point when the robot has moved on by a step, and long steps in its
 * older part, so that ten minutes cost no more than a few hundred points a robot.
 */

import { screenX, screenY } from "../viewport.js";
import { isolated } from "./paint.js";

/**
 * @typedef {{x: number, y: number, atMs: number}} Crumb
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {ReturnType<typeof createTrails>} Trails
 */

/** The lengths that a person can choose (s). */
export const TRAIL_SPANS_S = [10, 60, 600];

const KEEP_MS = 600_000;
const STEP_M = 0.1;
/** Behind this age steps are coarse. */
const FINE_MS = 60_000;
const COARSE_STEP_M = 0.5;
/** A jump this long is a new start (or another boot), not a drive. */
const JUMP_M = 3;
/** Steps on screen (px) that the eye cannot tell from a line. */
const LINE_PX = 4;
/** A trail never has more points than this. */
const CRUMBS_MAX = 2000;

export function createTrails() {
  /** @type {Map<string, Crumb[]>} */
  const trails = new Map();
  let changes = 0;
  return {
    /**
     * @param {string} robotId
     * @param {{x: number, y: number}} pose (m)
     * @param {number} atMs
     */
    add(robotId, pose, atMs) {
      const trail = trails.get(robotId) ?? [];
      trails.set(robotId, trail);
      const last = trail[trail.length - 1];
      if (last && distance(last, pose) < STEP_M) return;
      trail.push({ x: pose.x, y: pose.y, atMs });
      changes += 1;
      if (trail.length % 64 === 0) trails.set(robotId, thinned(trail, atMs));
    },
    /** @param {string} robotId @returns {readonly Crumb[]} oldest first */
    of: (robotId) => trails.get(robotId) ?? [],
    /** Removes trails of robots that are gone. @param {ReadonlyMap<string, unknown>} robots */
    keepOnly(robots) {
      for (const id of trails.keys()) if (!robots.has(id)) trails.delete(id);
    },
    /** Number of changes of any trail. */
    changes: () => changes,
  };
}

/**
 * Drops what is too old and every crumb of the older part that is within a coarse step.
 *
 * @param {Crumb[]} trail oldest first
 * @param {number} nowMs
 * @returns {Crumb[]}
 */
export function thinned(trail, nowMs) {
  /** @type {Crumb[]} */
  const kept = [];
  for (const crumb of trail) {
    if (nowMs - crumb.atMs > KEEP_MS) continue;
    const last = kept[kept.length - 1];
    const isCoarse = last && nowMs - crumb.atMs > FINE_MS;
    if (!isCoarse || distance(last, crumb) >= COARSE_STEP_M) kept.push(crumb);
  }
  return kept.slice(-CRUMBS_MAX);
}

/**
 * @param {Paint} paint
 * @param {Trails} trails
 * @param {number} spanS
 */
export function draw(paint, trails, spanS) {
  const { ctx, scene, theme } = paint;
  isolated(ctx, () => {
    ctx.lineJoin = "round";
    ctx.lineCap = "butt";
    ctx.lineWidth = 2.5;
    for (const robot of scene.robots) {
      ctx.strokeStyle = theme.robots[robot.slot - 1];
      drawTrail(paint, trails.of(robot.id), robot.pose, spanS * 1000);
    }
  });
}

/**
 * Four strokes, the older the fainter; one stroke per crumb would cost too much.
 *
 * @param {Paint} paint
 * @param {readonly Crumb[]} trail
 * @param {{x: number, y: number}} pose
 * @param {number} spanMs
 */
function drawTrail({ ctx, view, scene }, trail, pose, spanMs) {
  const shades = 4;
  const first = trail.findIndex(({ atMs }) => scene.nowMs - atMs <= spanMs);
  if (first < 0) return;
  for (let shade = 0; shade < shades; shade += 1) {
    const from = first + Math.floor(((trail.length - first) * shade) / shades);
    const to = first + Math.floor(((trail.length - first) * (shade + 1)) / shades);
    ctx.globalAlpha = 0.12 + 0.14 * shade;
    ctx.beginPath();
    const end = Math.min(to, trail.length - 1);
    let drawn = trail[from];
    for (let i = from; i <= end; i += 1) {
      const isJump = i > from && distance(trail[i - 1], trail[i]) > JUMP_M;
      const isNear = distance(drawn, trail[i]) * view.scale < LINE_PX;
      if (isNear && !isJump && i > from && i < end) continue;
      drawn = trail[i];
      const [x, y] = [screenX(view, drawn.x), screenY(view, drawn.y)];
      if (isJump) ctx.moveTo(x, y);
      else ctx.lineTo(x, y);
    }
    if (shade === shades - 1 && distance(trail[trail.length - 1], pose) < JUMP_M) {
      ctx.lineTo(screenX(view, pose.x), screenY(view, pose.y));
    }
    ctx.stroke();
  }
}

/** @param {{x: number, y: number}} a @param {{x: number, y: number}} b */
function distance(a, b) {
  const [dx, dy] = [a.x - b.x, a.y - b.y];
  // Asked of every crumb of every trail, where Math.hypot shows in a profile.
  return Math.sqrt(dx * dx + dy * dy);
}
