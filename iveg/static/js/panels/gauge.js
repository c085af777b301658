/**
 * Speed on a half circle: the needle is what was observed, the mark outside the scale
 * is the mandated limit, on the same scale (product section 1, widget 3).
 *
 * Fleets drive backwards, too; the needle shows how fast, the read-out beside it which
 * way.
 */

import { makeSvg, setAttribute, setText } from "./dom.js";

const WIDTH = 200;
const HEIGHT = 112;
const CENTRE = { x: WIDTH / 2, y: 94 };
const RADIUS = 76;
const HALF = 0.5;

/**
 * @typedef {{
 *   speed: number | null, max: number, factor: number | null,
 *   name: string, said: string, limitSaid: string, speedSaid: string,
 * }} Reading `speed` (m/s, signed), `max` full scale (m/s), `factor` mandated 0–1; the
 *   rest is written already
 */

export function createGauge() {
  const svg = makeSvg("svg", {
    class: "gauge",
    viewBox: `0 0 ${WIDTH} ${HEIGHT}`,
    role: "meter",
    "aria-valuemin": 0,
  });
  const value = makeSvg("path", { class: "gauge__value" });
  const beyond = makeSvg("path", { class: "gauge__beyond" });
  const needle = makeSvg("path", {
    class: "gauge__needle",
    d: `M${CENTRE.x} ${CENTRE.y - RADIUS - 3}l5 27h-10z`,
  });
  const limit = makeSvg("path", {
    class: "gauge__limit",
    d: `M${CENTRE.x} ${CENTRE.y - RADIUS - 5}l-5.5 -9h11z`,
  });
  const text = makeSvg("text", { class: "gauge__text", x: 100, y: 86 });
  const limitText = makeSvg("text", { class: "gauge__small", x: 100, y: 106 });
  const maxText = makeSvg("text", { class: "gauge__small", x: 176, y: 108 });
  const zero = makeSvg("text", { class: "gauge__small", x: 24, y: 108 });
  zero.textContent = "0";
  svg.append(
    makeSvg("path", { class: "gauge__track", d: arc(0, 1) }),
    beyond,
    value,
    makeSvg("path", { class: "gauge__half", d: tick(HALF) }),
    limit,
    needle,
    text,
    zero,
    maxText,
    limitText,
  );
  const parts = { svg, value, beyond, needle, limit, text, limitText, maxText };
  return { svg, draw: (/** @type {Reading} */ reading) => draw(parts, reading) };
}

/**
 * @param {Record<string, SVGElement>} parts
 * @param {Reading} reading
 */
function draw(parts, reading) {
  const { speed, max, factor } = reading;
  const share = clamp(Math.abs(speed ?? 0) / max);
  const allowed = clamp(factor ?? 1);
  setAttribute(parts.value, "d", arc(0, share));
  setAttribute(parts.beyond, "d", allowed < 1 ? arc(allowed, 1) : "");
  turn(parts.needle, share);
  turn(parts.limit, allowed);
  setAttribute(parts.needle, "visibility", speed === null ? "hidden" : "visible");
  setText(parts.text, reading.speedSaid);
  setText(parts.limitText, reading.limitSaid);
  setText(parts.maxText, String(max));
  setAttribute(parts.svg, "aria-label", reading.name);
  setAttribute(parts.svg, "aria-valuemax", String(max));
  setAttribute(parts.svg, "aria-valuenow", Math.abs(speed ?? 0).toFixed(2));
  setAttribute(parts.svg, "aria-valuetext", reading.said);
}

/** @param {SVGElement} mark drawn pointing up @param {number} share 0–1 of the scale */
function turn(mark, share) {
  const degrees = (share * 180 - 90).toFixed(1);
  setAttribute(mark, "transform", `rotate(${degrees} ${CENTRE.x} ${CENTRE.y})`);
}

/** @param {number} share @param {number} radius */
function at(share, radius) {
  const angle = Math.PI * (1 - share);
  const x = CENTRE.x + radius * Math.cos(angle);
  const y = CENTRE.y - radius * Math.sin(angle);
  return `${x.toFixed(2)} ${y.toFixed(2)}`;
}

/** @param {number} from @param {number} to shares of the scale */
function arc(from, to) {
  if (to - from < 0.001) return "";
  return `M${at(from, RADIUS)}A${RADIUS} ${RADIUS} 0 0 1 ${at(to, RADIUS)}`;
}

/** @param {number} share */
function tick(share) {
  return `M${at(share, RADIUS - 5)}L${at(share, RADIUS + 5)}`;
}

/** @param {number} share */
const clamp = (share) => Math.min(1, Math.max(0, share));
