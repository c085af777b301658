/**
 * Section of the Account page: the PIN by which one unlocks a shared tablet.
 */

import { readApi, sendApi } from "../core/api.js";
import { need, setHidden, setText } from "../panels/dom.js";
import { askProof, asksForProof } from "../panels/proof.js";

/** @param {import("../core/page.js").Page} page */
export function startPin(page) {
  const { i18n } = page;
  const field = /** @type {HTMLInputElement} */ (need("#pin-new"));
  const note = need("#pin-note");

  async function load() {
    const { body } = await readApi("account/proof");
    setHidden(need("#pin-remove"), !body?.ways?.includes("pin"));
  }

  async function save() {
    const answer = await sendApi("PUT", "account/pin", { pin: field.value });
    if (asksForProof(answer)) return askProof(page, field, save);
    return tell(answer.status, "accountpage.pin.saved");
  }

  async function remove() {
    const { status } = await sendApi("DELETE", "account/pin", {});
    tell(status, "accountpage.pin.removed");
  }

  /** @param {number} status @param {string} done */
  function tell(status, done) {
    const failed = status === 422 ? "accountpage.pin.easy" : "rows.failed";
    const key = status === 204 ? done : status ? failed : "rows.offline";
    if (status === 204) field.value = "";
    setText(note, i18n.t(key, { status }));
    load();
  }

  need("#pin-form").addEventListener("submit", (event) => {
    event.preventDefault();
    save();
  });
  need("#pin-remove").addEventListener("click", remove);
  load();
}
