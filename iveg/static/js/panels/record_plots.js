/**
 * Plots of a record: what a robot did before and after, by the history's rows.
 *
 * @typedef {import("../core/i18n.js").I18n} I18n
 * @typedef {import("./past.js").Past} Past
 * @typedef {import("./plot.js").Shade} Shade
 */

import { make } from "./dom.js";
import { distancesOf, limitsOf, speedsOf, zonesOf } from "./past.js";
import { makePlot } from "./plot.js";

/** Nobody is between two looks for longer. */
const UNSEEN_MS = 2000;

/**
 * Null where the history has no row of it.
 *
 * @param {Past} past
 * @param {{shade: Shade, radiusM: number | null, speedSaid: string}} about
 * @param {I18n} i18n
 */
export function makePlots(past, { shade, radiusM, speedSaid }, i18n) {
  const plots = [
    makePlot(
      {
        title: i18n.t("plot.speed"),
        says: speedSaid,
        span: past.span,
        lines: [
          lineOf("speed", speedsOf(past), i18n),
          { ...lineOf("limit", limitsOf(past), i18n), isStep: true },
        ],
        shade,
      },
      i18n,
    ),
    radiusM === null ? null : makeDistance(past, radiusM, shade, i18n),
  ].filter((plot) => plot !== null);
  if (!plots.length) return null;
  const section = make("section", "plots");
  section.append(...plots);
  return section;
}

/**
 * @param {Past} past @param {number} radiusM
 * @param {Shade} shade @param {I18n} i18n
 */
function makeDistance(past, radiusM, shade, i18n) {
  const distances = distancesOf(past);
  const known = distances.flatMap(({ value }) => (value === null ? [] : [value]));
  if (!known.length) return null;
  const least = Math.min(...known);
  const away = { ...lineOf("distance", distances, i18n), gapMs: UNSEEN_MS };
  return makePlot(
    {
      title: i18n.t("plot.distance"),
      says: i18n.t("plot.nearest", { least }),
      span: past.span,
      lines: [away, lineOf("ring", zonesOf(past, radiusM), i18n)],
      shade,
    },
    i18n,
  );
}

/** @param {string} kind @param {import("./plot.js").Sample[]} samples @param {I18n} i18n */
const lineOf = (kind, samples, i18n) => ({
  kind,
  name: i18n.t(`plot.key.${kind}`),
  samples,
});
