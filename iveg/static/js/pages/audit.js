/**
 * The Audit page: who did what.
 */

import { make } from "../panels/dom.js";
import { dayAndTime } from "./history/local_time.js";
import { createChips, createRows } from "./rows.js";

/** @typedef {import("../core/i18n.js").I18n} I18n */

/** @type {Record<string, string>} the group of an action; all others are settings */
const GROUPS = {
  sign_in: "signing",
  sign_in_refused: "signing",
  sign_out: "signing",
  wall: "signing",
  account_added: "signing",
  accounts_damaged: "signing",
  account_role: "signing",
  account_reset: "signing",
  account_disabled: "signing",
  password_changed: "signing",
  session_ended: "signing",
  sessions_ended: "signing",
  token_added: "signing",
  token_revoked: "signing",
  stop: "orders",
  release: "orders",
  resume: "orders",
  goal: "orders",
  cancel_goal: "orders",
  acknowledge: "alerts",
  mark_thing: "alerts",
  unmark_thing: "alerts",
  note: "data",
  export: "data",
  deleted: "data",
  unplaced: "data",
};

/** @param {string} action */
export const groupOf = (action) => GROUPS[action] ?? "settings";

/** @param {import("../core/page.js").Page} page */
export function start({ i18n }) {
  const isChosen = createChips("data-audit-chip", () => rows.draw());
  const rows = createRows({
    name: "audit",
    path: "audit",
    i18n,
    cells: (entry) => cellsOf(entry, i18n),
    admits: ({ action }) => isChosen(groupOf(action)),
  });
  rows.load();
}

/** @param {any} entry of the API @param {I18n} i18n */
function cellsOf(entry, i18n) {
  const { at, name, role, action, subject, details } = entry;
  return [
    make("td", "time", dayAndTime(at)),
    make(
      "td",
      "",
      name ? i18n.t("rows.by", { by: name }) : i18n.t("auditpage.stranger", { role }),
    ),
    make("td", "what", worded(`auditpage.action.${action}`, action, i18n)),
    make("td", "", worded(`auditpage.of.${subject}`, subject || "—", i18n)),
    make("td", "what", detailsSaid(details, i18n)),
  ];
}

/** Numbers from here on are moments: Unix seconds. */
const A_MOMENT = 1e9;

/**
 * What a row tells besides: in the reader's words where there are some, without what it
 * does not know.
 *
 * @param {Record<string, unknown>} details @param {I18n} i18n
 */
export function detailsSaid(details, i18n) {
  const known = Object.entries(details).filter(
    ([key, value]) => value !== null && !saysNothing(key, value),
  );
  const parts = known.map(([key, value]) => {
    const name = worded(`auditpage.detail.${key}`, key, i18n);
    return `${name} ${valueSaid(key, value, i18n)}`;
  });
  return parts.join(" · ") || "—";
}

/** Whether it is a status that is well. @param {string} key @param {unknown} value */
const saysNothing = (key, value) => key === "status" && Number(value) < 400;

/** @param {string} key @param {unknown} value @param {I18n} i18n */
function valueSaid(key, value, i18n) {
  if (typeof value === "number" && value > A_MOMENT)
    return dayAndTime(new Date(value * 1000).toISOString());
  if (key === "role") return worded(`header.role.${value}`, String(value), i18n);
  if (key === "scope") return worded(`tokenspage.scope.${value}`, String(value), i18n);
  return typeof value === "string" ? value : JSON.stringify(value);
}

/** @param {string} key @param {string} otherwise @param {I18n} i18n */
const worded = (key, otherwise, i18n) => (i18n.has(key) ? i18n.t(key) : otherwise);
