/**
 * The object under a finger: a robot before a person, a person before its zone.
 *
 * @typedef {import("../scene.js").Scene} Scene
 * @typedef {import("../viewport.js").Viewport} Viewport
 * @typedef {{kind: "robot" | "person" | "detection", id: string}} Picked
 */

import { screenX, screenY } from "../viewport.js";
import { bodySize } from "./robot.js";

/** Half of the smallest target for a finger (44 px). */
const FINGER_PX = 22;

/**
 * @param {Scene} scene
 * @param {Viewport} view
 * @param {number} px
 * @param {number} py
 * @param {(layer: string) => boolean} isOn what is switched off cannot be touched
 * @returns {Picked | null}
 */
export function pick(scene, view, px, py, isOn) {
  const { robots, people, detections } = scene;
  /** @param {{x: number, y: number}} at */
  const gapTo = (at) => Math.hypot(screenX(view, at.x) - px, screenY(view, at.y) - py);
  const robot = nearest(
    robots,
    (it) => gapTo(it.pose),
    (it) => Math.max(FINGER_PX, bodySize(it, view.scale)[0] / 2),
  );
  if (robot && isOn("robot")) return { kind: "robot", id: robot.id };
  const person = nearest(people, gapTo, () => FINGER_PX);
  if (person && isOn("people")) return { kind: "person", id: person.id };
  const seen = nearest(detections, gapTo, () => FINGER_PX);
  if (seen && isOn("detections")) return { kind: "detection", id: seen.id };
  const zone = nearest(people, gapTo, (it) => zoneOf(it) * view.scale);
  return zone && isOn("people") ? { kind: "person", id: zone.id } : null;
}

/** @param {Scene["people"][number]} person */
function zoneOf(person) {
  return person.stage === "last_seen" ? 0 : person.zoneM;
}

/**
 * @template T
 * @param {readonly T[]} things
 * @param {(thing: T) => number} gapTo (px)
 * @param {(thing: T) => number} reach (px)
 * @returns {T | null}
 */
function nearest(things, gapTo, reach) {
  /** @type {T | null} */
  let best = null;
  let least = Number.POSITIVE_INFINITY;
  for (const thing of things) {
    const gap = gapTo(thing);
    if (gap > reach(thing) || gap >= least) continue;
    best = thing;
    least = gap;
  }
  return best;
}
