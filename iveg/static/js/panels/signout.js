/**
 * Sign-out: ends the session on the server, then shows the sign-in page.
 */

import { need, setText } from "./dom.js";

/** @param {import("../main.js").App} app */
export function createSignOut({ i18n }) {
  const button = /** @type {HTMLButtonElement} */ (need("#sign-out"));
  button.addEventListener("click", async () => {
    const next = await signOut();
    if (next) location.assign(next);
    else setText(need("#sign-out-note"), i18n.t("signout.failed"));
  });
  button.disabled = false;
}

/** Where to go on, at the identity provider where that is asked to, too; null: failed. */
async function signOut() {
  try {
    // The answer redirects to a page that needs a session.
    const answer = await fetch("/signout", {
      method: "POST",
      headers: { "X-IVEG": "1" },
      redirect: "manual",
    });
    if (answer.status === 200) return String((await answer.json()).next);
    const isOut = answer.type === "opaqueredirect" || answer.status === 401;
    return isOut ? "/signin" : null;
  } catch {
    return null;
  }
}
