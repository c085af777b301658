/**
 * One press that acknowledges many, but no P1: each of those is about somebody in danger,
 * and sounds until somebody has read it (docs/dashboard.md, "Alerts").
 */

import { sendApi } from "../core/api.js";
import { need, setHidden, setText } from "../panels/dom.js";

/** @typedef {import("../core/protocol.js").Alert} Alert */

const ACKNOWLEDGERS = new Set(["operator", "admin"]);
/** Fewer are read one by one. */
const FEWEST = 3;
/** The server takes so many at once. */
const MOST = 200;

/**
 * What may be acknowledged together, in the order of the list.
 *
 * @param {readonly Alert[]} alerts
 */
export const lesser = (alerts) =>
  alerts
    .filter((alert) => alert.priority !== "P1" && !alert.acknowledged_at)
    .slice(0, MOST);

/** @param {import("../core/i18n.js").I18n} i18n */
export function createTogether(i18n) {
  const button = /** @type {HTMLButtonElement} */ (need("#acknowledge-together"));
  /** @type {Alert[]} those that the button counts */
  let counted = [];
  let isPressed = false;
  let said = "";

  /** @param {readonly Alert[]} alerts */
  function draw(alerts) {
    counted = lesser(alerts);
    const may = ACKNOWLEDGERS.has(document.body.dataset.role ?? "");
    const isFew = counted.length < FEWEST;
    // Once pressed it stays: no row may come under the finger.
    setHidden(button, !may || (isFew && !isPressed));
    button.disabled = isFew;
    const count = counted.length;
    setText(button, i18n.t("alertspage.together", { count }));
    setText(need("#acknowledged-together"), said);
  }

  async function press() {
    isPressed = true;
    button.disabled = true;
    const alert_ids = counted.map(({ alert_id }) => alert_id);
    const { status, body } = await sendApi("POST", "alerts/acknowledge", { alert_ids });
    button.disabled = counted.length < FEWEST;
    said =
      status === 200
        ? i18n.t("alertspage.together_done", { count: body.items.length })
        : i18n.t(status ? "alert.failed" : "rows.offline", { status });
    setText(need("#acknowledged-together"), said);
  }

  button.addEventListener("click", press);
  return { draw };
}
