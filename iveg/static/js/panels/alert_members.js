/**
 * The occurrences of an alert that repeats, behind a line that opens them.
 */

import { fill, make, setHidden, setText } from "./dom.js";
import { toldSaid } from "./told.js";

/** @typedef {import("../core/protocol.js").Alert} Alert */
/** @typedef {import("../core/protocol.js").Occurrence} Occurrence */

/** @param {import("../core/i18n.js").I18n} i18n */
export function createMembers(i18n) {
  const element = make("details", "members");
  const summary = make("summary");
  const list = make("ol");
  element.append(summary, list);

  /** @param {Alert} alert */
  function draw({ count, members = [] }) {
    setHidden(element, count < 2);
    const kept = members.length;
    const key = kept < count ? "alert.members_newest" : "alert.members";
    setText(summary, i18n.t(key, { count, kept }));
    const newest = [...members].reverse();
    fill(
      list,
      newest,
      () => make("li"),
      (item, member) => setText(item, lineOf(member, i18n)),
    );
  }

  return { element, draw };
}

/** @param {Occurrence} member @param {import("../core/i18n.js").I18n} i18n */
function lineOf(member, i18n) {
  return [
    i18n.t(`alert.priority.${member.priority}`),
    i18n.t("alert.since", { at: member.raised_at }),
    ...endOf(member, i18n),
  ].join(" · ");
}

/**
 * What became of an alert, or of one of its occurrences.
 *
 * @param {Alert | Occurrence} it
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function endOf({ cleared_at, acknowledged_at, ...it }, i18n) {
  const who = it.acknowledged_by;
  return [
    cleared_at && i18n.t("alert.cleared", { at: cleared_at }),
    acknowledged_at && i18n.t("alert.acknowledged", { who, at: acknowledged_at }),
    it.note,
    toldSaid(it.told, i18n),
  ].filter(Boolean);
}

/**
 * Writes the rate of alerts, and marks it while they are a flood.
 *
 * @param {HTMLElement} place
 * @param {import("../core/protocol.js").Flood | null | undefined} flood
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function writeFlood(place, flood, i18n) {
  setText(place, floodSaid(flood, i18n));
  place.toggleAttribute("data-flood", Boolean(flood?.since));
}

/**
 * The rate of alerts, in a sentence; empty while it is unknown.
 *
 * @param {import("../core/protocol.js").Flood | null | undefined} flood
 * @param {import("../core/i18n.js").I18n} i18n
 */
export function floodSaid(flood, i18n) {
  if (!flood) return "";
  const { count, limit, since } = flood;
  const slots = { count, limit, minutes: flood.window_s / 60, since };
  return i18n.t(since ? "alert.flood" : "alert.rate", slots);
}
