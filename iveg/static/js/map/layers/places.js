/**
 * Places of the labels in a frame, so that none overlap.
 *
 * @typedef {import("../viewport.js").Rect} Rect
 * @typedef {ReturnType<typeof createPlaces>} Places
 */

/** Between two labels (px). */
const GAP_PX = 2;

export function createPlaces() {
  /** @type {Rect[]} */
  const taken = [];
  /** @type {Rect[]} */
  const labels = [];

  /** @param {Rect} rect */
  const isFree = (rect) => !taken.some((other) => overlap(rect, other));

  return {
    /** What is there in any case. @param {Rect} rect */
    take(rect) {
      taken.push(rect);
    },
    /**
     * Takes the first place that is free.
     *
     * @param {readonly Rect[]} wished the best first
     * @returns {number | null} which one; null where all are taken
     */
    claim(wished) {
      const found = wished.findIndex(isFree);
      if (found < 0) return null;
      taken.push(wished[found]);
      labels.push(wished[found]);
      return found;
    },
    /** Labels that were claimed before and stay. @param {readonly Rect[]} rects */
    keep(rects) {
      taken.push(...rects);
      labels.push(...rects);
    },
    /** The labels so far. */
    labels: () => labels,
  };
}

/** Whether there is no gap between them. @param {Rect} one @param {Rect} other */
export function overlap(one, other) {
  return (
    one.left < other.right + GAP_PX &&
    other.left < one.right + GAP_PX &&
    one.top < other.bottom + GAP_PX &&
    other.top < one.bottom + GAP_PX
  );
}
