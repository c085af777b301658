/**
 * The Alarms page: all that is active, whatever the window of time; the sound; the past.
 */

import { dayAndTime } from "../history/madrid.js";
import { createAlertList, sentenceOf } from "../panels/alert_list.js";
import { make, need, setHidden } from "../panels/dom.js";
import { createSoundPanel } from "../panels/sound.js";
import { createChips, createRows, soon } from "./rows.js";

/** @typedef {import("../protocol.js").Alert} Alert */

/** @param {import("../page.js").Page} page */
export function start({ store, words, tone }) {
  const list = createAlertList(need("#active-alerts"), words);
  const isChosen = createChips("data-priority-chip", () => rows.draw());
  const rows = createRows({
    name: "past",
    path: "alerts",
    words,
    cells: (alert) => cellsOf(alert, words),
    admits: ({ priority }) => isChosen(priority),
  });
  const reload = soon(rows.load);

  function draw() {
    /** @type {Alert[]} */
    const alerts = store.get("alerts") ?? [];
    list.draw(alerts);
    setHidden(need("#active-empty"), alerts.length > 0);
  }

  store.subscribe("alerts", () => {
    draw();
    reload();
  });
  words.onChange(draw);
  createSoundPanel(words, tone);
  draw();
  rows.load();
}

/** @param {Alert} alert @param {import("../i18n.js").Words} words */
function cellsOf(alert, words) {
  const priority = make("td");
  priority.dataset.priority = alert.priority;
  priority.append(
    make("span", "shape"),
    make("span", "", words.t(`alert.priority.${alert.priority}`)),
  );
  const over = alert.cleared_at ? dayAndTime(alert.cleared_at) : "—";
  return [
    make("td", "time", dayAndTime(alert.raised_at)),
    priority,
    make("td", "what", sentenceOf(alert, words)),
    make("td", "time", over),
    make("td", "", seenBy(alert, words)),
    make("td", "number", words.number(alert.count, 0)),
  ];
}

/** Who, when and what they said. @param {Alert} alert
 * @param {import("../i18n.js").Words} words */
function seenBy({ acknowledged_at, acknowledged_by, note }, words) {
  if (!acknowledged_at) return "—";
  const who = `${acknowledged_by} ${words.time(acknowledged_at)}`;
  return note ? `${who}: ${note}` : who;
}
