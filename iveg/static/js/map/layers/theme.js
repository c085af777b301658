/**
 * The page's colours for a canvas: CSS custom properties, read once for each theme.
 *
 * @typedef {{
 *   bg: string, lane: string, crop: string, post: string, text: string, grid: string,
 *   person: string, peer: string, ring: string, muted: string,
 *   alert: [string, string, string], onAlert2: string, robots: string[], font: string,
 * }} Theme `robots[slot - 1]` is a robot's hue
 */

import { HUES } from "../../core/slots.js";

/** Where the page has no token the system's own colours show it, never nothing. */
const GROUNDS = new Set(["--map-bg", "--map-lane", "--map-grid", "--on-alert-2"]);

/**
 * Reads the theme in force where the canvas stands.
 *
 * The browser resolves each token by way of the canvas's own `color`, so tokens may be
 * written in any CSS colour syntax, `light-dark()` and `var()` included.
 *
 * @param {HTMLElement} element
 * @returns {Theme}
 */
export function readTheme(element) {
  const before = element.style.color;
  const computed = getComputedStyle(element);
  /** @param {string} token */
  const colour = (token) => {
    const plain = GROUNDS.has(token) ? "Canvas" : "CanvasText";
    element.style.color = `var(${token}, ${plain})`;
    return computed.color;
  };
  const theme = build(colour, computed.fontFamily || "sans-serif");
  element.style.color = before;
  return theme;
}

/**
 * @param {(token: string) => string} colour
 * @param {string} font
 * @returns {Theme}
 */
function build(colour, font) {
  const robots = Array.from({ length: HUES }, (_, i) => colour(`--robot-${i + 1}`));
  return {
    bg: colour("--map-bg"),
    lane: colour("--map-lane"),
    crop: colour("--map-crop"),
    post: colour("--map-post"),
    text: colour("--map-text"),
    grid: colour("--map-grid"),
    person: colour("--person"),
    peer: colour("--peer"),
    ring: colour("--ring"),
    muted: colour("--muted"),
    alert: [colour("--alert-1"), colour("--alert-2"), colour("--alert-3")],
    onAlert2: colour("--on-alert-2"),
    robots,
    font,
  };
}
