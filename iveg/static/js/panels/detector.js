/**
 * A robot's camera in service or out of it: the operator's word that nobody waits for
 * its pictures.
 */

import { sendApi } from "../core/api.js";
import { dayAndTime } from "../pages/history/local_time.js";
import { need, needPart, setDisabled, setHidden, setText } from "./dom.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/i18n.js").I18n} I18n */
/** @typedef {import("../core/protocol.js").Robot} Robot */

const OPERATORS = new Set(["operator", "admin"]);

/**
 * @param {App} app
 * @param {HTMLElement} card
 * @param {string} robotId
 */
export function createDetector({ i18n }, card, robotId) {
  const button = /** @type {HTMLButtonElement} */ (need("[data-detector]", card));
  const reason = /** @type {HTMLInputElement} */ (needPart("detector-reason", card));
  const panel = /** @type {HTMLDialogElement} */ (needPart("panel", card));
  let isOut = false;
  let isBusy = false;
  let refused = 0;

  /** @param {Robot | undefined} robot */
  function draw(robot) {
    if (!panel.open) {
      refused = 0;
      return;
    }
    isOut = Boolean(robot?.detector?.out_by);
    const isAsked = isOut || robot?.detector?.required === true;
    const may = OPERATORS.has(document.body.dataset.role ?? "");
    setHidden(button, !isAsked);
    setHidden(reason, !isAsked || isOut || !may);
    setDisabled(button, isBusy || !may || !isAnswered());
    reason.placeholder = i18n.t("detector.reason");
    reason.setAttribute("aria-label", i18n.t("detector.reason"));
    const key = isOut ? "detector.put_back" : "detector.take_out";
    setText(needPart("detector-label", card), i18n.t(key, { robot: robotId }));
    setText(needPart("detector-state", card), detectorSaid(robot, i18n));
    setText(needPart("detector-result", card), refusalSaid());
  }

  /** Whether the reason is told, without which no camera is taken out of service. */
  const isAnswered = () => isOut || reason.value.trim() !== "";

  function refusalSaid() {
    if (!refused) return "";
    const known = `detector.refused.${refused}`;
    const key = i18n.has(known) ? known : "detector.refused.other";
    return i18n.t(key, { status: refused });
  }

  reason.addEventListener("input", () => {
    const may = OPERATORS.has(document.body.dataset.role ?? "");
    setDisabled(button, isBusy || !may || !isAnswered());
  });
  button.addEventListener("click", async () => {
    isBusy = true;
    button.disabled = true;
    const path = `robots/${encodeURIComponent(robotId)}/detector`;
    const body = isOut
      ? { in_service: true }
      : { in_service: false, reason: reason.value };
    const { status } = await sendApi("PUT", path, body);
    isBusy = false;
    if (status === 200) reason.value = "";
    refused = status === 200 ? 0 : status;
  });
  return { draw };
}

/**
 * Whether the pictures of a robot are read.
 *
 * @param {Robot | undefined} robot
 * @param {I18n} i18n
 */
export function detectorSaid(robot, i18n) {
  const detector = robot?.detector;
  if (!detector) return "";
  if (detector.out_by) {
    const at = dayAndTime(detector.out_since ?? "");
    const { out_by: by, out_reason: why } = detector;
    return i18n.t("detector.state.out", { at, by, reason: why ?? "" });
  }
  if (!detector.required) return i18n.t("detector.state.none");
  return i18n.t(`detector.state.${detector.missing ? "missing" : "works"}`);
}
