/**
 * The room of the strip of STOP controls, which every page has: those of a larger fleet
 * stand behind one tap, so that none is too small for a glove.
 */

import { need, setHidden } from "./dom.js";

/** Robots whose controls the strip has room for. */
const HOLDS = 4;
const NARROW_HOLDS = 3;
const LOW_HOLDS = 2;

const NARROW = matchMedia("(min-width: 1200px) and (max-width: 1399px)");
/** A phone lying down: the strip stands beside the map. */
const LOW = matchMedia(
  "(max-height: 500px) and (min-width: 568px) and (max-width: 1199px)",
);

/**
 * @param {() => number} count robots of the fleet
 * @returns {() => void} to be called when a control is new
 */
export function createPlace(count) {
  function place() {
    const isMany = count() > holds();
    need("#stops").toggleAttribute("data-many", isMany);
    setHidden(need("#stops-more"), !isMany);
  }

  for (const screen of [NARROW, LOW]) screen.addEventListener("change", place);
  return place;
}

function holds() {
  if (LOW.matches) return LOW_HOLDS;
  return NARROW.matches ? NARROW_HOLDS : HOLDS;
}
