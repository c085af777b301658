/**
 * Who is signed in where: everybody for admins, and on the Account page one's own.
 */

import { sendApi } from "../core/api.js";
import { make, need, setText } from "../panels/dom.js";
import { createAges, keepFresh } from "./ages.js";
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
  const aged = createAges(page);
  const rows = createRows({ name: "sessions", path, i18n, cells });
  const label = (/** @type {string} */ key, slots = {}) =>
    i18n.t(`sessionspage.${key}`, slots);

  /** @param {Session} session */
  function cells(session) {
    const { session_id, name, role, kind, began_at, seen_at, own } = session;
    const change = make("td", "", own ? label("own") : "");
    const end = () => finish(`${path}/${session_id}`, "ended", { name });
    if (!own) change.append(makeTwice(label("end"), label("end_sure", { name }), end));
    return [
      make("td", "", i18n.t("rows.by", { by: name })),
      make("td", "", i18n.t(`header.role.${role}`)),
      make("td", "", label(`kind.${kind}`)),
      make("td", "time named", dayAndTime(began_at)),
      aged(seen_at),
      change,
    ];
  }

  /** @param {string} address @param {string} key @param {{name?: string}} slots */
  async function finish(address, key, slots) {
    const { status, body } = await sendApi("DELETE", address, {});
    rows.load();
    const failed = i18n.t(status ? "rows.failed" : "rows.offline", { status });
    const done = label(key, { ...slots, count: body?.ended ?? 1 });
    setText(need("#sessions-note"), status === 200 ? done : failed);
  }

  function drawOthers() {
    const end = () => finish(path, "others_ended", {});
    const others = makeTwice(label("others"), label("others_sure"), end);
    need("#sessions-others").replaceChildren(others);
  }
  i18n.onChange(drawOthers);
  drawOthers();
  keepFresh("sessions", rows.load);
  rows.load();
}
