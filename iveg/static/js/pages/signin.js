/**
 * The sign-in page: it posts the token or invitation behind the `#` of the link, which no
 * server sees by itself, and takes it off the address; or a name and its password.
 */

import { sendApi } from "../core/api.js";
import { need, setHidden } from "../panels/dom.js";

/** @typedef {"link" | "password" | "invitation"} Way */

/** @type {Record<Way, string>} what a refusal means */
const WRONG = {
  link: "#signin-wrong",
  password: "#signin-refused",
  invitation: "#signin-uninvited",
};
const WAIT = "#signin-wait";
const FAILED = "#signin-failed";

/**
 * The token or invitation of a link; null without one.
 *
 * @param {string} part of its address, with the `#` or `?`
 */
export function tokenIn(part, name = "token") {
  return new URLSearchParams(part.slice(1)).get(name);
}

/**
 * The notice for an answer of the server; null where somebody is signed in.
 *
 * @param {number} status 0: no answer
 * @param {Way} [way]
 */
export function noticeFor(status, way = "link") {
  if (status === 204) return null;
  if (status === 401 || status === 422) return WRONG[way];
  return status === 429 ? WAIT : FAILED;
}

/** @param {Record<string, unknown>} proof @param {Way} way */
async function post(proof, way) {
  const { status } = await sendApi("POST", "/signin", proof);
  const notice = noticeFor(status, way);
  if (notice === null) location.replace("/");
  else show(notice);
}

/** @param {string} notice */
function show(notice) {
  for (const one of [...Object.values(WRONG), WAIT, FAILED]) {
    setHidden(need(one), one !== notice);
  }
}

function followLink() {
  // Links of earlier versions carry it in the query.
  const token = tokenIn(location.hash) ?? tokenIn(location.search);
  const invitation = tokenIn(location.hash, "invitation");
  if (token === null && invitation === null) return;
  history.replaceState(null, "", location.pathname);
  if (token !== null) post({ token }, "link");
  else invite(String(invitation));
}

/** @param {string} invitation */
function invite(invitation) {
  const field = fieldOf("#invited-password");
  setHidden(need("#signin-form"), true);
  setHidden(need("#invited-form"), false);
  need("#invited-form").onsubmit = (event) => {
    event.preventDefault();
    post({ invitation, password: field.value }, "invitation");
  };
  field.focus();
}

/** @param {string} selector */
const fieldOf = (selector) => /** @type {HTMLInputElement} */ (need(selector));

if (document.body.dataset.route === "signin") {
  // A link that is opened while this page is shown only changes what is behind `#`.
  addEventListener("hashchange", followLink);
  need("#signin-form").addEventListener("submit", (event) => {
    event.preventDefault();
    const name = fieldOf("#signin-name").value;
    post({ name, password: fieldOf("#signin-password").value }, "password");
  });
  followLink();
}
