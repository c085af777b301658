/**
 * A list of alerts that can be acknowledged: shape, colour and text show the urgency.
 *
 * A row says what and since when; the rest of it opens by a tap, of the gravest at once.
 *
 * The bell's panel and the Alerts page show the same list; a note that is being written
 * keeps its focus while alerts come and go around it.
 */

import { sendApi } from "../core/api.js";
import { make, need, setAttribute, setHidden, setText } from "./dom.js";
import { createNotes, sharedNotes } from "./notes.js";
import { makePastLink } from "./past_link.js";
import { createWordAnswer } from "./word_answer.js";

/** @typedef {import("../core/protocol.js").Alert} Alert */

/** Roles that may acknowledge (safety: the table of roles). */
const ACKNOWLEDGERS = new Set(["operator", "admin"]);
/** So many P1s are open from the start: with more nobody would see what there is. */
const OPEN = 2;
/** How long no row moves under a finger that has acknowledged. */
const STILL_MS = 3000;

/**
 * @param {HTMLElement} list
 * @param {import("../core/i18n.js").I18n} i18n
 * @param {(alertId: string, note: string) => Promise<number>} [send] tests pass
 *   their own
 * @param {number} [stillMs] how long nothing moves after somebody acknowledged
 */
export function createAlertList(list, i18n, send = acknowledge, stillMs = STILL_MS) {
  /** @type {Map<string, HTMLLIElement>} */
  const items = new Map();
  /** @type {Map<string, ReturnType<typeof createNotes>>} */
  const notes = new Map();
  /** @type {Map<string, ReturnType<typeof createWordAnswer>>} */
  const answers = new Map();
  const readNotes = sharedNotes();
  /** @type {Map<string, number>} HTTP status of acknowledgements that failed */
  const failures = new Map();
  /** @type {Map<string, string>} what an item was drawn from */
  const drawn = new Map();
  /** @type {Alert[]} */
  let shown = [];
  /** Until then no row moves: a finger has just been here (`performance.now()`). */
  let stillUntilMs = 0;

  /** @param {Alert[]} alerts */
  function draw(alerts) {
    shown = [...alerts].sort(byUrgency);
    const isStill = performance.now() < stillUntilMs;
    list.toggleAttribute("data-still", isStill);
    if (isStill) return drawStill();
    for (const id of items.keys()) {
      if (!shown.some(({ alert_id }) => alert_id === id)) drop(id);
    }
    shown.forEach((alert, i) => {
      const item = itemOf(alert, i);
      // Moving an element takes the focus out of the note that is being written.
      if (list.children[i] !== item) list.insertBefore(item, list.children[i] ?? null);
      drawItem(item, alert);
    });
  }

  /** Writes changed rows; new and removed rows wait for the finger to leave. */
  function drawStill() {
    for (const [id, item] of items) {
      const alert = shown.find(({ alert_id }) => alert_id === id);
      if (alert) drawItem(item, alert);
      else withdraw(id, item);
    }
  }

  /** A row that is to go offers no button. @param {string} id @param {HTMLElement} item */
  function withdraw(id, item) {
    setHidden(need("form", item), true);
    // Should the alert come back meanwhile, it is drawn whole.
    drawn.delete(id);
  }

  function keepStill() {
    stillUntilMs = performance.now() + stillMs;
    list.toggleAttribute("data-still", true);
    setTimeout(() => draw(shown), stillMs + 20);
  }

  /** @param {string} id */
  function drop(id) {
    items.get(id)?.remove();
    items.delete(id);
    drawn.delete(id);
    notes.delete(id);
    answers.delete(id);
    failures.delete(id);
  }

  /** @param {Alert} alert @param {number} place in the list */
  function itemOf(alert, place) {
    const known = items.get(alert.alert_id);
    if (known) return known;
    const item = makeItem(async (note) => {
      keepStill();
      const status = await send(alert.alert_id, note);
      if (status >= 200 && status < 300) failures.delete(alert.alert_id);
      else failures.set(alert.alert_id, status);
      draw(shown);
    });
    const isLoud = alert.priority === "P1" && alert.acknowledged_at === null;
    need("details", item).toggleAttribute("open", isLoud && place < OPEN);
    const written = createNotes(pinOf(alert), i18n, readNotes);
    need(".alert-links", item).after(written.element);
    const answer = createWordAnswer(i18n);
    need(".alert__more", item).append(answer.element);
    answers.set(alert.alert_id, answer);
    notes.set(alert.alert_id, written);
    items.set(alert.alert_id, item);
    return item;
  }

  /** @param {HTMLElement} item @param {Alert} alert */
  function drawItem(item, alert) {
    const role = document.body.dataset.role ?? "";
    const failure = failures.get(alert.alert_id);
    const source = JSON.stringify([alert, i18n.language(), role, failure]);
    // Each change of one alert brings the whole list again.
    if (drawn.get(alert.alert_id) === source) return;
    drawn.set(alert.alert_id, source);
    setAttribute(item, "data-priority", alert.priority);
    setAttribute(item, "data-alert", alert.key);
    setText(need("b", item), sentenceOf(alert, i18n));
    setText(need("small", item), factsOf(alert, i18n));
    need(".past-link", item).replaceWith(makePastLink(alert.raised_at, i18n));
    const pack = /** @type {HTMLAnchorElement} */ (need(".incident-link", item));
    pack.href = `/api/v1/incident?${new URLSearchParams({ alert: alert.alert_id })}`;
    setText(pack, i18n.t("incident.get"));
    setHidden(pack, !ACKNOWLEDGERS.has(role));
    notes.get(alert.alert_id)?.draw();
    answers.get(alert.alert_id)?.draw(alert);
    const may = ACKNOWLEDGERS.has(role);
    setHidden(need("form", item), alert.acknowledged_at !== null || !may);
    const input = /** @type {HTMLInputElement} */ (need("input", item));
    input.placeholder = i18n.t("alert.note");
    input.setAttribute("aria-label", i18n.t("alert.note"));
    setText(need("button", item), i18n.t("alert.acknowledge"));
    setText(
      need("p", item),
      failure === undefined ? "" : i18n.t("alert.failed", { status: failure }),
    );
  }

  return { draw };
}

/** What a note about an alert is pinned to. @param {Alert} alert */
export const pinOf = ({ raised_at, robot_id }) => ({ at: raised_at, robot_id });

/** What an alert says. @param {Alert} alert @param {import("../core/i18n.js").I18n} i18n */
export function sentenceOf({ key, slots }, i18n) {
  return i18n.t(key.startsWith("alert.") ? key : `alert.${key}`, slots);
}

/** @param {Alert} alert @param {import("../core/i18n.js").I18n} i18n */
function factsOf(alert, i18n) {
  const { priority, count, raised_at, last_raised_at } = alert;
  const how = i18n.t(`alert.priority.${priority}`);
  const since = i18n.t("alert.since", { at: raised_at });
  const times = i18n.t("alert.times", { count, at: last_raised_at });
  const began = count > 1 ? [how, since, times] : [how, since];
  return [...began, ...endOf(alert, i18n)].join(" · ");
}

/**
 * What became of an alert.
 *
 * @param {Alert} it
 * @param {import("../core/i18n.js").I18n} i18n
 */
function endOf({ cleared_at, acknowledged_at, ...it }, i18n) {
  const who = it.acknowledged_by;
  return [
    cleared_at && i18n.t("alert.cleared", { at: cleared_at }),
    acknowledged_at && i18n.t("alert.acknowledged", { who, at: acknowledged_at }),
    it.note,
  ].filter(Boolean);
}

/** @param {(note: string) => void} onAcknowledge */
function makeItem(onAcknowledge) {
  const item = make("li");
  const row = make("details");
  const head = make("summary", "alert__head");
  const said = make("span", "alert__said");
  const more = make("div", "alert__more");
  const form = make("form");
  const input = make("input");
  const submit = make("button", "button");
  submit.type = "submit";
  input.maxLength = 200;
  form.append(input, submit);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    onAcknowledge(input.value);
  });
  const pack = make("a", "button incident-link");
  pack.download = "";
  const links = make("span", "alert-links");
  links.append(make("a", "past-link"), pack);
  said.append(make("b"), make("small"));
  head.append(make("span", "shape"), said);
  more.append(form, make("p"), links);
  row.append(head, more);
  item.append(row);
  return item;
}

/**
 * What holds before what is over, of these the gravest, of these the oldest: later alerts
 * move none of those above.
 *
 * @param {Alert} a
 * @param {Alert} b
 */
export function byUrgency(a, b) {
  return (
    Number(a.cleared_at !== null) - Number(b.cleared_at !== null) ||
    compare(a.priority, b.priority) ||
    compare(a.raised_at, b.raised_at)
  );
}

/** Digits and ASCII letters: ten times as quick as by a language's rules.
 * @param {string} a @param {string} b */
const compare = (a, b) => (a < b ? -1 : Number(a > b));

/** @param {string} id @param {string} note @returns {Promise<number>} 0: no answer */
async function acknowledge(id, note) {
  const path = `alerts/${encodeURIComponent(id)}/acknowledge`;
  return (await sendApi("POST", path, { note })).status;
}
