/**
 * The address of a record, to copy: at the end of it, and on paper.
 */

import { make } from "./dom.js";

/**
 * @param {string} path from the root
 * @param {string} said the text of the link
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function makeShare(path, said, i18n) {
  const line = make("p", "record__link");
  const link = make("a", "", said);
  // In full: on paper an address without its server leads nowhere.
  link.setAttribute("href", new URL(path, location.href).href);
  const copy = make("button", "button no-print", i18n.t("record.copy"));
  copy.type = "button";
  // The clipboard needs HTTPS or localhost; the link can be copied by hand.
  copy.hidden = !navigator.clipboard;
  copy.addEventListener("click", async () => {
    await navigator.clipboard.writeText(link.href);
    copy.textContent = i18n.t("record.copied");
  });
  line.append(link, copy);
  return line;
}
