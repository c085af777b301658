/**
 * A robot's goal: where an operator sends it, and what the robot says of that.
 *
 * Never by a plain tap: the card's menu asks for a place first, and the next tap on the
 * map is that place.  What the robot says is told, never what was wished.
 */

import { sendApi } from "../core/api.js";
import { laneName } from "../core/lanes.js";
import { all, make, needPart, setDisabled, setHidden, setText } from "./dom.js";
import { whyNotAtAll } from "./release.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/i18n.js").I18n} I18n */
/** @typedef {import("../core/protocol.js").Robot} Robot */
/** @typedef {import("./release.js").Facts} Facts */
/** @typedef {{kind: "here", x: number, y: number} | {kind: "aisle", aisle: string}
 *   | {kind: "return" | "pause"}} Wish */

const OPEN = new Set(["SENT", "DRIVING", "UNCONFIRMED", "CANCELLING", "REACHED"]);

/**
 * @param {App} app
 * @param {HTMLElement} card
 * @param {string} robotId
 */
export function createGoal({ i18n, store, dialogs }, card, robotId) {
  const panel = /** @type {HTMLDialogElement} */ (needPart("panel", card));
  const buttons = /** @type {HTMLButtonElement[]} */ (all("[data-goal]", card));
  const aisle = /** @type {HTMLSelectElement} */ (needPart("goal-aisle", card));
  let isBusy = false;
  let result = "";

  function drawAisles() {
    const labels = store.map()?.lanes.map(({ label }) => label) ?? [];
    const said = labels.map((label) => laneName(label, i18n.t));
    if (String(said) === String([...aisle.options].map(({ text }) => text))) return;
    const chosen = aisle.value;
    aisle.replaceChildren(...labels.map((label, i) => optionOf(label, said[i])));
    if (labels.includes(chosen)) aisle.value = chosen;
  }

  /** @param {Facts} facts */
  function draw(facts) {
    if (!panel.open) {
      result = "";
      return;
    }
    drawAisles();
    const why = isBusy ? "busy" : whyNotGoal(facts);
    setText(needPart("goal-state", card), goalSaid(facts.robot, i18n));
    setText(needPart("goal-why", card), i18n.t(`goal.why.${why}`));
    setText(needPart("goal-result", card), result);
    for (const button of buttons) {
      const isCancel = button.dataset.goal === "cancel";
      const may = isCancel ? mayCancel(facts) && !isBusy : why === "ok";
      const lacksAisle = button.dataset.goal === "aisle" && !aisle.value;
      setDisabled(button, !may || lacksAisle);
      setHidden(button, isCancel && !OPEN.has(facts.robot?.goal?.state ?? ""));
    }
  }

  /** @param {string} wanted */
  async function press(wanted) {
    if (wanted === "here") {
      dialogs.close();
      const asked = new CustomEvent("iveg:goal", { detail: robotId });
      document.dispatchEvent(asked);
      return;
    }
    isBusy = true;
    result = await sendGoal(robotId, wishOf(wanted, aisle.value), i18n);
    isBusy = false;
  }

  for (const button of buttons) {
    button.addEventListener("click", () => press(String(button.dataset.goal)));
  }
  return { draw };
}

/** @param {string} label @param {string} said */
function optionOf(label, said) {
  const option = make("option", "", said);
  option.value = label;
  return option;
}

/** What a button of the menu asks for; null takes the goal back.
 * @param {string} wanted @param {string} aisle @returns {Wish | null} */
export function wishOf(wanted, aisle) {
  if (wanted === "cancel") return null;
  if (wanted === "aisle") return { kind: "aisle", aisle };
  return { kind: wanted === "return" ? "return" : "pause" };
}

/**
 * Sends a robot somewhere, once.
 *
 * @param {string} robotId
 * @param {Wish | null} wish null takes its goal back
 * @param {I18n} i18n
 * @returns {Promise<string>} what came of it, in words
 */
export async function sendGoal(robotId, wish, i18n) {
  const path = `robots/${encodeURIComponent(robotId)}/goal`;
  const { status, body } = await sendApi(wish ? "POST" : "DELETE", path, wish ?? {});
  if (status === 202) return i18n.t("goal.sent", { robot: robotId });
  const known = `goal.refused.${body?.why ?? status}`;
  const why = i18n.t(i18n.has(known) ? known : "goal.refused.other", { status });
  return i18n.t("goal.not_sent", { robot: robotId, reason: why });
}

/**
 * How it stands with a robot's newest goal.
 *
 * @param {Robot | undefined} robot
 * @param {I18n} i18n
 */
export function goalSaid(robot, i18n) {
  const goal = robot?.goal;
  if (!goal) return i18n.t("goal.none");
  const { state, by, why, x, y } = goal;
  const isForgotten = state === "DELETED" && goal.forgotten_at !== null;
  const key = isForgotten ? "goal.state.FORGOTTEN" : `goal.state.${state}`;
  const place = i18n.t(`goal.kind.${goal.kind}`, { x, y, aisle: goal.aisle });
  return i18n.t(key, { place, by, why });
}

/** Key of the reason why no goal can be given now, or `ok`. @param {Facts} facts */
export function whyNotGoal(facts) {
  const common = whyNotAtAll(facts);
  if (common) return common;
  const { robot, command } = facts;
  if (!robot) return "not_fresh";
  if (robot.replay) return "recording";
  return command || robot.holds.length || robot.applied?.reason === "hold"
    ? "held"
    : "ok";
}

/** A goal may be taken back from a robot that nobody hears. @param {Facts} facts */
const mayCancel = (facts) => [null, "not_fresh"].includes(whyNotAtAll(facts));
