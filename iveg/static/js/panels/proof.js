/**
 * Proving anew who one is, where the server asks for it before a release.
 *
 * The hold of the release button is over by then, so that nothing moves under a finger;
 * the button is held anew afterwards.
 */

import { readApi, sendApi } from "../core/api.js";
import { askPasskey, hasPasskeys } from "../core/passkeys.js";
import { need, setHidden, setText } from "./dom.js";

const PATH = "account/proof";

/** Whether an answer asks for a proof. @param {import("../core/api.js").Answer} answer */
export const asksForProof = ({ status, body }) =>
  status === 403 && body?.type === "urn:iveg:proof-needed";

/**
 * Key of what is said of an answer; null where it was proven.
 *
 * @param {number} status 0: no answer
 */
export function saidOfProof(status) {
  if (status === 204) return null;
  if (status === 429) return "proof.wait";
  return status === 403 || status === 422 ? "proof.wrong" : "proof.failed";
}

/**
 * Opens the panel that takes a proof; `done` is called once there was one.
 *
 * @param {Pick<import("../main.js").App, "i18n" | "dialogs">} app
 * @param {HTMLElement} opener where the focus goes back to
 * @param {() => void} done
 */
export async function askProof({ i18n, dialogs }, opener, done) {
  const panel = /** @type {HTMLDialogElement} */ (need("#proof-panel"));
  const form = /** @type {HTMLFormElement} */ (need("#proof-form"));
  const field = /** @type {HTMLInputElement} */ (need("#proof-password"));
  const pinForm = /** @type {HTMLFormElement} */ (need("#proof-pin-form"));
  const pin = /** @type {HTMLInputElement} */ (need("#proof-pin"));
  const passkey = /** @type {HTMLButtonElement} */ (need("#proof-passkey"));
  const provider = /** @type {HTMLAnchorElement} */ (need("#proof-sso"));
  const note = need("#proof-note");
  const { body } = await readApi(PATH);
  const ways = new Set(body?.ways ?? []);

  /** @param {object} proof */
  async function give(proof) {
    setText(note, "");
    const { status } = await sendApi("POST", PATH, proof);
    field.value = pin.value = "";
    const said = saidOfProof(status);
    if (said !== null) return setText(note, i18n.t(said));
    dialogs.close();
    return done();
  }

  async function byPasskey() {
    const answer = await askPasskey(`${PATH}/options`);
    if (answer.status === 200) give({ passkey: answer.body });
    else setText(note, i18n.t("proof.keyless"));
  }

  form.onsubmit = (event) => {
    event.preventDefault();
    give({ password: field.value });
  };
  pinForm.onsubmit = (event) => {
    event.preventDefault();
    give({ pin: pin.value });
  };
  passkey.onclick = byPasskey;
  setHidden(pinForm, !ways.has("pin"));
  setHidden(form, !ways.has("password"));
  setHidden(passkey, !ways.has("passkey") || !hasPasskeys());
  provider.href = `/signin/sso?anew=1&to=${encodeURIComponent(location.pathname)}`;
  setHidden(provider, !ways.has("sso"));
  setText(note, "");
  dialogs.open(panel, opener);
  (form.hidden ? pin : field).focus();
}
