/**
 * The argument of every layer, and the strokes that several of them share.
 *
 * A layer is a module with `draw(paint)`: it reads the scene, paints in CSS pixels, keeps
 * nothing between frames and leaves the context's state as it found it (`isolated`).
 *
 * @typedef {import("../scene.js").Scene} Scene
 * @typedef {import("../viewport.js").Viewport} Viewport
 * @typedef {import("./theme.js").Theme} Theme
 * @typedef {import("./labels.js").Labels} Labels
 * @typedef {CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D} Context
 *   on the page, or in the worker
 * @typedef {{
 *   ctx: Context, view: Viewport, theme: Theme, scene: Scene, labels: Labels,
 *   followed: string | null, tape: import("./measure.js").Tape,
 *   places?: import("./places.js").Places, ratio?: number,
 *   sprites?: import("./sprites.js").Sprites,
 * }} Paint `places`: of the labels of this frame; `ratio`: device pixels per CSS pixel;
 *   `sprites`: kept between frames
 */

/** Widths of texts that are kept: ages are many. */
const WIDTHS_KEPT = 1000;
/** @type {Map<string, number>} by font and text */
const widths = new Map();

/**
 * Draws with the context's state restored afterwards.
 *
 * @param {Context} ctx
 * @param {() => void} draw
 */
export function isolated(ctx, draw) {
  ctx.save();
  draw();
  ctx.restore();
}

/**
 * Text that can be read on anything: a halo of the field's colour behind it.
 *
 * @param {Paint} paint
 * @param {string} text
 * @param {number} x centre (px)
 * @param {number} y middle (px)
 * @param {{size?: number, weight?: number, colour?: string}} [style]
 */
export function label({ ctx, theme }, text, x, y, style = {}) {
  const { size = 12, weight = 600, colour = theme.text } = style;
  ctx.font = `${weight} ${size}px ${theme.font}`;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  ctx.lineJoin = "round";
  ctx.lineWidth = 3.5;
  ctx.strokeStyle = theme.bg;
  ctx.strokeText(text, x, y);
  ctx.fillStyle = colour;
  ctx.fillText(text, x, y);
}

/**
 * The width of a text (px).
 *
 * @param {Context} ctx left with this font or as it was
 * @param {string} font
 * @param {string} text
 */
export function widthOf(ctx, font, text) {
  const key = `${font} ${text}`;
  const known = widths.get(key);
  if (known !== undefined) return known;
  ctx.font = font;
  const { width } = ctx.measureText(text);
  if (widths.size > WIDTHS_KEPT) widths.clear();
  widths.set(key, width);
  return width;
}

/**
 * A text in a filled capsule; returns its width.
 *
 * @param {Paint} paint
 * @param {string} text
 * @param {number} x left edge (px)
 * @param {number} y middle (px)
 * @param {string} fill
 * @param {string} colour
 * @returns {number} width (px)
 */
export function pill({ ctx, theme }, text, x, y, fill, colour) {
  const width = widthOfPill(ctx, theme, text);
  ctx.font = pillFont(theme);
  ctx.fillStyle = fill;
  ctx.beginPath();
  ctx.roundRect(x, y - 9, width, 18, 9);
  ctx.fill();
  ctx.textAlign = "left";
  ctx.textBaseline = "middle";
  ctx.fillStyle = colour;
  ctx.fillText(text, x + 6, y + 0.5);
  return width;
}

/** @param {Context} ctx @param {Theme} theme @param {string} text */
export const widthOfPill = (ctx, theme, text) =>
  widthOf(ctx, pillFont(theme), text) + 12;

/** @param {Theme} theme */
const pillFont = ({ font }) => `700 11px ${font}`;

/**
 * @param {Context} ctx
 * @param {number} x (px)
 * @param {number} y (px)
 * @param {number} radius (px)
 */
export function circle(ctx, x, y, radius) {
  ctx.beginPath();
  ctx.arc(x, y, Math.max(0, radius), 0, 2 * Math.PI);
}
