/**
 * A person's choices for the map (layers, length of trails, keys), kept by the browser.
 *
 * @typedef {{off: string[], trailS: number, shortcuts: boolean,
 *   believer: string | null}} Kept `believer`: the robot whose knowledge the map shows;
 *   null shows all
 */

import { TRAIL_SPANS_S } from "./trail.js";

const KEY = "iveg.map";
/** @type {Kept} */
const FIRST = {
  off: ["costmap"],
  trailS: TRAIL_SPANS_S[1],
  shortcuts: true,
  believer: null,
};

/**
 * @param {Storage | null} storage null where the browser keeps nothing
 * @param {() => void} onChange
 */
export function createChoices(storage, onChange) {
  let { trailS, shortcuts, believer, ...kept } = read(storage);
  const off = new Set(kept.off);

  function changed() {
    write(storage, { off: [...off], trailS, shortcuts, believer });
    onChange();
  }

  return {
    /** @param {string} layer */
    isOn: (layer) => !off.has(layer),
    /** Layers that are switched off. */
    off: () => [...off],
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
    believer: () => believer,
    /** @param {string | null} robotId */
    setBeliever(robotId) {
      believer = robotId;
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
      believer: typeof kept.believer === "string" ? kept.believer : null,
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
    // A full or forbidden storage costs the memory of a switch, never the switch.
  }
}
