/**
 * Which part of the greenhouse is on the canvas: pure geometry between `map` and pixels.
 *
 * A viewport is a value; every movement makes a new one.  World is metres, x right and
 * y up; screen is CSS pixels, y down, whatever the device's pixel ratio.
 *
 * @typedef {{width: number, height: number, scale: number, x: number, y: number}} Viewport
 *   canvas size (CSS px), scale (px/m), world point at its centre (m)
 * @typedef {import("../core/protocol.js").Box2D} Box2D
 * @typedef {{left: number, top: number, right: number, bottom: number}} Rect (px),
 *   `right` and `bottom` counted from the left and the top as well
 */

/** From a greenhouse of a kilometre to the teeth of a wheel (px/m). */
export const MIN_SCALE = 1;
export const MAX_SCALE = 400;
/** Between the greenhouse and the elements over the map (px). */
const GAP_PX = 8;
/** Larger covers are ignored: the greenhouse keeps a third of the canvas each way. */
const MOST_OF_A_SIDE = 1 / 3;

/**
 * @param {number} width (CSS px)
 * @param {number} height (CSS px)
 * @returns {Viewport}
 */
export function createViewport(width, height) {
  return { width, height, scale: 20, x: 0, y: 0 };
}

/** @param {Viewport} view @param {number} x (m) @returns {number} (px) */
export function screenX(view, x) {
  return view.width / 2 + (x - view.x) * view.scale;
}

/** @param {Viewport} view @param {number} y (m) @returns {number} (px) */
export function screenY(view, y) {
  return view.height / 2 - (y - view.y) * view.scale;
}

/** @param {Viewport} view @param {number} px @returns {number} (m) */
export function worldX(view, px) {
  return view.x + (px - view.width / 2) / view.scale;
}

/** @param {Viewport} view @param {number} py @returns {number} (m) */
export function worldY(view, py) {
  return view.y - (py - view.height / 2) / view.scale;
}

/** What is visible (m). @param {Viewport} view @returns {Box2D} */
export function visible(view) {
  return {
    xmin: worldX(view, 0),
    xmax: worldX(view, view.width),
    ymin: worldY(view, view.height),
    ymax: worldY(view, 0),
  };
}

/**
 * Shows a whole rectangle, in the middle of the uncovered part.
 *
 * A cover at a corner can be avoided beside or above it: the larger picture wins.
 *
 * @param {Viewport} view
 * @param {Box2D} box (m)
 * @param {number} [padding] kept free on every side (px)
 * @param {readonly Rect[]} [covers] elements over the canvas, at its edges
 * @returns {Viewport}
 */
export function fitTo(view, box, padding = 28, covers = []) {
  const room = Math.min(padding, view.width / 8, view.height / 8);
  let ways = [{ left: room, top: room, right: room, bottom: room }];
  for (const cover of covers) {
    ways = ways.flatMap((way) => passing(view, way, cover));
  }
  const fitted = ways.map((way) => fitBetween(view, box, way));
  return fitted.reduce((best, one) => (one.scale > best.scale ? one : best));
}

/**
 * Insets that also leave a cover alone, beside it or above or below; as they were where
 * it leaves too little room.
 *
 * @param {Viewport} view @param {Rect} way @param {Rect} cover
 * @returns {Rect[]}
 */
function passing({ width, height }, way, cover) {
  const beside = nearest("left", cover.right, "right", width - cover.left);
  const along = nearest("top", cover.bottom, "bottom", height - cover.top);
  const ways = [
    { ...beside, most: width * MOST_OF_A_SIDE },
    { ...along, most: height * MOST_OF_A_SIDE },
  ]
    .filter(({ px, most }) => px <= most)
    .map(({ side, px }) => ({ ...way, [side]: Math.max(way[side], px) }));
  return ways.length > 0 ? ways : [way];
}

/**
 * @param {keyof Rect} one @param {number} px how far the cover reaches from there
 * @param {keyof Rect} other @param {number} otherPx
 */
function nearest(one, px, other, otherPx) {
  const [side, reach] = px < otherPx ? [one, px] : [other, otherPx];
  return { side, px: reach + GAP_PX };
}

/** @param {Viewport} view @param {Box2D} box @param {Rect} free insets (px) */
function fitBetween(view, box, { left, top, right, bottom }) {
  const across = (view.width - left - right) / Math.max(box.xmax - box.xmin, 1);
  const along = (view.height - top - bottom) / Math.max(box.ymax - box.ymin, 1);
  const scale = clampScale(Math.min(across, along));
  const x = (box.xmin + box.xmax) / 2 - (left - right) / 2 / scale;
  const y = (box.ymin + box.ymax) / 2 + (top - bottom) / 2 / scale;
  return { ...view, scale, x, y };
}

/**
 * Zooms so that the world point under a pixel stays under it.
 *
 * @param {Viewport} view
 * @param {number} px
 * @param {number} py
 * @param {number} factor above 1 = closer
 * @returns {Viewport}
 */
export function zoomAt(view, px, py, factor) {
  const scale = clampScale(view.scale * factor);
  const shift = 1 / view.scale - 1 / scale;
  const x = view.x + (px - view.width / 2) * shift;
  const y = view.y - (py - view.height / 2) * shift;
  return { ...view, scale, x, y };
}

/**
 * Moves the world with the finger.
 *
 * @param {Viewport} view
 * @param {number} dx (px)
 * @param {number} dy (px)
 * @returns {Viewport}
 */
export function panBy(view, dx, dy) {
  return { ...view, x: view.x - dx / view.scale, y: view.y + dy / view.scale };
}

/** @param {Viewport} view @param {number} x (m) @param {number} y (m) */
export function centredOn(view, x, y) {
  return { ...view, x, y };
}

/** @param {Viewport} view @param {number} width @param {number} height */
export function resized(view, width, height) {
  return { ...view, width, height };
}

/**
 * The rectangle around points; null when there is none.
 *
 * @param {Iterable<{x: number, y: number}>} points
 * @param {number} [margin] (m)
 * @returns {Box2D | null}
 */
export function boundsOf(points, margin = 0) {
  let [xmin, ymin] = [Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY];
  let [xmax, ymax] = [Number.NEGATIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (const { x, y } of points) {
    if (!Number.isFinite(x) || !Number.isFinite(y)) continue;
    xmin = Math.min(xmin, x);
    xmax = Math.max(xmax, x);
    ymin = Math.min(ymin, y);
    ymax = Math.max(ymax, y);
  }
  if (xmin > xmax) return null;
  xmin -= margin;
  xmax += margin;
  return { xmin, xmax, ymin: ymin - margin, ymax: ymax + margin };
}

/** @param {number} scale */
function clampScale(scale) {
  return Math.min(MAX_SCALE, Math.max(MIN_SCALE, scale));
}
