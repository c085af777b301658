/**
 * An alarm that repeats, one occurrence after the other, behind a line that opens it.
 */

import { make, setHidden, setText } from "./dom.js";

/** @typedef {import("../protocol.js").Alert} Alert */
/** @typedef {import("../protocol.js").Occurrence} Occurrence */

/** @param {import("../i18n.js").Words} words */
export function createMembers(words) {
  const element = make("details", "members");
  const summary = make("summary");
  const list = make("ol");
  element.append(summary, list);

  /** @param {Alert} alert */
  function draw({ count, members = [] }) {
    setHidden(element, count < 2);
    const kept = members.length;
    const key = kept < count ? "alert.members_newest" : "alert.members";
    setText(summary, words.t(key, { count, kept }));
    const newest = [...members].reverse();
    while (list.children.length > newest.length) list.lastElementChild?.remove();
    while (list.children.length < newest.length) list.append(make("li"));
    newest.forEach((member, i) => {
      setText(list.children[i], lineOf(member, words));
    });
  }

  return { element, draw };
}

/** @param {Occurrence} member @param {import("../i18n.js").Words} words */
function lineOf(member, words) {
  const { priority, raised_at, cleared_at, acknowledged_at, note } = member;
  return [
    words.t(`alert.priority.${priority}`),
    words.t("alert.since", { at: raised_at }),
    cleared_at && words.t("alert.cleared", { at: cleared_at }),
    acknowledged_at &&
      words.t("alert.acknowledged", {
        who: member.acknowledged_by,
        at: acknowledged_at,
      }),
    note,
  ]
    .filter(Boolean)
    .join(" · ");
}

/**
 * How fast alarms come, in a sentence; empty while nothing is known.
 *
 * @param {import("../protocol.js").Flood | null | undefined} flood
 * @param {import("../i18n.js").Words} words
 */
export function floodSaid(flood, words) {
  if (!flood) return "";
  const { count, limit, since } = flood;
  const slots = { count, limit, minutes: flood.window_s / 60, since };
  return words.t(since ? "alert.flood" : "alert.rate", slots);
}
