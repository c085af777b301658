/**
 * Passkeys of this device: the browser's part of WebAuthn.
 *
 * @typedef {import("./api.js").Answer} Answer
 */

import { readApi } from "./api.js";

/** Whether this browser makes them here: not at an address without TLS. */
export const hasPasskeys = () =>
  typeof globalThis.PublicKeyCredential?.parseRequestOptionsFromJSON === "function";

/**
 * Has the device say who is there; `body` is its answer as JSON, `status` 0 where it or
 * the person gave none.
 *
 * @param {string} path of the options
 * @returns {Promise<Answer>}
 */
export function askPasskey(path) {
  return asked(path, (options) =>
    navigator.credentials.get({
      publicKey: PublicKeyCredential.parseRequestOptionsFromJSON(options),
    }),
  );
}

/** Has the device make one. @param {string} path @returns {Promise<Answer>} */
export function makePasskey(path) {
  return asked(path, (options) =>
    navigator.credentials.create({
      publicKey: PublicKeyCredential.parseCreationOptionsFromJSON(options),
    }),
  );
}

/** @param {string} path @param {(options: any) => Promise<Credential | null>} ask */
async function asked(path, ask) {
  const begun = await readApi(path);
  if (begun.status !== 200) return begun;
  try {
    const found = /** @type {PublicKeyCredential | null} */ (await ask(begun.body));
    return { status: found ? 200 : 0, body: found?.toJSON() ?? null };
  } catch {
    // Cancelled, timed out, or nothing on this device that fits.
    return { status: 0, body: null };
  }
}
