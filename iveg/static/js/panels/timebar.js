/**
 * The bar under the map: the greenhouse's clock and what happened in the last minutes; a
 * press on it, or the arrow keys, jump to the log at that time.
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
const HEIGHTS = { detection: 5, link: 9, system: 9, speed: 14, command: 20, alert: 20 };

/** @param {import("../main.js").App} app */
export function createTimebar({ store, i18n, line }) {
  const strip = need("#time-strip");
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
    fill(
      strip,
      marksOf(nowS),
      () => makeSvg("rect"),
      (rect, { x, kind }) => drawMark(rect, x, kind),
    );
  }

  /**
   * Where marks stand: by steps of the clock, so that all of them move together.
   *
   * @param {number} nowS Unix time
   */
  function marksOf(nowS) {
    /** @type {Map<string, {x: number, kind: string}>} one a kind and place */
    const marks = new Map();
    const now = Math.round(nowS / MARK_S);
    for (const { at, kind } of store.log()) {
      const ago = now - Math.round(Date.parse(at) / 1000 / MARK_S);
      const x = WIDTH - MARK_WIDTH * (1 + Math.max(0, ago));
      if (ago < AHEAD || x < 0) continue;
      marks.set(`${kind}:${x}`, { x, kind });
    }
    return [...marks.values()];
  }

  i18n.onChange(draw);
  setInterval(onBeat, TICK_MS, draw);
  draw();
}

/** @param {Element} mark @param {number} x @param {string} kind */
function drawMark(mark, x, kind) {
  const height = HEIGHTS[/** @type {keyof typeof HEIGHTS} */ (kind)] ?? 9;
  setAttribute(mark, "data-kind", kind);
  setAttribute(mark, "x", String(x));
  setAttribute(mark, "y", String(20 - height));
  setAttribute(mark, "width", String(MARK_WIDTH));
  setAttribute(mark, "height", String(height));
}
