/**
 * Alerts on every page: a bell with the worst and the number, a list, and the sound.
 *
 * P1 sounds until somebody acknowledges it (ISA-18.2); the others chime once when they
 * come.  The server groups repetitions and keeps person, time and note.
 */

import { createAlertList } from "./alert_list.js";
import { need, setAttribute, setHidden, setText } from "./dom.js";

/** @typedef {import("../core/protocol.js").Alert} Alert */

/**
 * @param {import("../main.js").App} app
 * @param {import("./tone.js").Tone} tone
 */
export function createAlertsPanel({ store, i18n }, tone) {
  const list = createAlertList(need("#alerts"), i18n);
  const button = need("#alerts-button");
  const panel = document.querySelector("#alerts-panel");
  /** @type {Map<string, number> | null} occurrences told before; null before the first */
  let known = null;

  function draw() {
    /** @type {Alert[]} */
    const alerts = store.get("alerts") ?? [];
    const open = alerts.length;
    const isUnknown = earlierUnknown(store);
    const isCut = isUnheard(store);
    const isHeard = Boolean(store.get("alerts") ?? store.get("snapshot"));
    const count = isUnknown || isCut ? `${open}?` : String(open);
    setText(need("#alerts-count"), isHeard ? count : "?");
    setHidden(need("#alerts-earlier"), !isUnknown);
    setHidden(need("#alerts-unheard"), !isCut);
    // A past and unseen alert may be graver than the active ones.
    const [worst] = alerts.map(({ priority }) => priority).sort();
    setAttribute(button, "data-worst", worst ?? "none");
    setAttribute(button, "title", i18n.t("header.alerts_count", { count: open }));
    setHidden(need("#alerts-empty"), alerts.length > 0 || !isKnown(store));
    drawList();
  }

  /** A closed list is written when it is opened: nobody reads it before. */
  function drawList() {
    if (panel && !panel.hasAttribute("open")) return;
    list.draw(store.get("alerts") ?? []);
  }

  function sound() {
    /** @type {Alert[]} */
    const alerts = store.get("alerts") ?? [];
    tone.sound(alerts.some(isLoud));
    // A known group sounds again with each of its occurrences.
    const news = alerts.filter(
      ({ alert_id, count }) => known && known.get(alert_id) !== count,
    );
    if (news.some(({ priority }) => priority !== "P1")) tone.chime();
    known = new Map(alerts.map(({ alert_id, count }) => [alert_id, count]));
  }

  store.subscribe("alerts", () => {
    draw();
    sound();
  });
  store.subscribe("health", draw);
  store.subscribe("connection", draw);
  document.addEventListener("iveg:panel", drawList);
  i18n.onChange(draw);
  draw();
}

/**
 * Whether the server does not know the unseen alerts of earlier runs.
 *
 * @param {import("../core/store.js").Store} store
 */
export function earlierUnknown(store) {
  return store.get("health")?.earlier === "unknown";
}

/**
 * Whether alerts may have come and gone since the server was heard.
 *
 * @param {import("../core/store.js").Store} store
 */
export function isUnheard(store) {
  const { state } = store.connection;
  return state !== "open" && Boolean(store.get("snapshot"));
}

/** The absence of alerts is known only from a connected server that knows its past.
 * @param {import("../core/store.js").Store} store */
export function isKnown(store) {
  const isHeard = store.connection.state === "open" && Boolean(store.get("snapshot"));
  return isHeard && !earlierUnknown(store);
}

/** It sounds until somebody has seen it, also when it is over. @param {Alert} alert */
function isLoud({ priority, acknowledged_at }) {
  return priority === "P1" && !acknowledged_at;
}
