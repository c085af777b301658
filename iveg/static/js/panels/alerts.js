/**
 * Alarms on every page: a bell with the worst and the number, a list, and the sound.
 *
 * P1 sounds until somebody acknowledges it (ISA-18.2); the others chime once when they
 * come.  The server groups repetitions and keeps who, when and the note.
 */

import { byUrgency, createAlertList } from "./alert_list.js";
import { need, setAttribute, setHidden, setText } from "./dom.js";

/** @typedef {import("../protocol.js").Alert} Alert */

/**
 * @param {import("../main.js").App} app
 * @param {import("./tone.js").Tone} tone
 */
export function createAlertsPanel({ store, words }, tone) {
  const list = createAlertList(need("#alerts"), words);
  const button = need("#alerts-button");
  /** @type {Set<string> | null} alarms that were there before; null before the first */
  let known = null;

  function draw() {
    /** @type {Alert[]} */
    const alerts = store.get("alerts") ?? [];
    const open = alerts.filter(({ cleared_at }) => !cleared_at).sort(byUrgency);
    setText(need("#alerts-count"), String(open.length));
    setAttribute(button, "data-worst", open[0]?.priority ?? "none");
    button.title = words.t("header.alerts_count", { count: open.length });
    setHidden(need("#alerts-empty"), alerts.length > 0);
    list.draw(alerts);
  }

  function sound() {
    /** @type {Alert[]} */
    const alerts = store.get("alerts") ?? [];
    tone.sound(alerts.some(isLoud));
    const news = alerts.filter(({ alert_id }) => known && !known.has(alert_id));
    if (news.some(({ priority }) => priority !== "P1")) tone.chime();
    known = new Set(alerts.map(({ alert_id }) => alert_id));
  }

  store.subscribe("alerts", () => {
    draw();
    sound();
  });
  words.onChange(draw);
  draw();
}

/** It sounds until acknowledged, over or not. @param {Alert} alert */
function isLoud({ priority, acknowledged_at, cleared_at }) {
  return priority === "P1" && !acknowledged_at && !cleared_at;
}
