/**
 * iVeg as an installed app: registers the offline page, and keeps the browser's offer to
 * install until a person asks for it.  Both need HTTPS or localhost.
 *
 * @typedef {Event & {prompt: () => Promise<unknown>}} Offer
 * @typedef {"ready" | "installed" | "none" | "insecure"} InstallState
 */

const WORKER = "/sw.js";

/** The browser's events about installing; one object for the life of a page. */
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

/** Registers the service worker; a page works the same without it. */
export async function registerWorker() {
  if (!isSecureContext || !navigator.serviceWorker) return;
  try {
    await navigator.serviceWorker.register(scriptUrl(WORKER));
  } catch {
    // The offline page is a comfort; its failure is no fault of this page.
  }
}

/**
 * The address of a worker, as browsers that check script addresses want it (Trusted
 * Types).
 *
 * @param {string} path of a script of ours
 * @returns {string}
 */
function scriptUrl(path) {
  const types = /** @type {any} */ (globalThis).trustedTypes;
  if (!types) return path;
  const only = { createScriptURL: (/** @type {string} */ url) => url };
  return types.createPolicy("iveg-worker", only).createScriptURL(path);
}
