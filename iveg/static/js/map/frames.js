/**
 * The map's frame loop, which runs only when there is something new.
 *
 * A message requests the next picture the moment it arrives; however many arrive before
 * it, that picture has the newest of each, so no queue can grow.
 *
 * @typedef {import("./brush.js").Brush} Brush
 * @typedef {import("./picture.js").Picture} Picture
 * @typedef {(hasScans: boolean, beganMs: number) => void} Seen whether the newest scans
 *   are in it, too; when that frame of the screen began (`performance.now()`)
 */

/**
 * @param {Brush} brush
 * @param {() => Picture | null} compose what is to be seen now; null: there is no place
 */
export function createFrames(brush, compose) {
  /** @type {Set<() => Seen>} */
  const watchers = new Set();
  let isAsked = false;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;

  function ask() {
    if (isAsked) return;
    isAsked = true;
    brush.soon(() => {
      if (isAsked) draw();
    });
  }

  function draw() {
    isAsked = false;
    const picture = compose();
    if (!picture) return;
    const seen = [...watchers].map((watch) => watch());
    brush.draw(picture, (missingMs, beganMs) => {
      for (const tell of seen) tell(missingMs === 0, beganMs);
      clearTimeout(later);
      if (missingMs) later = setTimeout(ask, missingMs);
    });
  }

  return {
    ask,
    /** At once: a resized canvas is blank until it is drawn. */
    draw,
    /**
     * Calls `watch` when a picture is composed, and its result when that picture, or a
     * newer one with all of its values, is on the canvas.
     *
     * @param {() => Seen} watch
     * @returns {() => void} ends it
     */
    onPicture(watch) {
      watchers.add(watch);
      return () => void watchers.delete(watch);
    },
    /**
     * Calls `fn` once the present values are on the canvas, with the beginning of that
     * frame of the screen (`performance.now()`).
     *
     * @param {(beganMs: number) => void} fn
     */
    afterDrawn(fn) {
      const end = () => void watchers.delete(watch);
      /** @returns {Seen} */
      const watch = () => (_, beganMs) => {
        if (watchers.has(watch)) fn(beganMs);
        end();
      };
      watchers.add(watch);
      ask();
    },
    end() {
      isAsked = false;
      clearTimeout(later);
      watchers.clear();
    },
  };
}
