/**
 * Who is signed in where: everybody for admins, and on the Account page one's own.
 */

import { sendApi } from "../core/api.js";
import { make, need, setText } from "../panels/dom.js";
import { keepFresh } from "./ages.js";
import { dayAndTime } from "./history/local_time.js";
import { createRows } from "./rows.js";
import { makeTwice } from "./twice.js";

/** @typedef {import("../core/page.js").Page} Page */
/** @typedef {import("../types").OpenSession} Session */

/** @param {Page} page */
export const start = (page) => createSessions(page, "sessions");

/** @param {Page} page */
export const startOwnSessions = (page) => createSessions(page, "account/sessions");

/** @param {Page} page @param {string} path below `/api/v1/` */
function createSessions(page, path) {
  const { i18n } = page;
  const rows = createRows({ name: "sessions", path, i18n, cells });
  const label = (/** @type {string} */ key, slots = {}) =>
    i18n.t(`sessionspage.${key}`, slots);

  /** @param {Session} session */
  function cells(session) {
    const { session_id, name, role, kind, began_at, own } = session;
    const change = make("td", "", own ? label("own") : "");
    const end = () => finish(session_id, name);
    if (!own) change.append(makeTwice(label("end"), label("end_sure", { name }), end));
    return [
      make("td", "", i18n.t("rows.by", { by: name })),
      make("td", "", i18n.t(`header.role.${role}`)),
      make("td", "", label(`kind.${kind}`)),
      make("td", "time named", dayAndTime(began_at)),
      change,
    ];
  }

  /** @param {string} sessionId @param {string} name of the person */
  async function finish(sessionId, name) {
    const { status } = await sendApi("DELETE", `${path}/${sessionId}`, {});
    rows.load();
    const failed = i18n.t(status ? "rows.failed" : "rows.offline", { status });
    const done = label("ended", { name });
    setText(need("#sessions-note"), status === 200 ? done : failed);
  }
  keepFresh("sessions", rows.load);
  rows.load();
}
