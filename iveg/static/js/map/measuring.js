/** The tape measure between two taps, while measuring is on. */

import { laidTo, lengthOf } from "./layers/measure.js";

/**
 * @typedef {{on: boolean, points: number, metres: number | null}} Measure
 * @param {(measure: Measure) => void} onMeasure
 */
export function createMeasuring(onMeasure) {
  /** @type {import("./layers/measure.js").Tape} */
  let tape = { points: [] };
  let isMeasuring = false;

  /** @param {import("./layers/measure.js").Tape} next */
  function lay(next) {
    tape = next;
    const [points, metres] = [tape.points.length, lengthOf(tape)];
    onMeasure({ on: isMeasuring, points, metres });
  }

  return {
    tape: () => tape,
    isOn: () => isMeasuring,
    /** @param {boolean} on */
    set(on) {
      isMeasuring = on;
      lay({ points: [] });
    },
    /** @param {import("../core/protocol.js").Point} point in `map` (m) */
    mark(point) {
      if (isMeasuring) lay(laidTo(tape, point));
    },
  };
}
