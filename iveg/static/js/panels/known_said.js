/**
 * What a mark "known to lasers" is, said under the map once somebody has tapped it.
 *
 * @typedef {import("../types.js").KnownSpot} KnownSpot
 */

import { idOfKnown } from "../map/layers/pick.js";
import { need, setHidden, setText } from "./dom.js";

/** Long enough to be read twice (ms). */
const SHOWN_MS = 12_000;

/**
 * @param {Pick<import("../main.js").App, "store" | "i18n">} app
 * @returns {(id: string | null) => void} says it of a place, or nothing any more
 */
export function createKnownSaid({ store, i18n }) {
  const place = need("#known-said");
  /** @type {string | null} */
  let shown = null;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;

  function draw() {
    /** @type {KnownSpot[]} */
    const spots = store.get("known-here")?.items ?? [];
    const spot = spots.find((one) => idOfKnown(one) === shown);
    // What is known no more must not be called so.
    setHidden(place, !spot);
    setText(place, spot ? saidOf(spot, i18n) : "");
  }

  /** @param {string | null} id */
  function say(id) {
    clearTimeout(timer);
    shown = id;
    if (id !== null) timer = setTimeout(say, SHOWN_MS, null);
    draw();
  }

  store.subscribe("known-here", draw);
  i18n.onChange(draw);
  return say;
}

/** @param {KnownSpot} spot @param {import("../core/i18n.js").I18n} i18n */
function saidOf({ since, thing_id }, i18n) {
  const key = thing_id === null ? "map.known_learnt" : "map.known_marked";
  return i18n.t(key, { since: i18n.time(since).slice(0, 5) });
}
