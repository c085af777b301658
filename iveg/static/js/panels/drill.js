/**
 * A drill: STOP pressed on a robot that stands or creeps, to prove that STOP works.
 *
 * One tap, because it can only make a robot stand.  It shows the steps of that very STOP,
 * and the last drill in the history.
 */

import { readApi, sendApi } from "../core/api.js";
import { dayAndTime } from "../pages/history/local_time.js";
import { need, needPart, setDisabled, setHidden, setText } from "./dom.js";
import { whyNotAtAll } from "./release.js";
import { since } from "./stop_view.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/i18n.js").I18n} I18n */
/** @typedef {import("../core/protocol.js").Command} Command */
/** @typedef {import("./release.js").Facts} Facts */
/** @typedef {import("../types.js").Drill} Drill one of GET /drills */

/** Greatest speed of a robot at the start of a drill (m/s), the server's number. */
const CREEP_M_S = 0.2;
/** From press to standstill (docs/safety.md). */
const DEADLINE_MS = 5000;
const READ_AGAIN_MS = 1000;
const LOUD = new Set(["UNCONFIRMED", "STILL_MOVING"]);

/**
 * @param {App} app
 * @param {HTMLElement} card
 * @param {string} robotId
 */
export function createDrill({ store, i18n, line }, card, robotId) {
  const button = /** @type {HTMLButtonElement} */ (need("[data-drill]", card));
  const panel = /** @type {HTMLDialogElement} */ (needPart("panel", card));
  /** @type {Drill | null} */
  let last = null;
  let readStatus = 0;
  let refused = 0;
  let isBusy = false;
  /** State of the STOP when the history was read last. @type {string | null} */
  let readFor = null;
  let readAtMs = 0;

  /** @param {Facts} facts */
  function draw(facts) {
    if (!panel.open) {
      readFor = null;
      refused = 0;
      return;
    }
    const why = isBusy ? "busy" : whyNotDrill(facts);
    setDisabled(button, why !== "ok");
    setText(needPart("drill-why", card), i18n.t(`drill.why.${why}`));
    setText(needPart("drill-label", card), i18n.t("drill.button", { robot: robotId }));
    const command = facts.command?.drill ? facts.command : undefined;
    setText(needPart("drill-result", card), resultSaid(command));
    setText(needPart("drill-last", card), lastSaid());
    drawDue(needPart("drill-due", card), robotId, store, i18n);
    readOnce(command);
  }

  /** @param {Command | undefined} command */
  function resultSaid(command) {
    if (refused) {
      const known = `drill.refused.${refused}`;
      const key = i18n.has(known) ? known : "drill.refused.other";
      return i18n.t(key, { status: refused });
    }
    if (!command) return "";
    const ageMs = 1000 * since(command.times.requested, line.serverNow());
    const key = progressOf(command, ageMs);
    const state = i18n.t(`history.state.${command.state}`);
    const said = i18n.t(key, { state, ms: command.standstill_ms });
    return key === "drill.running" ? said : `${said} ${i18n.t("drill.held")}`;
  }

  function lastSaid() {
    if (readStatus === 0) return "";
    if (readStatus !== 200) return i18n.t("drill.unread", { status: readStatus });
    return last
      ? i18n.t("drill.last", {
          at: dayAndTime(last.drilled_at),
          by: last.by,
          result: verdictSaid(last, i18n),
        })
      : i18n.t("drill.never");
  }

  /** When the panel opens, and when a drill has moved on. @param {Command} [command] */
  async function readOnce(command) {
    const nowMs = performance.now();
    const isNow = command ? `${command.command_id} ${command.state}` : "";
    // The history is written in batches, so a new drill is in it a moment later.
    const isBehind = last?.passed === null || (command && !isOf(last, command));
    const isDue = isBehind && nowMs - readAtMs > READ_AGAIN_MS;
    if (readFor === isNow && !isDue) return;
    readFor = isNow;
    readAtMs = nowMs;
    ({ status: readStatus, last } = await readLast(robotId));
  }

  button.addEventListener("click", async () => {
    isBusy = true;
    button.disabled = true;
    const path = `robots/${encodeURIComponent(robotId)}/drill`;
    const { status } = await sendApi("POST", path, { pressed_at: line.serverNow() });
    isBusy = false;
    refused = status === 202 ? 0 : status;
  });
  return { draw };
}

/**
 * Shows the server's reminder when a robot's last drill is too long ago.
 *
 * @param {HTMLElement} place
 * @param {string} robotId
 * @param {import("../core/store.js").Store} store
 * @param {I18n} i18n
 */
export function drawDue(place, robotId, store, i18n) {
  /** @type {import("../core/protocol.js").Alert[]} */
  const alerts = store.get("alerts") ?? [];
  const due = alerts.find(
    ({ key, robot_id }) => key === "alert.drill_due" && robot_id === robotId,
  );
  setHidden(place, !due);
  if (due) setText(place, i18n.t(due.key, due.slots));
}

/**
 * The newest drill of a robot in the history.
 *
 * @param {string} robotId
 * @returns {Promise<{status: number, last: Drill | null}>}
 */
export async function readLast(robotId) {
  const query = `robot=${encodeURIComponent(robotId)}`;
  const { status, body } = await readApi(`drills?${query}`);
  return { status, last: status === 200 ? (body.items[0] ?? null) : null };
}

/** @param {Drill | null} drill @param {Command} command */
const isOf = (drill, command) => drill?.command_id === command.command_id;

/** Key of the reason why no drill can be done now, or `ok`. @param {Facts} facts */
export function whyNotDrill(facts) {
  const common = whyNotAtAll(facts);
  if (common) return common;
  if (facts.command) return "stopped";
  const speed = Math.abs(facts.robot?.twist?.linear ?? Number.POSITIVE_INFINITY);
  return speed <= CREEP_M_S ? "ok" : "moving";
}

/**
 * Key of the progress of a drill.
 *
 * @param {Command} command
 * @param {number} ageMs since it was asked for
 */
export function progressOf({ state, standstill_ms: ms }, ageMs) {
  if (ms !== null) return ms <= DEADLINE_MS ? "drill.passed" : "drill.slow";
  const isOver = LOUD.has(state) && ageMs > DEADLINE_MS;
  return isOver ? "drill.failed" : "drill.running";
}

/** The verdict of a drill in the history. @param {Drill} drill @param {I18n} i18n */
export function verdictSaid({ passed, standstill_ms: ms }, i18n) {
  if (passed === null) return i18n.t("drill.unknown");
  if (passed) return i18n.t("drill.passed", { ms });
  return ms === null ? i18n.t("drill.failed") : i18n.t("drill.slow", { ms });
}
