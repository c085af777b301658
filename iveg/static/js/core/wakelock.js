/**
 * Keeps the screen on while somebody supervises: a dark screen warns nobody.
 *
 * The browser lets go whenever the page is hidden; it is asked again when the page comes
 * back.  Browsers grant it to HTTPS and to the computer itself alone.
 *
 * @typedef {ReturnType<typeof createWakeLock>} WakeLock
 * @typedef {{released: boolean, release: () => Promise<void>}} Sentinel
 * @typedef {{request: (type: "screen") => Promise<Sentinel>}} Locker
 */

import { browserStorage } from "../map/layers/memory.js";

const KEY = "iveg.wake";

/**
 * @param {{locker?: Locker | null, page?: Document, storage?: Storage | null}} [options]
 *   tests hand in their own
 */
export function createWakeLock(options = {}) {
  const { page = document, storage = browserStorage() } = options;
  const locker = options.locker ?? browserLocker();
  let isWanted = storage?.getItem(KEY) !== "off";
  let isSupervising = false;
  /** @type {Sentinel | null} */
  let held = null;

  async function settle() {
    const isDue = isWanted && isSupervising && page.visibilityState === "visible";
    if (!isDue) return letGo();
    if (!locker || (held && !held.released)) return;
    try {
      held = await locker.request("screen");
    } catch {
      // A nearly empty battery refuses; the page is asked again when it comes back.
      held = null;
    }
  }

  async function letGo() {
    const had = held;
    held = null;
    if (had && !had.released) await had.release();
  }

  page.addEventListener("visibilitychange", settle);

  return {
    isPossible: () => locker !== null,
    isWanted: () => isWanted,
    isHeld: () => held !== null && !held.released,
    /** This page is one that somebody watches. */
    supervise() {
      isSupervising = true;
      return settle();
    },
    /** @param {boolean} wanted */
    setWanted(wanted) {
      isWanted = wanted;
      try {
        storage?.setItem(KEY, wanted ? "on" : "off");
      } catch {
        // A full or forbidden store costs the memory of a switch, never the switch.
      }
      return settle();
    },
  };
}

/** @returns {Locker | null} */
function browserLocker() {
  return "wakeLock" in navigator ? navigator.wakeLock : null;
}
