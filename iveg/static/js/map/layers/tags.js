/**
 * A robot's name, and beside it its age, its half speed, a padlock: none on another's.
 */

import { isSilent } from "../../core/clock.js";
import { LIMITS } from "../../core/limits.js";
import { screenX, screenY } from "../viewport.js";
import { claim } from "./claims.js";
import { label, pill, widthOf, widthOfPill } from "./paint.js";
import { overlap } from "./places.js";
import { bodySize } from "./robot.js";

/**
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("../scene.js").SceneRobot} SceneRobot
 * @typedef {import("../viewport.js").Rect} Rect
 * @typedef {{y: number, aside: number, tags: Tag[]}} Place middle of the labels and of
 *   the name, from the robot's (px)
 */

const PADLOCK_PX = 12;
/** Half the height of a name, and of the capsules beside it (px). */
const NAME_PX = 8;
const PILL_PX = 9;
/** The letters of a name. */
const NAME = { size: 13, weight: 700 };
/** From one line of text to the next. */
const WORDS_PX = 28;

/**
 * Where the labels of each robot stand: above it, else below, else farther away, else
 * beside it, where no other label is and no other robot's name will be.  Where there is
 * no room for all of it, its name stands alone; the card has the rest.  At an edge of the
 * map it moves aside.
 *
 * @param {Paint} paint
 * @param {readonly SceneRobot[]} robots
 * @returns {Place[]}
 */
export function placesOfTags(paint, robots) {
  const alone = robots.map((robot) => wishesOf(paint, robot, []));
  const names = alone.map(({ rects }) => rects[0]);
  return robots.map((robot, n) => {
    const tags = tagsOf(paint, robot);
    const whole = tags.length ? [wishesOf(paint, robot, tags)] : [];
    return placeOf(paint, [...whole, alone[n]], names.slice(n + 1));
  });
}

/**
 * @param {Paint} paint
 * @param {ReturnType<typeof wishesOf>[]} wishes with all tags, and at last without any
 * @param {Rect[]} names of others
 * @returns {Place}
 */
function placeOf(paint, wishes, names) {
  for (const { rects, places } of wishes) {
    const clear = rects.filter((rect) => !names.some((name) => overlap(rect, name)));
    const found = claim(paint, clear);
    if (found !== null) return places[rects.indexOf(clear[found])];
  }
  return wishes[wishes.length - 1].places[0];
}

/**
 * The places of a name with some tags, the best first.
 *
 * @param {Paint} paint @param {SceneRobot} robot @param {Tag[]} tags
 */
function wishesOf(paint, robot, tags) {
  const { view } = paint;
  const isHeld = isSeenHeld(robot);
  const [length] = bodySize(robot, view.scale);
  const near = length / 2 + 20;
  const half = widthOf(paint, robot.id, NAME) / 2;
  const widths = tags.map(([text]) => widthOfPill(paint, text));
  const x = screenX(view, robot.pose.x);
  const y = screenY(view, robot.pose.y);
  const left = x - half - (isHeld ? 2 * PADLOCK_PX + 6 : 0);
  const right = x + half + widths.reduce((sum, width) => sum + width + 4, 2);
  const up = isHeld ? PADLOCK_PX : tags.length ? PILL_PX : NAME_PX;
  const isInView = x >= 0 && x <= view.width;
  const aside = isInView ? Math.max(-left, Math.min(0, view.width - right)) : 0;
  const heights = [-near, near, -near - WORDS_PX, near + WORDS_PX];
  const places = heights.map((dy) => ({ y: dy, aside, tags }));
  const [east, west] = [x - left + length, x - right - length];
  if (right + east <= view.width) places.push({ y: 0, aside: east, tags });
  if (left + west >= 0) places.push({ y: 0, aside: west, tags });
  const rects = places.map((place) => ({
    left: left + place.aside,
    right: right + place.aside,
    top: y + place.y - up,
    bottom: y + place.y + up,
  }));
  return { rects, places };
}

/** @param {Paint} paint @param {SceneRobot} robot @param {Place} place */
export function drawTag(paint, robot, { y, aside, tags }) {
  const { theme } = paint;
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
 * Whether a padlock is true: the robot is locked, and was heard a moment ago.
 *
 * @param {Pick<SceneRobot, "situation" | "ageS">} robot
 */
export const isSeenHeld = ({ situation, ageS }) =>
  situation.kind === "locked" && ageS <= LIMITS.report_stale_s;

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
  if (robot.isBlind) tags.push([labels.noCamera(), text, bg]);
  if (robot.replay) tags.push([labels.replay(), muted, bg]);
  return tags;
}
