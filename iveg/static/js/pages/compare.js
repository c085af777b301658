/**
 * Two ranges side by side, drawn by the server.  Moments are typed as text: the browser's
 * own fields speak the browser's language, not the page's.
 */

import { all, need, setAttribute, setHidden, setText } from "../panels/dom.js";
import * as sheet from "./day.js";
import { canBeUsed } from "./history/asked.js";
import { momentOf, typedText } from "./history/local_time.js";

/** @param {import("../core/page.js").Page} page */
export function start(page) {
  sheet.start(page);
  const line = need("#compare-error");
  need("#compare-asked").addEventListener("submit", (event) => {
    const wrong = wrongIn(need("#compare-asked"));
    setHidden(line, wrong.length === 0);
    if (wrong.length === 0) return;
    event.preventDefault();
    setText(line, page.i18n.t("history.error.range"));
    wrong[0].focus();
  });
}

/** Fields of ranges that cannot be asked for, marked as such. @param {HTMLElement} form */
function wrongIn(form) {
  return all("fieldset", form).flatMap((range) => {
    const fields = /** @type {HTMLInputElement[]} */ (all("input", range));
    const [since, until] = fields.map((field) => momentOf(field.value));
    const isRight = canBeUsed({ since, until });
    for (const field of fields) {
      setAttribute(field, "aria-invalid", String(!isRight));
      if (isRight) field.value = typedText(momentOf(field.value));
    }
    return isRight ? [] : fields;
  });
}
