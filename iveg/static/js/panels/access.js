/**
 * Whether a robot is heard: an admin revokes it (STOP first) and allows it again.
 */

import { sendApi } from "../core/api.js";
import { dayAndTime } from "../pages/history/local_time.js";
import { need, needPart, setDisabled, setHidden, setText } from "./dom.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/i18n.js").I18n} I18n */
/** @typedef {import("../core/protocol.js").Robot} Robot */
/** @typedef {import("../types.js").RobotAccess} RobotAccess */

/**
 * @param {App} app
 * @param {HTMLElement} card
 * @param {string} robotId
 */
export function createAccess({ i18n }, card, robotId) {
  const button = /** @type {HTMLButtonElement} */ (need("[data-access]", card));
  const panel = /** @type {HTMLDialogElement} */ (needPart("panel", card));
  let isRevoked = false;
  let isBusy = false;
  let said = "";

  /** @param {Robot | undefined} robot */
  function draw(robot) {
    isRevoked = Boolean(robot?.revoked);
    setHidden(needPart("revoked", card), !isRevoked);
    if (!panel.open) {
      said = "";
      return;
    }
    const isAdmin = document.body.dataset.role === "admin";
    setHidden(needPart("access", card), !isAdmin && !isRevoked);
    setDisabled(button, isBusy || !isAdmin);
    const key = isRevoked ? "access.allow" : "access.revoke";
    setText(needPart("access-label", card), i18n.t(key, { robot: robotId }));
    setText(needPart("access-state", card), accessSaid(robot, i18n));
    setText(needPart("access-result", card), said);
  }

  button.addEventListener("click", async () => {
    isBusy = true;
    button.disabled = true;
    const what = isRevoked ? "allow" : "revoke";
    const path = `robots/${encodeURIComponent(robotId)}/${what}`;
    const { status, body } = await sendApi("POST", path, {});
    isBusy = false;
    said = resultSaid(status, body, i18n);
  });
  return { draw };
}

/**
 * Whether a robot is heard, and by whose word it is not.
 *
 * @param {Robot | undefined} robot
 * @param {I18n} i18n
 */
export function accessSaid(robot, i18n) {
  const revoked = robot?.revoked;
  if (!revoked) return i18n.t("access.state.heard");
  const key = revoked.stood ? "access.state.stood" : "access.state.unconfirmed";
  return i18n.t(key, { at: dayAndTime(revoked.since), by: revoked.by });
}

/**
 * @param {number} status
 * @param {unknown} body
 * @param {I18n} i18n
 */
function resultSaid(status, body, i18n) {
  if (status === 200) {
    const { broker } = /** @type {RobotAccess} */ (body);
    return i18n.t(`access.broker.${broker}`);
  }
  const known = `access.refused.${status}`;
  const key = i18n.has(known) ? known : "access.refused.other";
  return i18n.t(key, { status });
}
