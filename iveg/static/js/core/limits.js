/**
 * The server's safety numbers: it writes its table (`iveg/domain/limits.py`) into every
 * page, so that no number is written here a second time.
 *
 * @typedef {{
 *   live_s: number, late_s: number, seen_s: number, zone_lasts_s: number,
 *   walking_m_s: number, growth_grace_s: number, zone_most_m: number,
 *   report_fresh_s: number, report_stale_s: number, standing_speed: number,
 *   slow_factor: number,
 * }} Limits those that pages use; names carry the unit
 */

/** @type {Readonly<Limits>} */
export const LIMITS = Object.freeze(JSON.parse(document.body.dataset.limits ?? ""));

/**
 * Radius of a zone at an age (m), when it was `radiusM` at the younger age `thenS`.
 *
 * It keeps its size for as long as a healthy data path takes, grows at walking speed,
 * and never shrinks.
 *
 * @param {number} radiusM
 * @param {number} ageS
 * @param {number} [thenS]
 */
export function zoneRadius(radiusM, ageS, thenS = 0) {
  const walkedM = LIMITS.walking_m_s * (beyondGrace(ageS) - beyondGrace(thenS));
  return Math.max(radiusM, Math.min(LIMITS.zone_most_m, radiusM + walkedM));
}

/** @param {number} ageS */
function beyondGrace(ageS) {
  return Math.max(0, ageS - LIMITS.growth_grace_s);
}
