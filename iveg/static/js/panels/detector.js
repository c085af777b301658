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
    setDisabled(button, isBusy || !may);
    const key = isOut ? "detector.put_back" : "detector.take_out";
    setText(needPart("detector-label", card), i18n.t(key, { robot: robotId }));
    setText(needPart("detector-state", card), detectorSaid(robot, i18n));
    setText(needPart("detector-result", card), refusalSaid());
  }

  function refusalSaid() {
    if (!refused) return "";
    const known = `detector.refused.${refused}`;
    const key = i18n.has(known) ? known : "detector.refused.other";
    return i18n.t(key, { status: refused });
  }

  button.addEventListener("click", async () => {
    isBusy = true;
    button.disabled = true;
    const path = `robots/${encodeURIComponent(robotId)}/detector`;
    const { status } = await sendApi("PUT", path, { in_service: isOut });
    isBusy = false;
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
    return i18n.t("detector.state.out", { at, by: detector.out_by });
  }
  if (!detector.required) return i18n.t("detector.state.none");
  return i18n.t(`detector.state.${detector.missing ? "missing" : "works"}`);
}
