/**
 * iVeg as an installed app: registers the offline sentence, and keeps the browser's offer
 * to install until somebody asks for it.  Both take HTTPS or the computer itself.
 *
 * @typedef {Event & {prompt: () => Promise<unknown>}} Offer
 * @typedef {"ready" | "installed" | "none" | "insecure"} InstallState
 */

import { scriptUrl } from "./scripturl.js";

const WORKER = "/sw.js";

/** Keeps what a browser tells of installing; one for the life of a page. */
export function createInstalling() {
  /** @type {Offer | null} */
  let offer = null;
  /** @type {Set<() => void>} */
  const listeners = new Set();
  const tell = () => {
    for (const fn of listeners) fn();
  };
  addEventListener("beforeinstallprompt", (event) => {
    event.preventDefault();
    offer = /** @type {Offer} */ (event);
    tell();
  });
  addEventListener("appinstalled", () => {
    offer = null;
    tell();
  });
  return {
    /** @returns {InstallState} */
    state() {
      if (!isSecureContext) return "insecure";
      if (matchMedia("(display-mode: standalone)").matches) return "installed";
      return offer ? "ready" : "none";
    },
    async install() {
      await offer?.prompt();
      offer = null;
      tell();
    },
    /** @param {() => void} fn */
    onChange(fn) {
      listeners.add(fn);
    },
  };
}

/** Registers the worker; without one a page is as it always was. */
export async function registerWorker() {
  if (!isSecureContext || !navigator.serviceWorker) return;
  try {
    await navigator.serviceWorker.register(scriptUrl(WORKER));
  } catch {
    // The offline sentence is a comfort, and its lack no fault of this page.
  }
}
