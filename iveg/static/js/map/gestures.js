/**
 * Pointer and wheel events on the map, turned into gestures.
 *
 * @typedef {{
 *   pan: (dx: number, dy: number) => void,
 *   zoom: (px: number, py: number, factor: number) => void,
 *   pinch: (dx: number, dy: number, px: number, py: number, factor: number) => void,
 *   tapMeans: () => (px: number, py: number) => void,
 *   doubleTap: (px: number, py: number) => void,
 *   hover: (px: number, py: number) => void,
 * }} Gestures all in CSS pixels of the element; `pinch` moves and zooms at once,
 *   `tapMeans` is asked when the finger goes down and done when the tap is certain
 * @typedef {{x: number, y: number}} Point
 */

/** A touch that moved less than this (px) was a tap: gloves are not precise. */
const TAP_SLACK_PX = 6;
const DOUBLE_TAP_MS = 280;
const DOUBLE_TAP_PX = 30;
const WHEEL_RATE = 0.0016;
/** A trackpad's pinch comes as a wheel with ctrl and small steps. */
const PINCH_RATE = 0.01;
const WHEEL_MOST = 240;
const LINE_PX = 16;

/**
 * @param {HTMLElement} element
 * @param {Gestures} gestures
 * @returns {() => void} stops listening
 */
export function listen(element, gestures) {
  const ending = new AbortController();
  const signal = ending.signal;
  const touch = createTouch(gestures);
  /** @param {MouseEvent} event @returns {Point} */
  const place = (event) => ({ x: event.offsetX, y: event.offsetY });

  element.style.touchAction = "none";
  element.addEventListener(
    "pointerdown",
    (event) => {
      if (event.button > 0) return;
      capture(element, event.pointerId);
      touch.down(event.pointerId, place(event));
    },
    { signal },
  );
  element.addEventListener(
    "pointermove",
    (event) => touch.move(event.pointerId, place(event)),
    { signal },
  );
  element.addEventListener(
    "pointerup",
    (event) => touch.up(event.pointerId, place(event), event.timeStamp),
    { signal },
  );
  element.addEventListener("pointercancel", (event) => touch.forget(event.pointerId), {
    signal,
  });
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      gestures.zoom(event.offsetX, event.offsetY, wheelFactor(event));
    },
    { signal, passive: false },
  );
  signal.addEventListener("abort", touch.end);
  return () => ending.abort();
}

/**
 * Captures a drag that leaves the element.
 *
 * @param {HTMLElement} element
 * @param {number} pointerId
 */
function capture(element, pointerId) {
  try {
    element.setPointerCapture(pointerId);
  } catch {
    // The finger is up already; there is nothing left to keep.
  }
}

/**
 * Zoom factor of one turn of the wheel.
 *
 * @param {{deltaY: number, deltaMode: number, ctrlKey: boolean}} wheel
 */
export function wheelFactor({ deltaY, deltaMode, ctrlKey }) {
  const pixels = deltaMode === 0 ? deltaY : deltaY * LINE_PX;
  const turned = Math.max(-WHEEL_MOST, Math.min(WHEEL_MOST, pixels));
  return Math.exp(-turned * (ctrlKey ? PINCH_RATE : WHEEL_RATE));
}

/**
 * One finger drags or taps, two pinch.  A tap is reported after the time in which it
 * could still become a double tap, so that following a robot does not open its record.
 * It means what it meant when the finger went down: what the page asks for meanwhile is
 * not answered by it.
 *
 * @param {Gestures} gestures
 */
export function createTouch(gestures) {
  /** @type {Map<number, Point>} */
  const fingers = new Map();
  /** @type {Point} */
  let start = { x: 0, y: 0 };
  let isTap = false;
  /** @type {{place: Point, at: number} | null} */
  let lastTap = null;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let waiting;
  let meaning = gestures.tapMeans();

  /** @param {Point} place @param {number} at (ms) */
  function tap(place, at) {
    clearTimeout(waiting);
    const isDouble =
      lastTap &&
      at - lastTap.at < DOUBLE_TAP_MS &&
      gap(place, lastTap.place) < DOUBLE_TAP_PX;
    lastTap = isDouble ? null : { place, at };
    if (isDouble) gestures.doubleTap(place.x, place.y);
    else waiting = setTimeout(meaning, DOUBLE_TAP_MS, place.x, place.y);
  }

  /** @param {number} id @param {Point} to */
  function drag(id, to) {
    const from = fingers.get(id) ?? to;
    if (isTap && gap(start, to) < TAP_SLACK_PX) return;
    isTap = false;
    fingers.set(id, to);
    gestures.pan(to.x - from.x, to.y - from.y);
  }

  /** @param {number} id @param {Point} to */
  function pinch(id, to) {
    const [before, gapBefore] = spread(fingers);
    fingers.set(id, to);
    const [after, gapAfter] = spread(fingers);
    const factor = gapBefore > 0 ? gapAfter / gapBefore : 1;
    gestures.pinch(after.x - before.x, after.y - before.y, after.x, after.y, factor);
  }

  return {
    /** @param {number} id @param {Point} place */
    down(id, place) {
      fingers.set(id, place);
      isTap = fingers.size === 1;
      if (isTap) meaning = gestures.tapMeans();
      start = place;
    },
    /** @param {number} id @param {Point} place */
    move(id, place) {
      if (!fingers.has(id)) gestures.hover(place.x, place.y);
      else if (fingers.size === 1) drag(id, place);
      else if (fingers.size === 2) pinch(id, place);
    },
    /** @param {number} id @param {Point} place @param {number} at (ms) */
    up(id, place, at) {
      fingers.delete(id);
      if (isTap) tap(place, at);
      isTap = false;
    },
    /** @param {number} id */
    forget(id) {
      fingers.delete(id);
      isTap = false;
    },
    end: () => clearTimeout(waiting),
  };
}

/**
 * @param {Map<number, Point>} fingers two of them
 * @returns {[Point, number]} the middle and the distance (px)
 */
function spread(fingers) {
  const [a, b] = [...fingers.values()];
  return [{ x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 }, gap(a, b)];
}

/** @param {Point} a @param {Point} b */
function gap(a, b) {
  return Math.hypot(a.x - b.x, a.y - b.y);
}
