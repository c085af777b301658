/**
 * The notifications of an alert outside iVeg, in a sentence.
 *
 * @typedef {import("../types").Told} Told
 */

/** @param {Told[] | undefined} told @param {import("../core/i18n.js").I18n} i18n */
export function toldSaid(told, i18n) {
  return (told ?? []).map((one) => oneSaid(one, i18n)).join(" · ");
}

/** @param {Told} one @param {import("../core/i18n.js").I18n} i18n */
function oneSaid({ channel, to, at, failed }, i18n) {
  const slots = {
    who: to || i18n.t("messages.everybody"),
    channel: i18n.t(`messages.channel.${channel}`),
    at,
    why: failed && i18n.t(`messages.why.${failed}`),
  };
  return i18n.t(failed ? "messages.told_failed" : "messages.told", slots);
}
