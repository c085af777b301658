/**
 * The distributions of latency in this page's language and colours: transport blue,
 * FIWARE orange, as in the paper; the later hops in two greys.
 *
 * @typedef {{type: string, name: string, x: number[], y: number[],
 *   meta: {hop: string, data: string}, line?: object}} Trace
 * @typedef {{data: Trace[], layout: Record<string, any>}} Figure
 */

import { readyPlotly, styled, token } from "./history/charts.js";

const CONFIG = { displayModeBar: false, responsive: true, displaylogo: false };
const COLOURS = /** @type {Record<string, string>} */ ({
  uplink: "--robot-1",
  fiware: "--robot-2",
  iveg: "--text-2",
  screen: "--hop-screen",
});
const DASHES = /** @type {Record<string, string>} */ ({
  odometry: "solid",
  detections: "dash",
  lidar: "dot",
});

/**
 * @param {HTMLElement} place @param {Figure} figure
 * @param {import("../core/i18n.js").I18n} i18n
 * @throws {Error} the library could not be loaded
 */
export async function drawHopFigure(place, { data, layout }, i18n) {
  const plotly = await readyPlotly();
  const traces = data.map((trace) => dressed(trace, i18n));
  const laid = styled(layout, { since: 0, until: 0 }, i18n);
  await plotly.react(place, traces, laid, CONFIG);
}

/** @param {Trace} trace @param {import("../core/i18n.js").I18n} i18n */
function dressed(trace, i18n) {
  const { hop, data } = trace.meta;
  const color = token(COLOURS[hop]);
  return {
    ...trace,
    name: `${i18n.t(`stream.${data}`)}, ${i18n.t(`hops.step.${hop}`)}`,
    line: { ...trace.line, color, width: 2, dash: DASHES[data] },
  };
}
