/**
 * The layers put on one canvas, from the ground up.
 *
 * What does not move is drawn once per viewport and theme, what lies under the machines
 * when it changes; both are copied in between.
 *
 * @typedef {import("./layers/paint.js").Paint} Paint
 * @typedef {import("./layers/trail.js").Trails} Trails
 */

import { createCostmapLayer } from "./layers/costmap.js";
import * as coverage from "./layers/coverage.js";
import * as detections from "./layers/detections.js";
import * as greenhouse from "./layers/greenhouse.js";
import * as grid from "./layers/grid.js";
import { createGround } from "./layers/ground.js";
import * as intent from "./layers/intent.js";
import * as links from "./layers/links.js";
import * as measure from "./layers/measure.js";
import * as people from "./layers/people.js";
import { createPlaces } from "./layers/places.js";
import * as robot from "./layers/robot.js";
import * as scalebar from "./layers/scalebar.js";
import * as scan from "./layers/scan.js";
import { createStaticImage } from "./layers/static.js";
import * as trail from "./layers/trail.js";
import { drawVeil } from "./layers/veil.js";

/** From the ground up: nothing ever hides a person. */
export const LAYERS = [
  "grid",
  "greenhouse",
  "coverage",
  "costmap",
  "trail",
  "scan",
  "intent",
  "links",
  "detections",
  "robot",
  "people",
  "scalebar",
];

/** Under the machines; the two below them never move. */
const GROUND = ["coverage", "costmap", "trail", "scan"];
const OVER_GROUND = LAYERS.slice(LAYERS.indexOf("scan") + 1);

/** More than any layer nests its drawing states. */
const DEEPEST_SAVE = 8;

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Trails} trails
 * @param {(layer: string) => boolean} isOn
 * @param {() => number} trailSeconds
 */
export function createPicture(canvas, trails, isOn, trailSeconds) {
  const ctx = /** @type {CanvasRenderingContext2D} */ (
    canvas.getContext("2d", { alpha: false })
  );
  const still = createStaticImage([
    ["grid", grid.draw],
    ["greenhouse", greenhouse.draw],
  ]);
  /** @type {Record<string, (paint: Paint) => void>} */
  const layers = {
    measure: (paint) => measure.draw(paint, paint.tape),
    coverage: coverage.draw,
    costmap: createCostmapLayer(),
    trail: (paint) => trail.draw(paint, trails, trailSeconds()),
    scan: scan.draw,
    intent: intent.draw,
    links: links.draw,
    detections: detections.draw,
    robot: robot.draw,
    people: people.draw,
    scalebar: scalebar.draw,
  };
  const ground = createGround(
    still,
    GROUND.map((name) => [name, (paint) => drawLayer(name, paint)]),
    () => [trails.changes(), trailSeconds(), ...LAYERS.map(isOn)],
  );
  /** @type {Set<string>} */
  const broken = new Set();

  /**
   * One layer's bad datum must not take the robots off the map; told once a layer.
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
      recover(paint.ctx);
    }
  }

  return {
    /**
     * @param {Omit<Paint, "ctx">} what
     * @returns {number} when the scans that are not in it may be drawn (ms from now); 0:
     *   all are
     */
    draw(what) {
      const paint = { ...what, ctx, places: createPlaces() };
      matchPixels(canvas, paint.view);
      const missingMs = ground.update(paint, devicePixelRatio, isOn);
      ctx.setTransform(1, 0, 0, 1, 0, 0);
      ctx.drawImage(ground.canvas, 0, 0);
      ctx.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
      for (const layer of OVER_GROUND) if (isOn(layer)) drawLayer(layer, paint);
      if (paint.tape.points.length) drawLayer("measure", paint);
      if (paint.scene.isVeiled) drawVeil(paint);
      return missingMs;
    },
  };
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {{width: number, height: number}} view (CSS px)
 */
function matchPixels(canvas, view) {
  const width = Math.round(view.width * devicePixelRatio);
  const height = Math.round(view.height * devicePixelRatio);
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
}

/**
 * Brings a context back from wherever a layer left it, without clearing the picture.
 *
 * @param {CanvasRenderingContext2D} ctx
 */
function recover(ctx) {
  for (let depth = 0; depth < DEEPEST_SAVE; depth += 1) ctx.restore();
  ctx.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
  ctx.globalAlpha = 1;
  ctx.setLineDash([]);
}
