/**
 * Speed on a half circle: the needle is what was observed, the mark outside the scale
 * is the limit that iVeg asks for, on the same scale (docs/dashboard.md).
 *
 * Robots drive backwards, too; the needle shows the amount, the read-out beside it the
 * sign.  A small card has the same on a straight line.
 */

import { makeSvg, setAttribute, setText } from "./dom.js";

const WIDTH = 200;
const HEIGHT = 112;
const CENTRE = { x: WIDTH / 2, y: 94 };
const RADIUS = 76;
const HALF = 0.5;
const BAR = { from: 2, long: 116, y: 9 };
const DEFAULT_MAX = 1;

/**
 * @typedef {{
 *   speed: number | null, max: number, factor: number | null,
 *   name: string, said: string, limitSaid: string, speedSaid: string,
 * }} Reading `speed` (m/s, signed), `max` full scale (m/s), `factor` asked for 0–1; the
 *   others are texts
 */

/**
 * The values of a gauge, its factor that of the robot's situation; null for unknown ones.
 *
 * @param {import("../core/protocol.js").Robot | undefined} robot
 * @returns {{speed: number | null, max: number, factor: number | null}}
 */
export function readingOf(robot) {
  return {
    speed: robot?.twist?.linear ?? null,
    max: robot?.profile?.max_speed ?? DEFAULT_MAX,
    factor: robot?.situation.factor ?? null,
  };
}

export function createGauge() {
  const svg = makeSvg("svg", {
    class: "gauge",
    viewBox: `0 0 ${WIDTH} ${HEIGHT}`,
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
  const maxText = makeSvg("text", { class: "gauge__small gauge__end", x: 176, y: 108 });
  const zero = makeSvg("text", { class: "gauge__small gauge__end", x: 24, y: 108 });
  zero.textContent = "0";
  const track = makeSvg("path", { class: "gauge__track" });
  svg.append(
    track,
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
  const parts = { svg, track, value, beyond, needle, limit, text, limitText, maxText };
  const bar = createBar();
  return {
    svg,
    bar: bar.svg,
    /** @param {Reading} reading */
    draw(reading) {
      draw(parts, reading);
      bar.draw(reading);
    },
  };
}

/** The same on a straight line, with its text beside it. */
function createBar() {
  const svg = makeSvg("svg", { class: "gauge__bar", viewBox: "0 0 240 18" });
  const track = makeSvg("path", { class: "gauge__track" });
  const beyond = makeSvg("path", { class: "gauge__beyond" });
  const value = makeSvg("path", { class: "gauge__value" });
  const limit = makeSvg("path", { class: "gauge__limit", d: "M0 4l-4 -5h8z" });
  const text = makeSvg("text", { class: "gauge__line", x: 128, y: 14 });
  svg.append(track, beyond, value, limit, text);
  return {
    svg,
    /** @param {Reading} reading */
    draw(reading) {
      const { share, allowed } = sharesOf(reading);
      describe(svg, reading);
      setAttribute(track, "d", line(0, allowed));
      setAttribute(beyond, "d", line(allowed, 1));
      setAttribute(value, "d", line(0, share));
      setAttribute(limit, "transform", `translate(${along(allowed)} 1)`);
      setAttribute(limit, "visibility", shown(reading.factor));
      const said = [reading.speedSaid, reading.limitSaid].filter(Boolean);
      setText(text, said.join(" · "));
    },
  };
}

/** @param {number} share */
const along = (share) => (BAR.from + share * BAR.long).toFixed(1);

/** @param {number} from @param {number} to shares of the scale */
const line = (from, to) =>
  to - from < 0.001 ? "" : `M${along(from)} ${BAR.y}H${along(to)}`;

/** @param {number | null} value */
const shown = (value) => (value === null ? "hidden" : "visible");

/** @param {Reading} reading */
function sharesOf({ speed, max, factor }) {
  return { share: clamp(Math.abs(speed ?? 0) / max), allowed: clamp(factor ?? 1) };
}

/** For screen readers. @param {SVGElement} svg @param {Reading} reading */
function describe(svg, { name, max, speed, said }) {
  setAttribute(svg, "role", "meter");
  setAttribute(svg, "aria-valuemin", "0");
  setAttribute(svg, "aria-label", name);
  setAttribute(svg, "aria-valuemax", String(max));
  setAttribute(svg, "aria-valuenow", Math.abs(speed ?? 0).toFixed(2));
  setAttribute(svg, "aria-valuetext", said);
}

/**
 * @param {Record<string, SVGElement>} parts
 * @param {Reading} reading
 */
function draw(parts, reading) {
  const { share, allowed } = sharesOf(reading);
  setAttribute(parts.track, "d", arc(0, allowed));
  setAttribute(parts.value, "d", arc(0, share));
  setAttribute(parts.beyond, "d", allowed < 1 ? arc(allowed, 1) : "");
  turn(parts.needle, share);
  turn(parts.limit, allowed);
  setAttribute(parts.needle, "visibility", shown(reading.speed));
  setAttribute(parts.limit, "visibility", shown(reading.factor));
  setText(parts.text, reading.speedSaid);
  setText(parts.limitText, reading.limitSaid);
  setText(parts.maxText, String(reading.max));
  describe(parts.svg, reading);
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
