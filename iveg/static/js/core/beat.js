/**
 * The page's beat: panels write their texts together, in few frames.
 *
 * Each frame in which any text changes costs style, layout, paint and compositing of the
 * whole page, whether one word is new or a hundred; a dozen panels with timers of their
 * own would make thirty such frames a second.
 */

import { guarded, onNextFrame } from "./hub.js";

/** Digits that change more often than this cannot be read (ms). */
export const BEAT_MS = 200;

/** @param {(fn: () => void) => void} [schedule] */
export function createBeat(schedule = afterNextFrame) {
  /** @type {Set<() => void>} */
  let waiting = new Set();
  let lastMs = Number.NEGATIVE_INFINITY;

  function beat() {
    lastMs = performance.now();
    const told = waiting;
    waiting = new Set();
    for (const fn of told) guarded(fn);
  }

  /** Calls `fn` after the next of these frames, once however often it is asked for.
   * @param {() => void} fn */
  return function onBeat(fn) {
    waiting.add(fn);
    if (waiting.size > 1) return;
    const waitMs = lastMs + BEAT_MS - performance.now();
    if (waitMs > 0) setTimeout(schedule, waitMs, beat);
    else schedule(beat);
  };
}

/** The map's picture does not wait for texts. @param {() => void} fn */
const afterNextFrame = (fn) => onNextFrame(() => setTimeout(fn));

/** The one beat of this page. */
export const onBeat = createBeat();
