/**
 * A chain of moments as a list on one scale of time: each bar reaches from the moment
 * before, that is known, to its own.
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

/** @param {Step[]} steps */
export function makeTimeline(steps) {
  const chain = make("ol", "chain");
  const bars = barsOf(steps);
  chain.append(...steps.map((step, i) => makeStep(step, bars[i])));
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
    const now = new Date(at).getTime();
    const took = before === null ? null : now - before;
    before = now;
    return took;
  });
}

/**
 * Where each step's bar begins and ends (%) on the scale of all; null where unknown.
 *
 * @param {Pick<Step, "at">[]} steps
 * @returns {({from: number, to: number} | null)[]}
 */
export function barsOf(steps) {
  const known = steps.flatMap(({ at }) =>
    at === null ? [] : [new Date(at).getTime()],
  );
  const first = Math.min(...known);
  const scale = LONG / (Math.max(...known) - first || 1);
  const delays = delaysOf(steps);
  return steps.map(({ at }, i) => {
    if (at === null) return null;
    const end = new Date(at).getTime() - first;
    const begin = end - (delays[i] ?? 0);
    return { from: scale * Math.min(begin, end), to: scale * Math.max(begin, end) };
  });
}

/** @param {Step} step @param {{from: number, to: number} | null} bar */
function makeStep({ name, at, verdict, state, took, said }, bar) {
  const item = make("li");
  item.dataset.verdict = verdict;
  const when = at === null ? "" : millisecondsOf(at);
  item.append(
    make("span", "shape"),
    make("b", "", name),
    make("small", "", `${state} ${when} ${took}`.trim()),
    make("p", "", said),
  );
  if (bar) item.append(drawBar(bar));
  return item;
}

/** @param {{from: number, to: number}} bar */
function drawBar({ from, to }) {
  const svg = makeSvg("svg", {
    class: "chain__bar",
    viewBox: `0 0 ${LONG} 1`,
    preserveAspectRatio: "none",
    "aria-hidden": "true",
  });
  const width = Math.max(LEAST, to - from);
  const x = Math.min(from, LONG - width);
  svg.append(makeSvg("rect", { x, width, y: 0, height: 1 }));
  return svg;
}
