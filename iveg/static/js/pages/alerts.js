/**
 * The Alarms page: all that is active, whatever the window of time; the sound; the past.
 */

import { dayAndTime } from "../history/madrid.js";
import { createAlertList, sentenceOf } from "../panels/alert_list.js";
import { createMembers, floodSaid } from "../panels/alert_members.js";
import { earlierUnknown, isKnown } from "../panels/alerts.js";
import { make, need, setHidden, setText } from "../panels/dom.js";
import { createSoundPanel } from "../panels/sound.js";
import { createChips, createRows, soon } from "./rows.js";

/** @typedef {import("../protocol.js").Alert} Alert */

/** @param {import("../page.js").Page} page */
export function start({ store, words, tone }) {
  const list = createAlertList(need("#active-alerts"), words);
  /** @type {Set<string>} alarms whose occurrences somebody reads */
  const opened = new Set();
  const isChosen = createChips("data-priority-chip", () => rows.draw());
  const rows = createRows({
    name: "past",
    path: "alerts",
    words,
    cells: (alert) => cellsOf(alert, words, opened),
    admits: ({ priority, cleared_at }) => cleared_at !== null && isChosen(priority),
  });
  const reload = soon(rows.load);

  function draw() {
    /** @type {Alert[]} */
    const alerts = store.get("alerts") ?? [];
    list.draw(alerts);
    const isUnknown = earlierUnknown(store);
    setHidden(need("#active-empty"), alerts.length > 0 || !isKnown(store));
    setHidden(need("#earlier-unknown"), !isUnknown);
  }

  store.subscribe("alerts", () => {
    draw();
    reload();
  });
  store.subscribe("health", draw);
  function drawFlood() {
    /** @type {import("../protocol.js").Flood | null | undefined} */
    const flood = store.get("flood");
    setText(need("#flood"), floodSaid(flood, words));
    need("#flood").toggleAttribute("data-flood", Boolean(flood?.since));
  }

  store.subscribe("flood", drawFlood);
  words.onChange(draw);
  words.onChange(drawFlood);
  createSoundPanel(words, tone);
  draw();
  drawFlood();
  rows.load();
}

/** @param {Alert} alert @param {import("../i18n.js").Words} words
 * @param {Set<string>} opened */
function cellsOf(alert, words, opened) {
  const priority = make("td");
  priority.dataset.priority = alert.priority;
  priority.append(
    make("span", "shape"),
    make("span", "", words.t(`alert.priority.${alert.priority}`)),
  );
  const over = alert.cleared_at ? dayAndTime(alert.cleared_at) : "—";
  return [
    make("td", "time", timesOf(alert, words)),
    priority,
    whatOf(alert, words, opened),
    make("td", "time", over),
    make("td", "", seenBy(alert, words)),
    make("td", "number", words.number(alert.count, 0)),
  ];
}

/** First and last time. @param {Alert} alert @param {import("../i18n.js").Words} words */
function timesOf({ raised_at, last_raised_at, count }, words) {
  const first = dayAndTime(raised_at);
  return count === 1 ? first : `${first} – ${words.time(last_raised_at)}`;
}

/** What it says, and each time that it said so. @param {Alert} alert
 * @param {import("../i18n.js").Words} words @param {Set<string>} opened */
function whatOf(alert, words, opened) {
  const cell = make("td", "what", sentenceOf(alert, words));
  const { element, draw } = createMembers(words);
  draw(alert);
  // The table is written anew while somebody reads it.
  element.open = opened.has(alert.alert_id);
  element.addEventListener("toggle", () => {
    if (element.open) opened.add(alert.alert_id);
    else opened.delete(alert.alert_id);
  });
  cell.append(element);
  return cell;
}

/** Who, when and what they said. @param {Alert} alert
 * @param {import("../i18n.js").Words} words */
function seenBy({ acknowledged_at, acknowledged_by, note }, words) {
  if (!acknowledged_at) return "—";
  const who = `${acknowledged_by} ${words.time(acknowledged_at)}`;
  return note ? `${who}: ${note}` : who;
}
