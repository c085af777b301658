/**
 * Tells the server which frame of telemetry has been painted; only then does it send more
 * than a small window of them.  So a page that paints slowly skips, and never lags.
 *
 * It also says how long the next one may wait: one that comes just before the screen's
 * next frame has the newest of everything, and spares both sides those in between.
 */

/** From the server's word until it is drawn, beside the way here (ms). */
const LEAD_MS = 5;
/** Frames of the screen that its rate is known from. */
const FRAMES_KEPT = 16;
/** Of a usual screen (ms): what is much longer were several, and nothing new to draw. */
const USUAL_FRAME_MS = 1000 / 60;
/** Nearer to each other is the same frame (ms). */
const QUICKEST_FRAME_MS = 2;

/**
 * @param {(frame: number, nextMs: number | null) => void} say `nextMs`: until the screen's
 *   next frame, 0 where that is not known; null: nothing is drawn
 * @param {(fn: import("./painting.js").WhenPainted) => void} whenPainted after the map has
 *   drawn what has come
 */
export function createPace(say, whenPainted) {
  const screen = createScreen();
  let newest = 0;
  let told = 0;

  /** @param {number} [beganMs] */
  function tell(beganMs) {
    told = newest;
    // Where nobody looks nothing is drawn, and the moment says nothing of the screen.
    say(newest, document.hidden ? null : screen.nextMs(performance.now(), beganMs));
  }

  return {
    /** Call it when everything that a frame brought was handed on. @param {number} frame */
    took(frame) {
      const isAsked = newest > told;
      newest = frame;
      // Asked for after the map has asked for its own frame: painting comes first.
      if (!isAsked) whenPainted(tell);
    },
  };
}

/** When the frames of this page's screen begin, as far as its pictures show it. */
export function createScreen() {
  /** @type {number[]} */
  let gaps = [];
  let lastMs = Number.NEGATIVE_INFINITY;
  return {
    /**
     * How long until the next frame begins (ms); 0 while that is not known.
     *
     * @param {number} nowMs @param {number} [beganMs] the frame that was just drawn
     */
    nextMs(nowMs, beganMs = lastMs) {
      const gap = beganMs - lastMs;
      lastMs = beganMs;
      if (gap > QUICKEST_FRAME_MS) gaps = [...gaps.slice(1 - FRAMES_KEPT), gap];
      const shortest = Math.min(...gaps);
      if (shortest === Number.POSITIVE_INFINITY) return 0;
      const period = shortest / Math.max(1, Math.round(shortest / USUAL_FRAME_MS));
      return period - ((nowMs - lastMs) % period);
    },
  };
}

/**
 * A report of what was drawn, with how long the next frame may wait (s): its way here and
 * a little to draw it before the screen's next frame.
 *
 * @param {{at: number, within: number}} drawn `within`: half the shortest round trip (s)
 * @param {number} nextMs until the screen's next frame
 */
export function withWait(drawn, nextMs) {
  const wait = (nextMs - LEAD_MS) / 1000 - 2 * drawn.within;
  return { ...drawn, wait: Math.max(0, wait) };
}
