/**
 * The Alerts page: all active alerts, whatever the window of time; the sound; the past.
 */

import { createAlertList, pinOf, sentenceOf } from "../panels/alert_list.js";
import { earlierUnknown, isKnown, isUnheard } from "../panels/alerts.js";
import { make, need, setHidden } from "../panels/dom.js";
import { createNotes, sharedNotes } from "../panels/notes.js";
import { createSoundPanel } from "../panels/sound.js";
import { createTogether } from "./alerts_together.js";
import { dayAndTime } from "./history/local_time.js";
import { createChips, createRows, soon } from "./rows.js";

/** @typedef {import("../core/protocol.js").Alert} Alert */

/** @param {import("../core/page.js").Page} page */
export function start({ store, i18n, tone }) {
  const list = createAlertList(need("#active-alerts"), i18n);
  const together = createTogether(i18n);
  const notes = createNotesOf(i18n);
  const isChosen = createChips("data-priority-chip", () => rows.draw());
  const rows = createRows({
    name: "past",
    path: "alerts",
    i18n,
    cells: (alert) => cellsOf(alert, i18n, notes),
    belongs: ({ cleared_at }) => cleared_at !== null,
    admits: ({ priority }) => isChosen(priority),
  });
  const reload = soon(rows.load);

  function draw() {
    /** @type {Alert[]} */
    const alerts = store.get("alerts") ?? [];
    list.draw(alerts);
    together.draw(alerts);
    const isUnknown = earlierUnknown(store);
    setHidden(need("#active-empty"), alerts.length > 0 || !isKnown(store));
    setHidden(need("#earlier-unknown"), !isUnknown);
    setHidden(need("#active-unheard"), !isUnheard(store));
  }

  store.subscribe("alerts", () => {
    draw();
    reload();
  });
  store.subscribe("health", draw);
  store.subscribe("connection", draw);
  i18n.onChange(draw);
  createSoundPanel(i18n, tone);
  draw();
  rows.load();
}

/**
 * Notes of alerts that are over; what is being written stays when rows are read anew.
 *
 * @param {import("../core/i18n.js").I18n} i18n
 */
function createNotesOf(i18n) {
  const read = sharedNotes();
  /** @type {Map<string, ReturnType<typeof createNotes>>} */
  const known = new Map();
  return (/** @type {Alert} */ alert) => {
    const notes = known.get(alert.alert_id) ?? createNotes(pinOf(alert), i18n, read);
    known.set(alert.alert_id, notes);
    notes.draw();
    return notes.element;
  };
}

/** @param {Alert} alert @param {import("../core/i18n.js").I18n} i18n
 * @param {ReturnType<typeof createNotesOf>} notes */
function cellsOf(alert, i18n, notes) {
  const priority = make("td");
  priority.dataset.priority = alert.priority;
  priority.append(
    make("span", "shape"),
    make("span", "", i18n.t(`alert.priority.${alert.priority}`)),
  );
  const what = make("td", "what", sentenceOf(alert, i18n));
  what.append(notes(alert));
  const over = alert.cleared_at ? dayAndTime(alert.cleared_at) : "—";
  return [
    make("td", "time", timesOf(alert, i18n)),
    priority,
    what,
    make("td", "time", over),
    make("td", "", seenBy(alert, i18n)),
    make("td", "number", i18n.number(alert.count, 0)),
  ];
}

/** First and last time. @param {Alert} alert @param {import("../core/i18n.js").I18n} i18n */
function timesOf({ raised_at, last_raised_at, count }, i18n) {
  const first = dayAndTime(raised_at);
  return count === 1 ? first : `${first} – ${i18n.time(last_raised_at)}`;
}

/** Who acknowledged it, when, and with which note. @param {Alert} alert
 * @param {import("../core/i18n.js").I18n} i18n */
function seenBy({ acknowledged_at, acknowledged_by, note }, i18n) {
  if (!acknowledged_at) return "—";
  const who = `${i18n.t("rows.by", { by: acknowledged_by })} ${i18n.time(acknowledged_at)}`;
  return note ? `${who}: ${note}` : who;
}
