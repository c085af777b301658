/**
 * Keeps the screen on while a person supervises: a dark screen warns nobody.
 *
 * The browser releases the lock whenever the page is hidden; it is requested again when
 * the page comes back.  Browsers grant it over HTTPS and on localhost alone.
 *
 * @typedef {ReturnType<typeof createWakeLock>} WakeLock
 * @typedef {{released: boolean, release: () => Promise<void>}} Sentinel
 * @typedef {{request: (type: "screen") => Promise<Sentinel>}} Locker
 */

import { browserStorage } from "../map/layers/memory.js";

const KEY = "iveg.wake";

/**
 * @param {{locker?: Locker | null, page?: Document, storage?: Storage | null}} [options]
 *   tests pass their own
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
      // A nearly empty battery refuses; the request is repeated when the page comes back.
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
    /** To be called by a page for supervision. */
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
        // A full or forbidden storage costs the memory of a switch, never the switch.
      }
      return settle();
    },
  };
}

/** @returns {Locker | null} */
function browserLocker() {
  return "wakeLock" in navigator ? navigator.wakeLock : null;
}
