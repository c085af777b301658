/**
 * Tells the server which frame of telemetry has been painted; only then does it send more
 * than a small window of them.  So a page that paints slowly skips, and never lags.
 */

/**
 * @param {(frame: number, isDrawn: boolean) => void} say
 * @param {(fn: () => void) => void} whenPainted after the map has drawn what has come
 */
export function createPace(say, whenPainted) {
  let newest = 0;
  let told = 0;

  function tell() {
    told = newest;
    // Where nobody looks nothing is drawn, and the moment says nothing of the screen.
    say(newest, !document.hidden);
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
