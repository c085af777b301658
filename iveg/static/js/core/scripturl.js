/**
 * The address of a worker, as browsers that check script addresses want it (Trusted
 * Types).
 *
 * @param {string} path of a script of ours
 * @returns {string}
 */
export function scriptUrl(path) {
  const types = /** @type {any} */ (globalThis).trustedTypes;
  if (!types) return path;
  const only = { createScriptURL: (/** @type {string} */ url) => url };
  return types.createPolicy("iveg-worker", only).createScriptURL(path);
}
