/**
 * The Alerts page: all active alerts, whatever the window of time; the sound; the past.
 */

import { createAlertList, pinOf, sentenceOf } from "../panels/alert_list.js";
import { createMembers, writeFlood } from "../panels/alert_members.js";
import { earlierUnknown, isKnown, isUnheard } from "../panels/alerts.js";
import { make, need, setHidden } from "../panels/dom.js";
import { createNotes, sharedNotes } from "../panels/notes.js";
import { createSoundPanel } from "../panels/sound.js";
import { toldSaid } from "../panels/told.js";
import { createTogether } from "./alerts_together.js";
import { dayAndTime } from "./history/local_time.js";
import { createChips, createRows, keepOpen, soon } from "./rows.js";

/** @typedef {import("../core/protocol.js").Alert} Alert */

/** @param {import("../core/page.js").Page} page */
export function start({ store, i18n, tone }) {
  const list = createAlertList(need("#active-alerts"), i18n);
  const together = createTogether(i18n);
  /** @type {Set<string>} alerts whose occurrences somebody reads */
  const opened = new Set();
  const notes = createNotesOf(i18n);
  const isChosen = createChips("data-priority-chip", () => rows.draw());
  const rows = createRows({
    name: "past",
    path: "alerts",
    i18n,
    cells: (alert) => cellsOf(alert, i18n, opened, notes),
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
  const drawFlood = () => writeFlood(need("#flood"), store.get("flood"), i18n);
  store.subscribe("flood", drawFlood);
  i18n.onChange(draw);
  i18n.onChange(drawFlood);
  createSoundPanel(i18n, tone);
  draw();
  drawFlood();
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
 * @param {Set<string>} opened @param {ReturnType<typeof createNotesOf>} notes */
function cellsOf(alert, i18n, opened, notes) {
  const priority = make("td");
  priority.dataset.priority = alert.priority;
  priority.append(
    make("span", "shape"),
    make("span", "", i18n.t(`alert.priority.${alert.priority}`)),
  );
  const what = whatOf(alert, i18n, opened);
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

/** The text of an alert, and each of its occurrences. @param {Alert} alert
 * @param {import("../core/i18n.js").I18n} i18n @param {Set<string>} opened */
function whatOf(alert, i18n, opened) {
  const cell = make("td", "what", sentenceOf(alert, i18n));
  const { element, draw } = createMembers(i18n);
  draw(alert);
  keepOpen(element, opened, alert.alert_id);
  cell.append(element);
  const told = toldSaid(alert.told, i18n);
  if (told) cell.append(make("p", "block__note", told));
  return cell;
}

/** Who acknowledged it, when, and with which note. @param {Alert} alert
 * @param {import("../core/i18n.js").I18n} i18n */
function seenBy({ acknowledged_at, acknowledged_by, note }, i18n) {
  if (!acknowledged_at) return "—";
  const who = `${i18n.t("rows.by", { by: acknowledged_by })} ${i18n.time(acknowledged_at)}`;
  return note ? `${who}: ${note}` : who;
}
