/**
 * Which layers a person switched on, and how long trails are: kept by the browser.
 *
 * @typedef {{off: string[], trailS: number, shortcuts: boolean}} Choices
 */

import { TRAIL_SPANS_S } from "./trail.js";

const KEY = "iveg.map";
/** @type {Choices} */
const FIRST = { off: [], trailS: TRAIL_SPANS_S[1], shortcuts: true };

/**
 * @param {Storage | null} storage null where the browser keeps nothing
 * @returns {Choices}
 */
export function readChoices(storage) {
  try {
    const kept = JSON.parse(storage?.getItem(KEY) ?? "{}");
    return {
      off: Array.isArray(kept.off) ? kept.off.map(String) : FIRST.off,
      trailS: TRAIL_SPANS_S.includes(kept.trailS) ? kept.trailS : FIRST.trailS,
      shortcuts: kept.shortcuts !== false,
    };
  } catch {
    return FIRST;
  }
}

/**
 * @param {Storage | null} storage
 * @param {Choices} choices
 */
export function keepChoices(storage, choices) {
  try {
    storage?.setItem(KEY, JSON.stringify(choices));
  } catch {
    // A full or forbidden store costs the memory of a switch, never the switch.
  }
}

/** The browser's storage; null where reading it is forbidden. */
export function browserStorage() {
  try {
    return localStorage;
  } catch {
    return null;
  }
}
