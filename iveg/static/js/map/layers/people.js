/**
 * People, and peers seen by robots, with the zone that the rule keeps around them.
 *
 * *Seen* is solid; *remembered* is dashed and grows at walking speed; *last seen* is a
 * marker alone, which fades and is removed after a minute: the person's place is unknown by
 * then, and the marks of a morning would hide people who are there.  What is marked as no
 * person has no zone, and a line through it.
 */

import { MARK_LIMIT_S } from "../scene.js";
import { screenX, screenY } from "../viewport.js";
import { claim } from "./claims.js";
import { circle, isolated, label, widthOf } from "./paint.js";
import { drawSign } from "./sprites.js";

/**
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {import("../scene.js").ScenePerson} ScenePerson
 */

/** From this scale on (px/m) there is room for words, and a zone grows by a pixel a frame. */
const NEAR_SCALE = 24;
/** Of a figure, with its outline; and the width of a zone's line. */
const FIGURE_PX = 12;
const ZONE_PX = 2;

/** The letters of an age. */
const AGE = { size: 11 };
/** A mark is never fainter than this, or it would look like dirt. */
const FAINTEST = 0.3;

/** Labels nearer to each other than this would be read as one (px). */
const WORDS_ACROSS_PX = 92;
const WORDS_ABOVE_PX = 13;

/** @param {Paint} paint */
export function draw(paint) {
  for (const person of paint.scene.people) drawPerson(paint, person);
  isolated(paint.ctx, () => {
    for (const person of labelled(paint)) drawAge(paint, person);
  });
}

/**
 * People with a label: of several whose labels would overlap, the newest.
 *
 * @param {Paint} paint
 */
export function labelled({ scene, view }) {
  const unseen = scene.people.filter(({ stage }) => stage !== "seen");
  /** @type {ScenePerson[]} */
  const chosen = [];
  for (const person of unseen.sort((a, b) => a.ageS - b.ageS)) {
    const isCovered = chosen.some(
      ({ x, y }) =>
        Math.abs(x - person.x) * view.scale < WORDS_ACROSS_PX &&
        Math.abs(y - person.y) * view.scale < WORDS_ABOVE_PX,
    );
    if (!isCovered) chosen.push(person);
  }
  return chosen;
}

/** @param {Paint} paint @param {ScenePerson} person */
function drawPerson(paint, person) {
  const { ctx, view } = paint;
  const place = { x: screenX(view, person.x), y: screenY(view, person.y) };
  const edge = Math.round(person.zoneM * view.scale);
  const isSeen = person.stage === "seen";
  // From near, a zone that grows is in each frame like no other.
  const kept = isSeen || view.scale < NEAR_SCALE ? paint.sprites : undefined;
  if (person.stage !== "last_seen" && !person.isThing) {
    const name = `zone ${edge} ${isSeen}`;
    const sign = { name, reach: edge + ZONE_PX, ...place };
    drawSign(paint, kept, sign, (there) => drawZone(there, person));
  }
  ctx.globalAlpha = strengthOf(person);
  const kind = person.unknown ? "unknown" : person.peer ? "peer" : "person";
  const name = `${kind} ${person.isThing} ${person.stage === "last_seen"}`;
  const drawn = FIGURES[kind];
  const figure = { name, reach: FIGURE_PX, ...place };
  drawSign(paint, paint.sprites, figure, (there) => drawn(there, person));
  ctx.globalAlpha = 1;
}

/** Opacity of a figure. @param {ScenePerson} person */
function strengthOf({ stage, ageS }) {
  if (stage !== "last_seen") return 1;
  return Math.max(FAINTEST, 0.8 * (1 - ageS / MARK_LIMIT_S));
}

/** Time since a person was last seen. @param {Paint} paint @param {ScenePerson} person */
function drawAge(paint, person) {
  const { view, labels } = paint;
  const isGone = person.stage === "last_seen";
  // At a small scale, the labels of several people would overlap.
  const isNear = view.scale >= NEAR_SCALE;
  const said = isGone ? labels.lastSeen(person.ageS) : labels.ago(person.ageS);
  const text = isNear ? said : labels.age(person.ageS);
  const [x, y] = [screenX(view, person.x), screenY(view, person.y)];
  const dy = placeOfAge(paint, text, x, y);
  if (dy === null) return;
  label(paint, text, x, y + dy, { ...AGE, colour: paint.theme.muted });
}

/**
 * Below the sign, else above; null where other labels are in both places.
 *
 * @param {Paint} paint @param {string} text @param {number} x @param {number} y
 */
function placeOfAge(paint, text, x, y) {
  const heights = [20, -22];
  if (!paint.places) return heights[0];
  const half = widthOf(paint, text, AGE) / 2;
  const rects = heights.map((dy) => {
    const [top, bottom] = [y + dy - WORDS_ABOVE_PX / 2, y + dy + WORDS_ABOVE_PX / 2];
    return { left: x - half, right: x + half, top, bottom };
  });
  const found = claim(paint, rects);
  return found === null ? null : heights[found];
}

/** @param {Paint} paint @param {ScenePerson} person */
function drawZone({ ctx, view, theme }, person) {
  const isSeen = person.stage === "seen";
  circle(ctx, 0, 0, person.zoneM * view.scale);
  ctx.fillStyle = theme.ring;
  ctx.globalAlpha = isSeen ? 0.1 : 0.05;
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.strokeStyle = theme.ring;
  ctx.lineWidth = ZONE_PX;
  ctx.setLineDash(isSeen ? [] : [8, 6]);
  ctx.stroke();
  ctx.setLineDash([]);
}

/** Head and shoulders. @param {Paint} paint @param {ScenePerson} person */
function drawFigure({ ctx, theme }, person) {
  ctx.strokeStyle = theme.bg;
  const isFaded = person.isThing || person.stage === "last_seen";
  ctx.fillStyle = isFaded ? theme.muted : theme.person;
  ctx.lineWidth = 2;
  ctx.beginPath();
  ctx.ellipse(0, 6, 9, 7, 0, Math.PI, 2 * Math.PI);
  ctx.closePath();
  ctx.stroke();
  ctx.fill();
  circle(ctx, 0, -5, 5);
  ctx.stroke();
  ctx.fill();
  if (!person.isThing) return;
  ctx.strokeStyle = theme.text;
  ctx.beginPath();
  ctx.moveTo(-FIGURE_PX + 3, FIGURE_PX - 3);
  ctx.lineTo(FIGURE_PX - 3, -FIGURE_PX + 3);
  ctx.stroke();
}

/** Who or what only a laser sees. @param {Paint} paint */
function drawUnknown({ ctx, theme }) {
  circle(ctx, 0, 0, 9);
  ctx.fillStyle = theme.person;
  ctx.strokeStyle = theme.bg;
  ctx.lineWidth = 2;
  ctx.fill();
  ctx.stroke();
  ctx.fillStyle = theme.bg;
  ctx.font = "700 13px system-ui, sans-serif";
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  ctx.fillText("?", 0, 1);
}

/** A diamond: a machine that is not controlled from here. @param {Paint} paint
 * @param {ScenePerson} person */
function drawPeer({ ctx, theme }, person) {
  ctx.strokeStyle = theme.bg;
  ctx.fillStyle = person.stage === "last_seen" ? theme.muted : theme.peer;
  ctx.lineWidth = 2;
  ctx.beginPath();
  for (const [x, y] of [
    [0, -9],
    [9, 0],
    [0, 9],
    [-9, 0],
  ])
    ctx.lineTo(x, y);
  ctx.closePath();
  ctx.stroke();
  ctx.fill();
}

const FIGURES = { person: drawFigure, peer: drawPeer, unknown: drawUnknown };
