/**
 * What lets somebody in, shown once after it was made: as text, and a link as a QR code.
 */

import { need, setHidden, setText } from "../panels/dom.js";

/** @param {import("../core/i18n.js").I18n} i18n */
export function createShownOnce(i18n) {
  const box = need("#once");
  const image = /** @type {HTMLImageElement} */ (need("#once-image"));
  const text = need("#once-text");

  /** @param {string} key @param {Record<string, string | number>} [slots] */
  function say(key, slots) {
    setText(need("#once-note"), i18n.t(key, slots));
  }

  function hide() {
    setHidden(box, true);
    setText(text, "");
    setText(need("#once-note"), "");
    image.removeAttribute("src");
  }

  /** @param {string} secret @param {string} [picture] data address of its QR code */
  function show(secret, picture) {
    setHidden(image, !picture);
    if (picture) image.src = picture;
    setText(text, secret);
    setHidden(box, false);
    text.focus();
  }

  /** Says why nothing was made. @param {import("../core/api.js").Answer} answer */
  function refuse({ status, body }) {
    hide();
    const why = REFUSED[String(body?.type ?? "").replace("urn:iveg:", "")];
    say(why ?? (status ? "rows.failed" : "rows.offline"), { status });
  }

  need("#once-hide").addEventListener("click", hide);
  return { say, show, hide, refuse };
}

/** @type {Record<string, string>} code of a problem → what is said of it */
const REFUSED = { "name-taken": "once.taken", invalid: "once.invalid" };
