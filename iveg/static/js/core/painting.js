/**
 * The moment when this page has painted the newest messages; the map knows it, if any.
 *
 * @typedef {{afterDrawn: (fn: () => void) => void}} Painter
 */

import { onNextFrame } from "./hub.js";

/** A page that is not painted answers this seldom (ms). */
const HIDDEN_MS = 1000;

export function createPainting() {
  /** @type {Painter | null} */
  let painter = null;
  return {
    /** @param {Painter} map */
    follow(map) {
      painter = map;
    },
    /**
     * Calls `fn` once the present values have been painted, or a second later.
     *
     * @param {() => void} fn
     */
    when(fn) {
      if (painter) once(painter, fn);
      else onNextFrame(fn, HIDDEN_MS);
    },
  };
}

/** @param {Painter} painter @param {() => void} fn */
function once(painter, fn) {
  let isDone = false;
  const done = () => {
    if (isDone) return;
    isDone = true;
    clearTimeout(timer);
    fn();
  };
  const timer = setTimeout(done, HIDDEN_MS);
  painter.afterDrawn(done);
}
