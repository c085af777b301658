/**
 * A chain of moments as a list on one scale of time: each bar reaches from the moment
 * before, that is known, to its own.  A long wait in which nothing happened is a marked
 * gap of the scale, as else nobody could tell the first moments apart.
 *
 * @typedef {{name: string, at: string | number | null, verdict: string, state: string,
 *   took: string, said: string}} Step `state` is what the verdict says, `said` what was
 *   found
 */

import { millisecondsOf } from "../pages/history/local_time.js";
import { make, makeSvg } from "./dom.js";

const LONG = 100;
/** What took no time is seen nevertheless. */
const LEAST = 0.6;
/** A wait is left out that is longer than this (ms), and so many times all the rest. */
const LEAST_WAIT_MS = 5000;
const WAIT_TIMES = 10;
/** A gap is as long as this part of the rest. */
const GAP = 0.15;
/** Slits in each gap. */
const SLITS = 3;

/** @typedef {{from: number, to: number}} Bar (%) */

/** @param {Step[]} steps @param {import("../core/i18n.js").I18n} i18n */
export function makeTimeline(steps, i18n) {
  const chain = make("ol", "chain");
  const bars = barsOf(steps);
  const gaps = gapsOf(steps);
  const items = steps.map((step, i) => makeStep(step, bars[i], gaps));
  for (const { at, waitMs } of gaps) {
    const ends = steps.findIndex((step) => step.at !== null && timeOf(step.at) === at);
    const seconds = waitMs / 1000;
    items[ends].append(make("p", "", i18n.t("record.gap", { seconds })));
  }
  chain.append(...items);
  return chain;
}

/**
 * How long each step took after the one before it that is known (ms); null for the first.
 *
 * @param {Pick<Step, "at">[]} steps
 * @returns {(number | null)[]}
 */
export function delaysOf(steps) {
  /** @type {number | null} */
  let before = null;
  return steps.map(({ at }) => {
    if (at === null) return null;
    const now = timeOf(at);
    const took = before === null ? null : now - before;
    before = now;
    return took;
  });
}

/**
 * Where each step's bar begins and ends (%) on the scale of all; null where unknown.
 *
 * @param {Pick<Step, "at">[]} steps
 * @returns {(Bar | null)[]}
 */
export function barsOf(steps) {
  const { place } = scaleOf(steps);
  const delays = delaysOf(steps);
  return steps.map(({ at }, i) => {
    if (at === null) return null;
    const ends = [timeOf(at) - (delays[i] ?? 0), timeOf(at)].map(place);
    return { from: Math.min(...ends), to: Math.max(...ends) };
  });
}

/**
 * Where the scale leaves a wait out, when it ended and how long it was.
 *
 * @param {Pick<Step, "at">[]} steps
 * @returns {(Bar & {at: number, waitMs: number})[]}
 */
export function gapsOf(steps) {
  const { waits, place } = scaleOf(steps);
  return waits.map(({ from, to }) => {
    return { from: place(from), to: place(to), at: to, waitMs: to - from };
  });
}

/** @param {Pick<Step, "at">[]} steps */
function scaleOf(steps) {
  const times = steps.flatMap(({ at }) => (at === null ? [] : [timeOf(at)]));
  times.sort((one, other) => one - other);
  const waits = waitsOf(times);
  const [first, last] = [times[0], times[times.length - 1]];
  const long = waits.reduce((sum, { from, to }) => sum + to - from, 0);
  const gap = GAP * (last - first - long);
  /** @param {number} time as far along as without the waits @returns {number} */
  const along = (time) =>
    waits.reduce(
      (ms, { from, to }) => (time < to ? ms : ms - (to - from) + gap),
      time - first,
    );
  const scale = LONG / (along(last) || 1);
  return { waits, place: (/** @type {number} */ time) => scale * along(time) };
}

/** The waits that would leave nothing of the rest. @param {number[]} times in order */
function waitsOf(times) {
  const between = times.slice(1).map((to, i) => ({ from: times[i], to }));
  const rest = between
    .map(({ from, to }) => to - from)
    .filter((ms) => ms <= LEAST_WAIT_MS)
    .reduce((sum, ms) => sum + ms, 0);
  const least = rest > 0 ? Math.max(LEAST_WAIT_MS, WAIT_TIMES * rest) : Infinity;
  return between.filter(({ from, to }) => to - from > least);
}

/** @param {string | number} at (ms) */
const timeOf = (at) => new Date(at).getTime();

/** @param {Step} step @param {Bar | null} bar @param {Bar[]} gaps */
function makeStep({ name, at, verdict, state, took, said }, bar, gaps) {
  const item = make("li");
  item.dataset.verdict = verdict;
  const when = at === null ? "" : millisecondsOf(at);
  item.append(
    make("span", "shape"),
    make("b", "", name),
    make("small", "", `${state} ${when} ${took}`.trim()),
    make("p", "", said),
  );
  if (bar) item.append(drawBar(bar, gaps));
  return item;
}

/** @param {Bar} bar @param {Bar[]} gaps */
function drawBar({ from, to }, gaps) {
  const svg = makeSvg("svg", {
    class: "chain__bar",
    viewBox: `0 0 ${LONG} 1`,
    preserveAspectRatio: "none",
    "aria-hidden": "true",
  });
  const width = Math.max(LEAST, to - from);
  const x = Math.min(from, LONG - width);
  svg.append(makeSvg("rect", { x, width, y: 0, height: 1 }), ...gaps.flatMap(slitsOf));
  return svg;
}

/** @param {Bar} gap */
function slitsOf({ from, to }) {
  const width = (to - from) / (2 * SLITS + 1);
  return Array.from({ length: SLITS }, (_, n) => {
    const x = from + (2 * n + 1) * width;
    return makeSvg("rect", { class: "chain__slit", x, width, y: 0, height: 1 });
  });
}
