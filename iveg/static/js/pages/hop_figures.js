/**
 * Figures of latency in this page's language and colours: transport blue, FIWARE orange,
 * as in the paper; the later hops in two greys.
 *
 * @typedef {{type: string, name: string, x: (number | string)[], y: (number | string)[],
 *   meta: {hop: string, data?: string}, error_y?: object, line?: object}} Trace
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
 * @param {import("./history/charts.js").Source} source
 * @param {import("../core/i18n.js").I18n} i18n
 * @throws {Error} the library could not be loaded
 */
export async function drawHopFigure(place, { data, layout }, source, i18n) {
  const plotly = await readyPlotly(source);
  const traces = data.map((trace) => dressed(trace, layout.meta, i18n));
  const laid = styled(layout, { since: 0, until: 0 }, i18n);
  if (layout.meta.y === "hop") {
    // First hop on top, and room for its label.
    laid.yaxis = { ...laid.yaxis, autorange: "reversed", title: { text: "" } };
    laid.margin = { ...laid.margin, l: 150 };
  }
  await plotly.react(place, traces, laid, CONFIG);
}

/** @param {Trace} trace @param {{x: string, y: string}} axes @param {import("../core/i18n.js").I18n} i18n */
function dressed(trace, axes, i18n) {
  const { hop, data } = trace.meta;
  const color = token(COLOURS[hop]);
  const named = i18n.t(`hops.step.${hop}`);
  const say = (
    /** @type {string} */ axis,
    /** @type {(number | string)[]} */ values,
  ) =>
    axis === "data" || axis === "hop"
      ? values.map((value) =>
          i18n.t(axis === "data" ? `stream.${value}` : `hops.step.${value}`),
        )
      : values;
  const error_y = trace.error_y && { ...trace.error_y, color: token("--text") };
  return {
    ...trace,
    name: data ? `${i18n.t(`stream.${data}`)}, ${named}` : named,
    x: say(axes.x, trace.x),
    y: say(axes.y, trace.y),
    marker: { color },
    line: { ...trace.line, color, width: 2, dash: DASHES[data ?? ""] },
    ...(error_y ? { error_y } : {}),
  };
}
