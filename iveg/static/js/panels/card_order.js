/**
 * The order of the cards: danger first, and never while somebody may be about to press.
 *
 * The cards of a large fleet hold STOP controls, so a card must not come under a finger
 * that was meant for another.
 */

import { LEVELS, rankOf } from "../core/situation.js";

/** An order has to be wanted for so long (ms). */
const LASTS_MS = 1000;
const HOVERS = matchMedia("(hover: hover)");

/**
 * @typedef {{id: string, card: HTMLElement,
 *   situation: import("../core/situation.js").Situation}} Placed
 */

/** @param {HTMLElement} place the list of cards */
export function createCardOrder(place) {
  /** @type {Set<number>} pointers that are down */
  const fingers = new Set();
  let wanted = "";
  let wantedSinceMs = 0;
  listen("pointerdown", ({ pointerId }) => fingers.add(pointerId));
  listen("pointerup", ({ pointerId }) => fingers.delete(pointerId));
  listen("pointercancel", ({ pointerId }) => fingers.delete(pointerId));

  /** Whether somebody presses, points at a card, is in it or has swiped to one.  The
   * list itself has the focus of whoever came by a link to it, and is no card. */
  function isBusy() {
    const focus = document.activeElement;
    return (
      fingers.size > 0 ||
      place.scrollLeft > 0 ||
      (focus !== place && place.contains(focus)) ||
      place.querySelector("dialog[open]") !== null ||
      (HOVERS.matches && place.matches(":hover"))
    );
  }

  /**
   * @param {readonly Placed[]} fleet in the server's order
   * @param {number} [nowMs] `performance.now()` (ms)
   */
  function sort(fleet, nowMs = performance.now()) {
    const order = sorted(fleet);
    const told = order.map(({ id }) => id).join(" ");
    if (told !== wanted) wantedSinceMs = nowMs;
    wanted = told;
    // Whether somebody is busy costs a layout, so it is asked where it matters.
    if (order.every(({ card }, i) => place.children[i] === card)) return;
    if (nowMs - wantedSinceMs < LASTS_MS || isBusy()) return;
    order.forEach(({ card }, i) => {
      if (place.children[i] !== card) place.insertBefore(card, place.children[i]);
    });
    // A row that snaps would go along with the card that was the worst.
    place.scrollLeft = 0;
  }

  return { sort };
}

/** @param {"pointerdown" | "pointerup" | "pointercancel"} name
 * @param {(event: PointerEvent) => void} fn */
const listen = (name, fn) => document.addEventListener(name, fn, { capture: true });

/** Worst first; as bad, in the fleet's order. @param {readonly Placed[]} fleet */
export const sorted = (fleet) =>
  [...fleet].sort(
    ({ situation: a }, { situation: b }) =>
      rankOf(a) - rankOf(b) || LEVELS.indexOf(a.level) - LEVELS.indexOf(b.level),
  );
