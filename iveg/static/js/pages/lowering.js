/**
 * How a change of the rule lowers protection: pure functions, before it is made.
 *
 * @typedef {import("../core/protocol.js").Rule} Rule
 * @typedef {Partial<Pick<Rule, "confidence_threshold" | "radius_m" | "class_thresholds" |
 *   "aliases" | "foresight" | "foresight_s">>} Change
 * @typedef {{key: string, slots: Record<string, string | number>}} Lowering
 */

/**
 * Each way in which fewer people would slow a robot, or later.
 *
 * @param {Rule} before
 * @param {Change} change
 * @returns {Lowering[]}
 */
export function loweringsOf(before, change) {
  const after = { ...before, ...change };
  const [from, to] = [personShare(before), personShare(after)];
  const radius = { from: before.radius_m, to: after.radius_m };
  const horizon = { from: before.foresight_s, to: after.foresight_s };
  const words = lostWords(before.aliases ?? {}, after.aliases ?? {});
  return [
    ...when(to > from, "lowering.threshold", { from, to }),
    ...when(radius.to < radius.from, "lowering.radius", radius),
    ...when(words.length > 0, "lowering.words", { words: words.join(", ") }),
    ...when(before.foresight === true && !after.foresight, "lowering.foresight", {}),
    ...when(
      after.foresight === true && horizon.to < horizon.from,
      "lowering.horizon",
      horizon,
    ),
  ];
}

/** From which certainty a person counts (0–1). @param {Rule} rule */
export function personShare({ class_thresholds, confidence_threshold }) {
  return class_thresholds?.person ?? confidence_threshold;
}

/**
 * How many of today's sightings would no longer count.
 *
 * @param {{probability: number}[]} seen
 * @param {number} from the threshold in force (0–1)
 * @param {number} to the new one
 */
export function sightingsLost(seen, from, to) {
  const counted = seen.filter(({ probability }) => probability >= from);
  const count = counted.filter(({ probability }) => probability < to).length;
  return { count, total: counted.length };
}

/**
 * How many of a day's encounters were foretold, and how long before on average (s).
 *
 * @param {{count: number, foretold: number, foretold_s: number | null}} met
 */
export function foreseen({ count, foretold, foretold_s }) {
  return { count: foretold, total: count, seconds: foretold_s ?? 0 };
}

/** @param {Record<string, string>} before @param {Record<string, string>} after */
function lostWords(before, after) {
  return Object.keys(before)
    .filter((word) => before[word] === "person" && word !== "person")
    .filter((word) => after[word] !== "person")
    .sort();
}

/** @param {boolean} isSo @param {string} key @param {Lowering["slots"]} slots */
const when = (isSo, key, slots) => (isSo ? [{ key, slots }] : []);
