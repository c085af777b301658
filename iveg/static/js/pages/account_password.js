/**
 * Section of the Account page: a new password.  This session ends with all others and
 * begins anew, so the page is loaded again and then says that it was done.
 */

import { sendApi } from "../core/api.js";
import { need, setText } from "../panels/dom.js";

const DONE = "#password-changed";
/** @type {Record<number, string>} */
const REFUSED = {
  403: "accountpage.password.wrong",
  422: "accountpage.password.short",
  429: "signin.wait",
  0: "rows.offline",
};

/** @param {import("../core/page.js").Page} page */
export function startPassword({ i18n }) {
  const old = /** @type {HTMLInputElement} */ (need("#password-old"));
  const chosen = /** @type {HTMLInputElement} */ (need("#password-new"));
  const note = need("#password-note");
  if (location.hash === DONE) {
    history.replaceState(null, "", location.pathname);
    setText(note, i18n.t("accountpage.password.changed"));
  }
  need("#password-form").addEventListener("submit", async (event) => {
    event.preventDefault();
    const body = { old: old.value, new: chosen.value };
    const { status } = await sendApi("PUT", "account/password", body);
    if (status === 204) {
      location.hash = DONE;
      return location.reload();
    }
    const least = chosen.minLength;
    setText(note, i18n.t(REFUSED[status] ?? "rows.failed", { status, least }));
    return old.select();
  });
}
