/**
 * The sign-in page: it posts the token behind the `#` of the link, which no server sees
 * by itself, and takes it off the address.
 */

import { sendApi } from "../core/api.js";
import { need, setHidden } from "../panels/dom.js";

/** @type {Record<number, string>} */
const NOTICES = { 401: "#signin-wrong", 422: "#signin-wrong", 429: "#signin-wait" };
const OTHERS = "#signin-failed";

/**
 * The token of a link.
 *
 * @param {string} hash of its address, with the `#`
 */
export function tokenIn(hash) {
  return new URLSearchParams(hash.slice(1)).get("token");
}

/**
 * The notice for an answer of the server; null where somebody is signed in.
 *
 * @param {number} status 0: no answer
 */
export function noticeFor(status) {
  return status === 204 ? null : (NOTICES[status] ?? OTHERS);
}

async function signIn() {
  const token = tokenIn(location.hash);
  if (token === null) return;
  history.replaceState(null, "", location.pathname);
  const { status } = await sendApi("POST", "/signin", { token });
  const notice = noticeFor(status);
  if (notice === null) {
    location.replace("/");
    return;
  }
  for (const one of [...Object.values(NOTICES), OTHERS]) {
    setHidden(need(one), one !== notice);
  }
}

if (document.body.dataset.route === "signin") {
  // A link that is opened while this page is shown only changes what is behind `#`.
  addEventListener("hashchange", signIn);
  signIn();
}
