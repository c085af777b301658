/**
 * Small plots over time in SVG, for pages that need no library: lines that break where
 * nothing was heard, over the time that matters.
 *
 * A drawing stretches with its place; its texts stand beside it in HTML and keep their
 * size, on a phone and on paper.
 *
 * @typedef {{since: number, until: number}} Span Unix milliseconds
 * @typedef {{at: number, value: number | null}} Sample `at` in Unix milliseconds
 * @typedef {{kind: string, name: string, samples: Sample[], isStep?: boolean,
 *   gapMs?: number}} Line
 * @typedef {{title: string, says: string, span: Span, lines: Line[],
 *   shade?: Shade | null}} Plot
 * @typedef {{since: number, until: number, name: string}} Shade a time that matters
 */

import { make, makeSvg } from "./dom.js";

const WIDTH = 1000;
const HEIGHT = 100;
/** A line over a longer silence would be invented. */
const SILENCE_MS = 5000;
/** Ends of a scale: numbers that are read at a glance. */
const STEPS = [0.5, 1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 30, 50, 100];

/**
 * @param {Plot} plot
 * @param {import("../core/i18n.js").I18n} i18n
 * @returns {HTMLElement | null} null where no line has a value
 */
export function makePlot({ title, says, span, lines, shade }, i18n) {
  const drawn = lines.filter(hasValue);
  const range = rangeOf(drawn);
  if (range === null) return null;
  const figure = make("figure", "plot");
  const caption = make("figcaption", "plot__title");
  caption.append(make("b", "", title), ...drawn.map(makeKey));
  if (shade) caption.append(makeKey({ kind: "shade", name: shade.name }));
  const area = makeSvg("svg", {
    class: "plot__area",
    viewBox: `0 0 ${WIDTH} ${HEIGHT}`,
    preserveAspectRatio: "none",
    role: "img",
    "aria-label": `${title}. ${says}`,
  });
  const zero = (HEIGHT * range.top) / (range.top - range.bottom);
  if (shade) area.append(drawShade(shade, span));
  area.append(makeSvg("path", { class: "plot__zero", d: `M0 ${zero}H${WIDTH}` }));
  for (const line of drawn) area.append(drawLine(line, span, range));
  const heights = make("div", "plot__y");
  const decimals = range.top - range.bottom < 2 ? 1 : 0;
  for (const value of [range.top, range.bottom])
    heights.append(make("span", "", i18n.number(value, decimals)));
  const times = make("div", "plot__x");
  for (const at of [span.since, span.until])
    times.append(make("span", "", i18n.time(new Date(at))));
  figure.append(caption, heights, area, times, make("small", "plot__says", says));
  return figure;
}

/** Of a line that is not there the key would speak, too. @param {Line} line */
const hasValue = ({ samples }) => samples.some(({ value }) => value !== null);

/**
 * From the least to the greatest value, zero included, ends rounded outwards.
 *
 * @param {Line[]} lines
 * @returns {{top: number, bottom: number} | null}
 */
export function rangeOf(lines) {
  const values = lines.flatMap(({ samples }) =>
    samples.flatMap(({ value }) => (value === null ? [] : [value])),
  );
  if (!values.length) return null;
  return {
    top: outwards(Math.max(0, ...values)) || STEPS[0],
    bottom: -outwards(Math.max(0, ...values.map((value) => -value))),
  };
}

/** @param {number} value not negative */
function outwards(value) {
  if (value === 0) return 0;
  return STEPS.find((step) => step >= value) ?? Math.ceil(value / 100) * 100;
}

/** How far from the left a moment stands. @param {number} at @param {Span} span */
export function placeOf(at, { since, until }) {
  return (WIDTH * (at - since)) / (until - since);
}

/**
 * The path of a line: a new stroke after each silence or unknown value.
 *
 * @param {Line} line
 * @param {(sample: {at: number, value: number}) => [number, number]} place
 */
export function pathOf({ samples, isStep = false, gapMs = SILENCE_MS }, place) {
  let path = "";
  let before = Number.NEGATIVE_INFINITY;
  for (const { at, value } of samples) {
    if (value === null) {
      before = Number.NEGATIVE_INFINITY;
      continue;
    }
    const [x, y] = place({ at, value }).map((one) => Number(one.toFixed(1)));
    // A lone sample is a stroke of no length, which its round ends make a dot.
    if (at - before > gapMs) path += `M${x} ${y}h0`;
    else path += isStep ? `H${x}V${y}` : `L${x} ${y}`;
    before = at;
  }
  return path;
}

/** @param {Line} line @param {Span} span @param {{top: number, bottom: number}} range */
function drawLine(line, span, { top, bottom }) {
  const high = HEIGHT / (top - bottom);
  const d = pathOf(line, ({ at, value }) => [placeOf(at, span), (top - value) * high]);
  return makeSvg("path", { class: "plot__line", "data-kind": line.kind, d });
}

/** @param {Shade} shade @param {Span} span */
function drawShade({ since, until }, span) {
  const x = Math.max(0, placeOf(since, span));
  const width = Math.min(WIDTH, placeOf(until, span)) - x;
  return makeSvg("rect", { class: "plot__shade", x, y: 0, width, height: HEIGHT });
}

/** @param {{kind: string, name: string}} line */
function makeKey({ kind, name }) {
  const key = make("span", "plot__key", name);
  key.dataset.kind = kind;
  return key;
}
