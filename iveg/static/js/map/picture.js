/**
 * All layers on one canvas, from the ground up.
 *
 * The static layers are drawn once per viewport and theme, the layers under the robots
 * when they change; both are copied in between.
 *
 * @typedef {import("./layers/paint.js").Paint} Paint
 * @typedef {import("./layers/trail.js").Trails} Trails
 * @typedef {Omit<Paint, "ctx" | "places" | "sprites"> & {ratio: number, off: readonly string[],
 *   trailS: number}} Picture `ratio` device pixels per CSS pixel,
 *   `off` the layers that are not drawn, `trailS` how much of the trails (s)
 */

import { createAbove } from "./layers/above.js";
import { createCostmapLayer } from "./layers/costmap.js";
import * as coverage from "./layers/coverage.js";
import * as detections from "./layers/detections.js";
import * as encounters from "./layers/encounters.js";
import * as equipment from "./layers/equipment.js";
import * as greenhouse from "./layers/greenhouse.js";
import * as grid from "./layers/grid.js";
import { createGround } from "./layers/ground.js";
import * as intent from "./layers/intent.js";
import * as links from "./layers/links.js";
import * as measure from "./layers/measure.js";
import * as obstacles from "./layers/obstacles.js";
import { matchPixels } from "./layers/paint.js";
import * as people from "./layers/people.js";
import { createPlaces } from "./layers/places.js";
import * as robot from "./layers/robot.js";
import * as scalebar from "./layers/scalebar.js";
import { createScanLayer } from "./layers/scan.js";
import { createSprites } from "./layers/sprites.js";
import { createStaticImage } from "./layers/static.js";
import * as trail from "./layers/trail.js";
import { drawVeil } from "./layers/veil.js";

/** From the ground up: no layer ever hides a person. */
export const LAYERS = [
  "grid",
  "greenhouse",
  "coverage",
  "costmap",
  "trail",
  "scan",
  "intent",
  "encounters",
  "obstacles",
  "links",
  "equipment",
  "detections",
  "robot",
  "people",
  "scalebar",
];

/** Of the greenhouse and what is known of it: they never move. */
const STILL = ["grid", "greenhouse", "coverage", "costmap"];
/** Robots, and what hides no robot: in each picture. */
const OVER_GROUND = LAYERS.slice(LAYERS.indexOf("robot"));
/** Between them. */
const GROUND = LAYERS.slice(STILL.length, -OVER_GROUND.length);

/** More than any layer nests its drawing states. */
const DEEPEST_SAVE = 8;

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Trails} trails
 */
export function createPicture(canvas, trails) {
  const ctx = /** @type {import("./layers/paint.js").Context} */ (
    canvas.getContext("2d", { alpha: false })
  );
  /** @type {Pick<Picture, "off" | "trailS">} */
  let chosen = { off: [], trailS: 0 };
  const isOn = (/** @type {string} */ layer) => !chosen.off.includes(layer);
  /** @type {Record<string, (paint: Paint) => void>} */
  const layers = {
    measure: (paint) => measure.draw(paint, paint.tape),
    grid: grid.draw,
    greenhouse: greenhouse.draw,
    coverage: coverage.draw,
    costmap: createCostmapLayer(),
    trail: (paint) => trail.draw(paint, trails, chosen.trailS),
    scan: createScanLayer(),
    intent: intent.draw,
    encounters: encounters.draw,
    obstacles: obstacles.draw,
    links: links.draw,
    equipment: equipment.draw,
    detections: detections.draw,
    robot: robot.draw,
    people: createAbove(people.draw),
    scalebar: scalebar.draw,
  };
  const ground = createGround(
    createStaticImage(STILL.map(guarded)),
    GROUND.map(guarded),
    () => [chosen.trailS, ...chosen.off],
    trails.changes,
  );
  const sprites = createSprites();
  /** @type {Set<string>} */
  const broken = new Set();

  /** @param {string} name @returns {import("./layers/ground.js").Layer} */
  function guarded(name) {
    return [name, (paint) => drawLayer(name, paint)];
  }

  /**
   * Bad data in one layer must not take the robots off the map; reported once a layer.
   *
   * @param {string} layer
   * @param {Paint} paint
   */
  function drawLayer(layer, paint) {
    try {
      layers[layer]?.(paint);
      broken.delete(layer);
    } catch (error) {
      if (!broken.has(layer)) reportError(error);
      broken.add(layer);
      recover(paint);
    }
  }

  return {
    /**
     * @param {Picture} what
     * @returns {number} when the scans that are not in it may be drawn (ms from now); 0:
     *   all are
     */
    draw(what) {
      const { ratio } = what;
      const paint = { ...what, ctx, sprites, places: createPlaces() };
      chosen = what;
      matchPixels(canvas, what.view, ratio);
      const missingMs = ground.update(paint, ratio, isOn);
      ctx.setTransform(1, 0, 0, 1, 0, 0);
      ctx.drawImage(ground.canvas, 0, 0);
      ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
      for (const layer of OVER_GROUND) if (isOn(layer)) drawLayer(layer, paint);
      if (paint.tape.points.length) drawLayer("measure", paint);
      if (paint.scene.isVeiled) drawVeil(paint);
      return missingMs;
    },
  };
}

/**
 * Restores a context after a layer that failed, without clearing the picture.
 *
 * @param {Paint} paint
 */
function recover({ ctx, ratio = 1 }) {
  for (let depth = 0; depth < DEEPEST_SAVE; depth += 1) ctx.restore();
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  ctx.globalAlpha = 1;
  ctx.setLineDash([]);
}
