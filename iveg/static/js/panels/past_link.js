/** A link to the moments before an event, on the map of then. */

import { BEFORE_S, pastAddress } from "../core/moments.js";
import { make } from "./dom.js";

/**
 * A link to the moments before an event.
 *
 * @param {string} at ISO-8601
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function makePastLink(at, i18n) {
  const said = i18n.t("past.before", { seconds: BEFORE_S });
  const link = make("a", "button past-link", said);
  link.href = pastAddress(Date.parse(at) / 1000 - BEFORE_S);
  return link;
}
