/**
 * The page of one decision: the same record as in the panel, at an address of its own.
 */

import { createRecord } from "../panels/decision.js";
import { need } from "../panels/dom.js";

/** @param {import("../core/page.js").Page} page */
export function start({ i18n }) {
  const asked = String(need("#decision-page").dataset.decision);
  createRecord(need("#decision-record"), i18n).show(asked);
}
