/**
 * The drawing of a map's pictures: on this thread, or by a worker of its own.
 *
 * A canvas that is drawn here costs the page's thread its rasterising and compositing in
 * every frame (half of its load with ten robots), so a worker draws wherever the browser
 * can transfer the canvas.
 *
 * @typedef {import("./picture.js").Picture} Picture
 * @typedef {import("./layers/trail.js").Trails} Trails
 * @typedef {(missingMs: number, beganMs: number) => void} WhenDrawn `missingMs`: when the
 *   scans that are not in it may be drawn (ms from now); 0: all are; `beganMs`: when that
 *   frame of the screen began (`performance.now()`)
 * @typedef {{
 *   trails: Pick<Trails, "add" | "keepOnly">,
 *   soon: (compose: () => void) => void,
 *   draw: (picture: Picture, whenDrawn: WhenDrawn) => void,
 *   end: () => void,
 * }} Brush `soon`: calls back when the next picture may be composed; `draw`: no
 *   `whenDrawn` for a picture that a newer one has replaced
 */

import { createTrails } from "./layers/trail.js";
import { createPicture } from "./picture.js";
import { createRemoteBrush } from "./remotebrush.js";

/** @param {HTMLCanvasElement} canvas @returns {Brush} */
export function createLocalBrush(canvas) {
  const trails = createTrails();
  const picture = createPicture(canvas, trails);
  let beganMs = performance.now();
  return {
    trails,
    soon: (compose) =>
      void requestAnimationFrame((atMs) => {
        beganMs = atMs;
        compose();
      }),
    draw: (what, whenDrawn) => whenDrawn(picture.draw(what), beganMs),
    end() {},
  };
}

/**
 * The worker's brush, or this thread's where no worker starts: a slower map is better
 * than none.
 *
 * @param {HTMLCanvasElement} canvas
 * @returns {Brush}
 */
export function createBrush(canvas) {
  if (!("transferControlToOffscreen" in canvas)) return createLocalBrush(canvas);
  /** @type {(() => void) | null} */
  let waiting = null;
  /** @type {Brush} */
  let brush = createRemoteBrush(canvas, () => {
    brush.end();
    brush = createLocalBrush(canvas);
    if (waiting) brush.soon(waiting);
    waiting = null;
  });
  return {
    trails: {
      add: (...crumb) => brush.trails.add(...crumb),
      keepOnly: (robots) => brush.trails.keepOnly(robots),
    },
    soon(compose) {
      waiting = compose;
      brush.soon(() => {
        waiting = null;
        compose();
      });
    },
    draw: (picture, whenDrawn) => brush.draw(picture, whenDrawn),
    end: () => brush.end(),
  };
}
