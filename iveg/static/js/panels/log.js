/**
 * The action and inference log: newest first, every entry a plain sentence.
 */

import { onBeat } from "../core/beat.js";
import { millisecondsOf } from "../pages/history/local_time.js";
import { make, need, needPart, setHidden, setText } from "./dom.js";
import { createLogEach } from "./log_each.js";
import { createChosen, createLogChips } from "./log_filter.js";
import { rowsOf } from "./log_rows.js";

/** @typedef {import("../main.js").App} App */
/** @typedef {import("../core/protocol.js").Entry} Entry */
/** @typedef {import("./log_rows.js").Row} Row */

/** Entries in the list; the store keeps more, history keeps all. */
const SHOWN = 200;
/** What each item says. @type {WeakMap<Element, Row>} */
const told = new WeakMap();

/**
 * @param {App} app
 * @param {{open: (decisionId: string, opener: HTMLElement) => void}} decision
 */
export function createLogPanel(app, decision) {
  const { store, i18n } = app;
  const list = need("#log");
  const empty = need("#log-empty");
  const clear = need("#log-clear");
  const chosen = createChosen();
  /** @type {Entry[]} told since the last beat, oldest first */
  let fresh = [];
  /** @type {Set<string>} */
  const robots = new Set(store.robots().keys());
  const chips = createLogChips({
    place: need("#log-chips"),
    i18n,
    chosen,
    robots: () => robots,
    onChange: rebuild,
  });
  // A reader who has scrolled must not lose the place.
  const isStill = () => list.scrollTop > 0;
  const each = createLogEach({ isStill, onChange: rebuild });

  /** @param {Row} row */
  function makeItem(row) {
    const { entry } = row;
    const item = make("li");
    item.dataset.kind = entry.kind;
    item.dataset.id = String(entry.id);
    if (entry.robot_id) item.dataset.robot = entry.robot_id;
    const text = make("p");
    const time = make("time", "", millisecondsOf(entry.at));
    time.dateTime = entry.at;
    const place = entry.decision_id ? makeOpener(entry) : text;
    const lasted = make("span");
    lasted.dataset.part = "lasted";
    place.append(time, " ", sentenceOf(entry, i18n), " ", lasted);
    if (place !== text) text.append(place);
    item.append(make("span", "log__mark"), text);
    writeLasted(item, row);
    return item;
  }

  /** @param {Entry} entry */
  function makeOpener(entry) {
    const opener = make("button", "log__open");
    opener.type = "button";
    opener.title = i18n.t("logpanel.decision");
    opener.addEventListener("click", (event) => {
      event.stopPropagation();
      decision.open(String(entry.decision_id), opener);
    });
    return opener;
  }

  /** @param {Entry} entry */
  function add(entry) {
    fresh.push(entry);
    onBeat(addFresh);
  }

  function addFresh() {
    learn(fresh.splice(0));
    if (each.isOn()) return;
    const shown = newestOf(store.log());
    if (!shown.length) return;
    const rows = new Map(shown.map((row) => [row.entry.id, row]));
    const newest = told.get(list.firstElementChild ?? list)?.entry.id ?? -1;
    // Rows that stay are not touched: one of them may have the focus.
    for (const item of [...list.children]) {
      const row = rows.get(told.get(item)?.entry.id ?? -1);
      if (!row) item.remove();
      else if (row.lastedS !== told.get(item)?.lastedS) writeLasted(item, row);
    }
    list.prepend(...shown.filter(({ entry }) => entry.id > newest).map(makeItem));
    setHidden(empty, true);
    setHidden(clear, true);
  }

  /** @param {Element} item @param {Row} row */
  function writeLasted(item, row) {
    told.set(item, row);
    setText(needPart("lasted", item), lastedSaid(row, i18n));
  }

  /** The rows that the filter admits, newest first. @param {readonly Entry[]} entries */
  function newestOf(entries) {
    const admitted = rowsOf(entries).filter(({ entry }) => chosen.admits(entry));
    return admitted.slice(-SHOWN).reverse();
  }

  /** @param {readonly Entry[]} entries */
  function learn(entries) {
    const known = robots.size;
    for (const robotId of store.robots().keys()) robots.add(robotId);
    for (const { robot_id } of entries) if (robot_id) robots.add(robot_id);
    if (robots.size > known) chips.draw();
  }

  function rebuild() {
    const entries = each.entries(store.log());
    fresh = [];
    learn(entries);
    const shown = newestOf(entries);
    list.replaceChildren(...shown.map(makeItem));
    setHidden(empty, shown.length > 0);
    const isHidden = entries.length > 0 && shown.length === 0;
    const filters = chips.said().join(" · ");
    const none = store.get("snapshot") ? "logpanel.empty" : "rows.loading";
    const nothing = each.isOn() ? each.empty() : none;
    const key = isHidden ? "logpanel.hidden" : nothing;
    setText(empty, i18n.t(key, { count: entries.length, filters }));
    setHidden(clear, !isHidden);
  }

  /** @param {number} atMs Unix time */
  function goTo(atMs) {
    each.off();
    const wanted = entryAt(store.log().filter(chosen.admits), atMs);
    const opener = need(".drawer-open");
    const isDrawer = opener.offsetParent !== null;
    if (isDrawer && !need("#log-panel").hasAttribute("data-open")) opener.click();
    for (const item of list.querySelectorAll("[data-here]")) {
      item.removeAttribute("data-here");
    }
    // Those before the list's oldest are in the history; the oldest is the nearest.
    const item =
      list.querySelector(`[data-id="${wanted?.id}"]`) ?? list.lastElementChild;
    item?.setAttribute("data-here", "");
    item?.scrollIntoView({ block: "nearest" });
  }

  document.addEventListener("iveg:log-at", (event) =>
    goTo(/** @type {CustomEvent<number>} */ (event).detail),
  );
  clear.addEventListener("click", () => {
    chosen.clear();
    chips.draw();
    rebuild();
    // The button is removed; the focus must not go with it.
    list.focus();
  });
  store.subscribe("log", add);
  store.subscribe("snapshot", rebuild);
  i18n.onChange(() => {
    chips.draw();
    rebuild();
  });
  rebuild();
}

/** @param {Row} row @param {import("../core/i18n.js").I18n} i18n */
const lastedSaid = ({ lastedS: seconds }, i18n) =>
  seconds === null ? "" : i18n.t("log.lasted", { seconds });

/**
 * The text of an entry; for a slow-down far from any person, the reason: a grown zone.
 *
 * @param {Pick<Entry, "key" | "slots">} entry
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function sentenceOf({ key, slots }, i18n) {
  const said = i18n.t(keyOf({ key, slots }), slots);
  const isGrown = slots.radius !== undefined && slots.unseen !== undefined;
  return isGrown ? `${said} ${i18n.t("log.grown", slots)}` : said;
}

/** A robot may slow down for a cause that iVeg does not know yet.
 * @param {Pick<Entry, "key" | "slots">} entry */
function keyOf({ key, slots }) {
  const isBare = key.startsWith("log.speed_down.") && slots.distance === undefined;
  return isBare && (slots.reason === "person" || slots.reason === "robot")
    ? "log.speed_down"
    : key;
}

/**
 * The newest entry that is not after a moment; the oldest where all are.
 *
 * @param {readonly Entry[]} entries oldest first
 * @param {number} atMs Unix time
 * @returns {Entry | undefined}
 */
export function entryAt(entries, atMs) {
  return entries.findLast(({ at }) => Date.parse(at) <= atMs) ?? entries[0];
}
