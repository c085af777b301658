/**
 * Tells the server which frame of telemetry has been painted; only then does it send more
 * than a small window of them.  So a page that paints slowly skips, and never lags.
 *
 * It also says how long the next one may wait: a frame that arrives just before the
 * screen's next one has the newest values, and spares both sides those in between.
 */

/** From the arrival of a frame until it is drawn (ms). */
const LEAD_MS = 5;
/** Frames of the screen from which its rate is estimated. */
const FRAMES_KEPT = 16;
/** Period of a usual screen (ms): a much longer gap was several frames without news. */
const USUAL_FRAME_MS = 1000 / 60;
/** A shorter gap is within the same frame (ms). */
const QUICKEST_FRAME_MS = 2;

/**
 * @param {(frame: number, nextMs: number | null) => void} say `nextMs`: until the screen's
 *   next frame, 0 where it is unknown; null: nothing is drawn
 * @param {(fn: import("./painting.js").WhenPainted) => void} whenPainted after the map has
 *   drawn the newest values
 */
export function createPace(say, whenPainted) {
  const screen = createScreen();
  let newest = 0;
  let told = 0;

  /** @param {number} [beganMs] */
  function tell(beganMs) {
    told = newest;
    // A hidden page draws nothing, so this moment says nothing of the screen.
    say(newest, document.hidden ? null : screen.nextMs(performance.now(), beganMs));
  }

  return {
    /** To be called when everything in a frame has been delivered. @param {number} frame */
    took(frame) {
      const isAsked = newest > told;
      newest = frame;
      // Requested after the map's own frame: painting comes first.
      if (!isAsked) whenPainted(tell);
    },
  };
}

/** The phase and period of the screen's frames, estimated from the pictures drawn. */
export function createScreen() {
  /** @type {number[]} */
  let gaps = [];
  let lastMs = Number.NEGATIVE_INFINITY;
  return {
    /**
     * Time until the next frame begins (ms); 0 while it is unknown.
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
 * The report of a picture, with the time that the next frame may wait (s), so that it
 * arrives and is drawn before the screen's next frame.
 *
 * @param {{at: number, within: number}} drawn `within`: half the shortest round trip (s)
 * @param {number} nextMs until the screen's next frame
 */
export function withWait(drawn, nextMs) {
  const wait = (nextMs - LEAD_MS) / 1000 - 2 * drawn.within;
  return { ...drawn, wait: Math.max(0, wait) };
}
