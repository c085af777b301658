/**
 * The bar under the map: the greenhouse's clock and what happened in the last minutes,
 * with times; orders are octagons and alerts triangles.  A press on it, or the arrow
 * keys, jump to the log at that time.
 */

import { onBeat } from "../core/beat.js";
import { fill, makeSvg, need, setAttribute, setText } from "./dom.js";

const TICK_MS = 1000;
const MINUTES = 10;
const WIDTH = 600;
/** How far a key goes back (minutes). */
const STEPS = {
  ArrowLeft: 0.5,
  ArrowDown: 0.5,
  ArrowRight: -0.5,
  ArrowUp: -0.5,
  Home: MINUTES,
  End: -MINUTES,
};
const MARK_WIDTH = 2;
const MARK_S = (MINUTES * 60 * MARK_WIDTH) / WIDTH;
/** What is newer than the page's clock says stands at the end (marks). */
const AHEAD = -3;
/** Detections come by the dozen: their marks are low, those of changes are high. */
const HEIGHTS = { detection: 5, link: 9, system: 9, speed: 14 };
const FLOOR = 22;
const SHAPES = {
  command: "M3 0h6l3 3v6l-3 3h-6l-3 -3v-6z",
  alert: "M6 0l6 12h-12z",
};
const SHAPE_WIDTH = 12;
const TICK_MIN = 2;
/** Labels nearer to an end than this would be cut (share of the strip). */
const EDGE = 0.04;

/** @param {import("../main.js").App} app */
export function createTimebar({ store, i18n, line }) {
  const strip = need("#time-strip");
  const [ticks, marks] = [makeSvg("g"), makeSvg("g")];
  strip.append(ticks, marks);
  let minutesAgo = 0;

  /** @param {number} minutes ago */
  function jump(minutes) {
    minutesAgo = Math.min(MINUTES, Math.max(0, minutes));
    const atS = line.serverNow() - 60 * minutesAgo;
    setAttribute(strip, "aria-valuenow", String(-minutesAgo));
    setAttribute(strip, "aria-valuetext", i18n.time(atS));
    document.dispatchEvent(new CustomEvent("iveg:log-at", { detail: 1000 * atS }));
  }

  strip.addEventListener("click", (event) => {
    const { left, width } = strip.getBoundingClientRect();
    jump(MINUTES * (1 - (event.clientX - left) / width));
  });
  strip.addEventListener("keydown", (event) => {
    const steps = STEPS[/** @type {keyof typeof STEPS} */ (event.key)];
    if (steps === undefined) return;
    event.preventDefault();
    jump(minutesAgo + steps);
  });

  function draw() {
    const nowS = line.serverNow();
    setText(need("#clock"), i18n.time(nowS));
    setAttribute(strip, "aria-label", i18n.t("time.strip", { minutes: MINUTES }));
    fill(marks, marksOf(nowS), makeMark, drawMark);
    fill(ticks, ticksOf(nowS), makeTick, (tick, { share, at }) => {
      setAttribute(tick, "x", percent(share));
      setText(tick.children[1], i18n.time(at).slice(0, 5));
    });
  }

  /**
   * Where marks stand: by steps of the clock, so that all of them move together.
   *
   * @param {number} nowS Unix time
   */
  function marksOf(nowS) {
    /** @type {Map<string, Mark>} one a kind and place */
    const found = new Map();
    const now = Math.round(nowS / MARK_S);
    for (const { at, kind } of store.log()) {
      const ago = now - Math.round(Date.parse(at) / 1000 / MARK_S);
      const x = WIDTH - MARK_WIDTH * (1 + Math.max(0, ago));
      if (ago < AHEAD || x < 0) continue;
      // One shape where several would lie on each other.
      const place = kind in SHAPES ? Math.floor(x / SHAPE_WIDTH) : x;
      found.set(`${kind}:${place}`, { share: x / WIDTH, kind });
    }
    return [...found.values()];
  }

  i18n.onChange(draw);
  setInterval(onBeat, TICK_MS, draw);
  draw();
}

/** @typedef {{share: number, kind: string}} Mark `share` of the strip, from the left */

/** A place that a path alone lacks. */
function makeMark() {
  const mark = makeSvg("svg", { overflow: "visible" });
  mark.append(makeSvg("path"));
  return mark;
}

/** @param {Element} mark @param {Mark} told */
function drawMark(mark, { share, kind }) {
  const shape = SHAPES[/** @type {keyof typeof SHAPES} */ (kind)];
  const height = HEIGHTS[/** @type {keyof typeof HEIGHTS} */ (kind)] ?? 9;
  setAttribute(mark, "data-kind", kind);
  setAttribute(mark, "x", percent(share));
  const bar = `M0 ${FLOOR - height}h${MARK_WIDTH}V${FLOOR}h-${MARK_WIDTH}z`;
  setAttribute(mark.children[0], "d", shape ?? bar);
}

function makeTick() {
  const tick = makeSvg("svg", { overflow: "visible", "aria-hidden": "true" });
  const label = makeSvg("text", { y: FLOOR + 10 });
  tick.append(makeSvg("path", { d: `M0 0V${FLOOR}` }), label);
  return tick;
}

/**
 * Full minutes on the strip, and how far from the left each stands.
 *
 * @param {number} nowS Unix time
 */
export function ticksOf(nowS) {
  const [stepS, longS] = [60 * TICK_MIN, 60 * MINUTES];
  const ticks = [];
  for (let at = stepS * Math.ceil((nowS - longS) / stepS); at <= nowS; at += stepS) {
    const share = 1 - (nowS - at) / longS;
    if (share >= EDGE && share <= 1 - EDGE) ticks.push({ share, at });
  }
  return ticks;
}

/** @param {number} share */
const percent = (share) => `${(100 * share).toFixed(2)}%`;
