/** How old readings of the climate are, in words. */

/** Air changes slowly; after five minutes a reading still says little of now (s). */
export const CLIMATE_OLD_S = 300;
const MINUTES_FROM_S = 120;

/** @param {number} age (s) @param {import("../core/i18n.js").I18n} i18n */
export function climateAgo(age, i18n) {
  const minutes = Math.floor(age / 60);
  if (age < MINUTES_FROM_S) return i18n.t("climate.ago_s", { age });
  return i18n.t("climate.ago_min", { minutes });
}
