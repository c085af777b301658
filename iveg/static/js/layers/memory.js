/**
 * What a person chose for the map (layers, length of trails, keys), kept by the browser.
 *
 * @typedef {{off: string[], trailS: number, shortcuts: boolean}} Kept
 */

import { TRAIL_SPANS_S } from "./trail.js";

const KEY = "iveg.map";
/** @type {Kept} */
const FIRST = { off: [], trailS: TRAIL_SPANS_S[1], shortcuts: true };

/**
 * @param {Storage | null} storage null where the browser keeps nothing
 * @param {() => void} onChange
 */
export function createChoices(storage, onChange) {
  let { trailS, shortcuts, ...kept } = read(storage);
  const off = new Set(kept.off);

  function changed() {
    write(storage, { off: [...off], trailS, shortcuts });
    onChange();
  }

  return {
    /** @param {string} layer */
    isOn: (layer) => !off.has(layer),
    /** @param {string} layer one of LAYERS @param {boolean} on */
    setLayer(layer, on) {
      if (on) off.delete(layer);
      else off.add(layer);
      changed();
    },
    trailSeconds: () => trailS,
    /** @param {number} seconds one of TRAIL_SPANS_S */
    setTrail(seconds) {
      trailS = seconds;
      changed();
    },
    hasShortcuts: () => shortcuts,
    /** Single-key shortcuts on or off (WCAG 2.1.4). @param {boolean} on */
    setShortcuts(on) {
      shortcuts = on;
      changed();
    },
  };
}

/** The browser's storage; null where reading it is forbidden. */
export function browserStorage() {
  try {
    return localStorage;
  } catch {
    return null;
  }
}

/** @param {Storage | null} storage @returns {Kept} */
function read(storage) {
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

/** @param {Storage | null} storage @param {Kept} choices */
function write(storage, choices) {
  try {
    storage?.setItem(KEY, JSON.stringify(choices));
  } catch {
    // A full or forbidden store costs the memory of a switch, never the switch.
  }
}
