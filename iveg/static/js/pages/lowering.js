/**
 * How a change of the rule lowers protection: pure functions, before it is made.
 *
 * @typedef {import("../core/protocol.js").Rule} Rule
 * @typedef {import("./parameters.js").Parameter} Parameter
 * @typedef {Partial<Rule>} Change
 * @typedef {{key: string, slots: Record<string, string | number | boolean | null>}}
 *   Lowering
 */

import { CLASSES, valueFor } from "./parameters.js";

/**
 * Each way in which less would slow a robot, or later.
 *
 * @param {Parameter[]} parameters
 * @param {Rule} before
 * @param {Change} change
 * @returns {Lowering[]}
 */
export function loweringsOf(parameters, before, change) {
  const after = { ...before, ...change };
  const words = lostWords(before.aliases ?? {}, after.aliases ?? {});
  const lowered = parameters.flatMap((one) => loweredOf(one, before, after));
  if (!words.length) return lowered;
  return [...lowered, { key: "lowering.words", slots: { words: words.join(", ") } }];
}

/** @param {Parameter} parameter @param {Rule} before @param {Rule} after */
function loweredOf(parameter, before, after) {
  const classes = parameter.class_key === null ? [null] : CLASSES;
  return classes.flatMap((class_) => {
    const from = valueFor(parameter, before, class_);
    const to = valueFor(parameter, after, class_);
    const isLess = parameter.protects === "more" ? to < from : to > from;
    if (!isLess) return [];
    return [{ key: `lowering.${parameter.word}`, slots: { from, to, class: class_ } }];
  });
}

/** @param {Record<string, string>} before @param {Record<string, string>} after */
function lostWords(before, after) {
  return Object.keys(before)
    .filter((word) => before[word] === "person" && word !== "person")
    .filter((word) => after[word] !== "person")
    .sort();
}
