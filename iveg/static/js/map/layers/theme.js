/**
 * The page's colours for a canvas: CSS custom properties, read once for each theme.
 *
 * @typedef {{
 *   bg: string, lane: string, crop: string, post: string, text: string, grid: string,
 *   person: string, peer: string, ring: string, muted: string,
 *   alert: [string, string, string], onAlert2: string, robots: string[], font: string,
 * }} Theme `robots[slot - 1]` is a robot's hue
 */

/**
 * Used on paper, and where a page defines no token, so that a map is never painted
 * invisible.
 */
export const PAPER = {
  "--map-bg": "#eceff1",
  "--map-lane": "#f8f9fa",
  "--map-crop": "#b7c4b1",
  "--map-post": "#78828a",
  "--map-text": "#22292f",
  "--map-grid": "#dde2e6",
  "--person": "#5b2a86",
  "--peer": "#3b5b7a",
  "--ring": "#5b2a86",
  "--muted": "#77818a",
  "--alert-1": "#c62828",
  "--alert-2": "#b26a00",
  "--alert-3": "#51708a",
  "--on-alert-2": "#ffffff",
  "--robot-1": "#0b6fa4",
  "--robot-2": "#8a3f9e",
  "--robot-3": "#00796b",
  "--robot-4": "#5c6bc0",
  "--robot-5": "#00838f",
  "--robot-6": "#7b5ea7",
  "--robot-7": "#33691e",
  "--robot-8": "#37474f",
};

/**
 * Reads the theme in force where the canvas stands.
 *
 * The browser resolves each token by way of the canvas's own `color`, so tokens may be
 * written in any CSS colour syntax, `light-dark()` and `var()` included.
 *
 * @param {HTMLElement} element
 * @param {Record<string, string>} [overrides] token name → colour
 * @returns {Theme}
 */
export function readTheme(element, overrides = {}) {
  const before = element.style.color;
  const computed = getComputedStyle(element);
  /** @param {keyof typeof PAPER} token */
  const colour = (token) => {
    element.style.color = `var(${token}, ${PAPER[token]})`;
    return overrides[token] ?? computed.color;
  };
  const theme = build(colour, computed.fontFamily || "sans-serif");
  element.style.color = before;
  return theme;
}

/**
 * @param {(token: keyof typeof PAPER) => string} colour
 * @param {string} font
 * @returns {Theme}
 */
function build(colour, font) {
  const robots = Array.from({ length: 8 }, (_, i) =>
    colour(/** @type {keyof typeof PAPER} */ (`--robot-${i + 1}`)),
  );
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
