/**
 * The layers put on one canvas, from the ground up.
 *
 * What does not move is drawn once per viewport and theme and copied after that.
 *
 * @typedef {import("./layers/paint.js").Paint} Paint
 * @typedef {import("./layers/trail.js").Trails} Trails
 */

import { createCostmapLayer } from "./layers/costmap.js";
import * as detections from "./layers/detections.js";
import * as greenhouse from "./layers/greenhouse.js";
import * as grid from "./layers/grid.js";
import * as intent from "./layers/intent.js";
import * as links from "./layers/links.js";
import * as measure from "./layers/measure.js";
import * as people from "./layers/people.js";
import * as robot from "./layers/robot.js";
import * as scalebar from "./layers/scalebar.js";
import * as scan from "./layers/scan.js";
import { createStaticImage } from "./layers/static.js";
import * as trail from "./layers/trail.js";
import { drawVeil } from "./layers/veil.js";

/** From the ground up: the first two do not move, and nothing ever hides a person. */
export const LAYERS = [
  "grid",
  "greenhouse",
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
  const moving = {
    measure: (paint) => measure.draw(paint, paint.tape),
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
      moving[layer]?.(paint);
      broken.delete(layer);
    } catch (error) {
      if (!broken.has(layer)) reportError(error);
      broken.add(layer);
      recover(ctx);
    }
  }

  return {
    /** @param {Omit<Paint, "ctx">} what */
    draw(what) {
      const paint = { ...what, ctx };
      matchPixels(canvas, paint.view);
      ctx.setTransform(1, 0, 0, 1, 0, 0);
      ctx.drawImage(still.image(paint, devicePixelRatio, isOn), 0, 0);
      ctx.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
      for (const layer of LAYERS) if (isOn(layer)) drawLayer(layer, paint);
      if (paint.tape.points.length) drawLayer("measure", paint);
      if (paint.scene.isVeiled) drawVeil(paint);
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
