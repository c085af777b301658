/**
 * Tells the server which frame of telemetry has been painted; only then does it send more
 * than a small window of them.  So a page that paints slowly skips, and never lags.
 */

/**
 * @param {(frame: number, isDrawn: boolean) => void} say a hidden page draws nothing
 * @param {(fn: () => void) => void} whenPainted after the map has drawn the newest values
 */
export function createPace(say, whenPainted) {
  let newest = 0;
  let told = 0;

  function tell() {
    told = newest;
    say(newest, !document.hidden);
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
