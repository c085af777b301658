/**
 * The server's figures, in this page's colours and language.
 *
 * Plotly is large and is asked for with the first figure.  It and each figure wait until
 * the page rests, each in a task of its own.  It styles a plot by sheets that a strict policy refuses, so an element of
 * each sheet's name keeps it from trying, and the style sheet of pages with figures has
 * the rules for a plot.  A figure's `meta` describes its traces and axes.
 *
 * @typedef {{type: string, mode?: string, name: string, x: (number | null)[],
 *   y: (number | null)[], meta: Record<string, any>, yaxis?: string, line?: object,
 *   marker?: object}} Trace
 * @typedef {{data: Trace[], layout: Record<string, any>}} Figure
 * @typedef {Record<string, Figure>} Charts by name; `speed/{robot}` for each robot
 * @typedef {{since: number, until: number}} Span Unix milliseconds
 */

import { whenResting } from "../../core/rest.js";
import { all, make, need, setHidden, setText } from "../../panels/dom.js";
import { wallText } from "./local_time.js";
import { fitPaper } from "./paper.js";
import { keepInStep, placesIn } from "./strips.js";

const CONFIG = { displayModeBar: false, responsive: true, displaylogo: false };
/** Numbers only: month names would be in the library's language. */
const TICKS = [
  { dtickrange: [null, 60_000], value: "%H:%M:%S" },
  { dtickrange: [60_000, 86_400_000], value: "%H:%M\n%d/%m" },
  { dtickrange: [86_400_000, null], value: "%d/%m/%y" },
];
const AIR = new Set(["temperature", "humidity", "co2", "measurement"]);

const LIBRARY = "/static/vendor/plotly-basic.min.js";
/** Of the sheets that the library would make itself (tests/unit/web/pages/test_charts.py). */
const STYLE_IDS = [
  "plotly.js-style-global",
  "9f215cf04c5486422605d13261cb87401f4e7763b6296af81e98efbc0130da53",
];

/** @type {Promise<any> | null} */
let library = null;

/**
 * Draws all figures, each over the whole range: an hour of silence is an hour wide.
 *
 * @param {Charts} charts
 * @param {import("./asked.js").Asked} asked
 * @param {import("../../core/i18n.js").I18n} i18n
 * @throws {Error} the library could not be loaded
 */
export async function drawCharts(charts, asked, i18n) {
  const strips = stripsOf(charts);
  const data = strips.flatMap((figure) => figure.data);
  setText(need("#chart-speed-note"), noteOf(data, i18n));
  setHidden(need("#chart-speed"), data.length === 0);
  setHidden(need("#chart-speed-empty"), data.length > 0);
  if (strips.length) await drawStrips(strips, asked, i18n);
}

/** Figures of speed from the top down; the last one has the axis of time.
 * @param {Charts} charts @returns {Figure[]} */
function stripsOf(charts) {
  const names = Object.keys(charts).filter((name) => name.startsWith("speed/"));
  return names.map((name, index) => {
    const { data, layout } = charts[name];
    const meta = { ...layout.meta, isAbove: index < names.length - 1 };
    return { data, layout: { ...layout, meta } };
  });
}

/**
 * @param {Figure[]} strips @param {Span} span
 * @param {import("../../core/i18n.js").I18n} i18n
 */
async function drawStrips(strips, span, i18n) {
  const places = placesIn(need("#chart-speed"), strips.length);
  for (const [index, strip] of strips.entries())
    await drawFigure(places[index], strip, span, i18n);
  keepInStep(await readyPlotly(), places);
}

/**
 * Draws one figure over the whole span.
 *
 * @param {HTMLElement} place
 * @param {Figure} figure
 * @param {Span} span
 * @param {import("../../core/i18n.js").I18n} i18n
 * @throws {Error} the library could not be loaded
 */
export async function drawFigure(place, { data, layout }, span, i18n) {
  const plotly = await readyPlotly();
  const traces = data.map((trace, index) => dressed(trace, index, i18n));
  await plotly.react(place, traces, styled(layout, span, i18n), CONFIG);
}

/**
 * The library, once the page rests.
 *
 * @throws {Error} it could not be loaded
 */
export async function readyPlotly() {
  library ??= summon();
  try {
    const plotly = await library;
    await whenResting();
    return plotly;
  } catch (error) {
    library = null;
    throw error;
  }
}

async function summon() {
  for (const id of STYLE_IDS) {
    const keeper = make("i", "no-inline-styles");
    keeper.id = id;
    keeper.hidden = true;
    document.body.append(keeper);
  }
  fitPaper();
  await whenResting();
  await import(LIBRARY);
  const plotly = /** @type {any} */ (globalThis).Plotly;
  await whenResting();
  await warmUp(plotly);
  return plotly;
}

/**
 * The library's first drawing takes twice as long as the next: so it is of nothing.
 *
 * @param {any} plotly
 */
async function warmUp(plotly) {
  const place = make("div", "visually-hidden");
  document.body.append(place);
  await plotly.react(place, [], {}, CONFIG);
  plotly.purge(place);
  place.remove();
}

/**
 * A trace with its name, its colour and the greenhouse's clock.
 *
 * @param {Trace} trace @param {number} index
 * @param {import("../../core/i18n.js").I18n} i18n
 */
function dressed(trace, index, i18n) {
  const { kind, robot } = trace.meta;
  const colour = colourOf(trace.meta, index);
  const name = i18n.t(`history.trace.${kind}`, { robot });
  const isPlain = trace.meta.is_plain === true;
  const x = isPlain
    ? trace.x
    : trace.x.map((at) => (at === null ? null : wallText(at)));
  const line = { ...trace.line, color: colour, width: 2 };
  if (kind === "mandated") Object.assign(line, { width: 1.5, dash: "6px,3px" });
  const marker = { size: 9, ...trace.marker, color: colour };
  // The newest point lies on the edge, and would be cut in half there.
  return { ...trace, x, name, line, marker, cliponaxis: false };
}

/**
 * Robots keep the colour that they have on the map; alert colours stay with alerts.
 *
 * @param {Trace["meta"]} meta @param {number} index
 */
function colourOf({ kind, robot }, index) {
  const slots = all("[data-robot][data-slot]");
  const slot = slots.find((chip) => chip.dataset.robot === robot)?.dataset.slot;
  if (slot) return token(`--robot-${slot}`);
  // One that is no longer in the fleet has one colour for all of its lines.
  if (robot) return token("--text-2");
  if (AIR.has(kind)) return token("--text-2");
  return token(`--robot-${index + 3}`);
}

/**
 * @param {Record<string, any>} layout
 * @param {Span} asked
 * @param {import("../../core/i18n.js").I18n} i18n
 */
export function styled(layout, asked, i18n) {
  const { isAbove = false } = layout.meta;
  const said = (/** @type {string} */ name) =>
    i18n.t(`history.axis.${layout.meta[name]}`);
  const axis = (/** @type {string} */ name) => ({
    ...layout[`${name}axis`],
    title: { text: isAbove && name === "x" ? "" : said(name), standoff: 8 },
    gridcolor: token("--line"),
    // Where all lines are black for sunlight, solid limits would hide the measured line.
    griddash: "1px,4px",
    zerolinecolor: token("--line-strong"),
    linecolor: token("--line-strong"),
    // Margins that follow their labels may chase each other (Plotly gives up with a
    // warning); these hold the widest label of either language.
    automargin: false,
    fixedrange: name === "y",
    showticklabels: name === "y" || !isAbove,
    ...(layout.meta[name] === "time"
      ? {
          range: [wallText(asked.since), wallText(asked.until)],
          tickformatstops: TICKS,
          hoverformat: "%d/%m %H:%M:%S",
        }
      : {}),
  });
  const { showlegend = true, shapes = [] } = layout;
  return {
    ...layout,
    xaxis: axis("x"),
    yaxis: { ...axis("y"), ...layout.yaxis },
    shapes: shapes.length ? [shaded(shapes)] : [],
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: token("--font"), size: 12, color: token("--text-2") },
    hoverlabel: { bgcolor: token("--raised"), font: { color: token("--text") } },
    separators: i18n.language() === "es" ? ",." : ".,",
    margin: { l: 60, r: 16, t: showlegend ? 36 : 12, b: isAbove ? 6 : 60 },
    legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0 },
    showlegend,
    hovermode: "closest",
    autosize: true,
  };
}

/**
 * The times in which a robot was to be slow as one shape: hundreds of them would block
 * the page.
 *
 * @param {Record<string, any>[]} times
 */
function shaded(times) {
  const path = times
    .map(({ x0, x1 }) => `M${at(x0)},0H${at(x1)}V1H${at(x0)}Z`)
    .join("");
  const look = { fillcolor: token("--gauge"), line: { width: 0 } };
  return { type: "path", layer: "below", yref: "y domain", path, ...look };
}

/** A time as paths of shapes have it. @param {number} ms */
const at = (ms) => wallText(ms).replace("T", "_");

/**
 * The figure of speeds in one sentence, which is its text alternative, too.
 *
 * @param {Trace[]} data
 * @param {import("../../core/i18n.js").I18n} i18n
 */
function noteOf(data, i18n) {
  if (data.length === 0) return "";
  const seconds = Math.max(...data.map((trace) => trace.meta.slice_s));
  const drawn = seconds > 0 ? "history.note.sliced" : "history.note.exact";
  return i18n.t(drawn, { seconds });
}

/** @param {string} name */
export const token = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(name).trim();
