/**
 * The sign-in link as a QR code, shown for scanning with another device.
 */

import { readApi } from "../core/api.js";
import { need, setHidden, setText } from "../panels/dom.js";

const READERS = new Set(["operator", "admin"]);

/** @param {import("../core/i18n.js").I18n} i18n */
export function createSignInCode(i18n) {
  const may = READERS.has(document.body.dataset.role ?? "");
  const button = need("#code-show");
  const image = /** @type {HTMLImageElement} */ (need("#code-image"));
  let isShown = false;
  let note = may ? "" : i18n.t("code.role");

  function draw() {
    setHidden(button, !may);
    setHidden(need("#code"), !isShown);
    setText(button, i18n.t(isShown ? "code.hide" : "code.show"));
    setText(need("#code-note"), note);
  }

  async function press() {
    isShown = !isShown;
    note = "";
    if (isShown) await show();
    else {
      image.removeAttribute("src");
      setText(need("#code-link"), "");
    }
    draw();
  }

  async function show() {
    const { status, body } = await readApi("sign-in-code");
    isShown = status === 200;
    if (!isShown) {
      note = i18n.t(status ? "code.failed" : "rows.offline", { status });
      return;
    }
    image.src = body.image;
    setText(need("#code-link"), body.link);
    note = body.local ? i18n.t("code.local") : "";
  }

  button.addEventListener("click", press);
  i18n.onChange(draw);
  draw();
}
