/**
 * Sign-out: ends the session on the server, then shows the sign-in page.
 */

import { need, setText } from "./dom.js";

/** @param {import("../main.js").App} app */
export function createSignOut({ i18n }) {
  const button = /** @type {HTMLButtonElement} */ (need("#sign-out"));
  button.addEventListener("click", async () => {
    if (await signOut()) location.assign("/signin");
    else setText(need("#sign-out-note"), i18n.t("signout.failed"));
  });
  button.disabled = false;
}

/** Whether the session has ended on the server. */
async function signOut() {
  try {
    // The answer redirects to a page that needs a session.
    const answer = await fetch("/signout", {
      method: "POST",
      headers: { "X-IVEG": "1" },
      redirect: "manual",
    });
    return answer.type === "opaqueredirect" || answer.status === 401;
  } catch {
    return false;
  }
}
