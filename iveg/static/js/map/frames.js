/**
 * The map's frame loop, which runs only when there is something new.
 *
 * A message requests the next picture the moment it arrives; however many arrive before
 * it, that picture has the newest of each, so no queue can grow.
 *
 * @typedef {(hasScans: boolean) => void} WhenDrawn whether the newest scans are in it, too
 */

/**
 * @param {() => number | null} draw draws what is to be seen now, and returns when the
 *   scans that are not in it may be drawn (ms from now); 0: all are; null: there is no
 *   place
 */
export function createFrames(draw) {
  /** @type {Set<WhenDrawn>} */
  const watchers = new Set();
  let isAsked = false;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;

  function ask() {
    if (isAsked) return;
    isAsked = true;
    requestAnimationFrame(() => {
      if (isAsked) drawNow();
    });
  }

  function drawNow() {
    isAsked = false;
    const missingMs = draw();
    if (missingMs === null) return;
    // Who asks again meanwhile asks for the next one.
    for (const tell of [...watchers]) tell(missingMs === 0);
    clearTimeout(later);
    if (missingMs) later = setTimeout(ask, missingMs);
  }

  return {
    ask,
    /** At once: a resized canvas is blank until it is drawn. */
    drawNow,
    /**
     * Calls `fn` after each picture.
     *
     * @param {WhenDrawn} fn
     * @returns {() => void} ends it
     */
    onDrawn(fn) {
      watchers.add(fn);
      return () => void watchers.delete(fn);
    },
    /**
     * Calls `fn` once the present values are on the canvas.
     *
     * @param {() => void} fn
     */
    afterDrawn(fn) {
      const tell = () => {
        watchers.delete(tell);
        fn();
      };
      watchers.add(tell);
      ask();
    },
    end() {
      isAsked = false;
      clearTimeout(later);
      watchers.clear();
    },
  };
}
