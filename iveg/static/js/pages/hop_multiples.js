/**
 * Where the milliseconds go, at a glance: one small picture a hop, all on one scale;
 * a bar to the mean and a line to P95 for each kind of data.
 *
 * @typedef {import("../types.js").LatencyRow} Row
 * @typedef {import("../core/i18n.js").I18n} I18n
 * @typedef {"uplink" | "fiware" | "iveg" | "screen"} Hop
 */

import { make, makeSvg } from "../panels/dom.js";

/** @type {readonly Hop[]} in the order in which a message passes them */
const HOPS = ["uplink", "fiware", "iveg", "screen"];
const LONG = 100;

/** @param {HTMLElement} place @param {Row[]} rows @param {I18n} i18n */
export function drawMultiples(place, rows, i18n) {
  const most = mostOf(rows);
  place.replaceChildren(...HOPS.map((hop) => makeHop(hop, rows, most, i18n)));
}

/** The end of the scale (ms): the greatest P95 of all. @param {Row[]} rows */
export function mostOf(rows) {
  return Math.max(
    0,
    ...rows.flatMap(({ hops }) => HOPS.map((hop) => hops[hop].p95_ms ?? 0)),
  );
}

/** @param {Hop} hop @param {Row[]} rows @param {number} most @param {I18n} i18n */
function makeHop(hop, rows, most, i18n) {
  const part = make("section", "multiple");
  const list = make("dl", "multiple__rows");
  for (const { data, hops } of rows) {
    const { mean_ms: mean, p95_ms: p95 } = hops[hop];
    const isKnown = mean !== null && p95 !== null;
    const said = isKnown ? i18n.t("hops.glance_row", { mean, p95 }) : "—";
    const value = make("dd", "", said);
    if (isKnown && most > 0) value.prepend(makeBar(mean / most, p95 / most));
    list.append(make("dt", "", i18n.t(`stream.${data}`)), value);
  }
  part.append(make("h3", "", i18n.t(`hops.step.${hop}`)), list);
  return part;
}

/** @param {number} mean @param {number} p95 both as shares of the scale */
function makeBar(mean, p95) {
  const svg = makeSvg("svg", {
    class: "multiple__bar",
    viewBox: `0 0 ${LONG} 10`,
    preserveAspectRatio: "none",
    "aria-hidden": "true",
  });
  svg.append(
    makeSvg("rect", { y: 4, height: 2, width: LONG * p95 }),
    makeSvg("rect", { y: 1, height: 8, width: LONG * mean }),
  );
  return svg;
}
