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
 *   on the page, or of an image that is kept
 * @typedef {{
 *   ctx: Context, view: Viewport, theme: Theme, scene: Scene, labels: Labels,
 *   followed: string | null, tape: import("./measure.js").Tape,
 *   places?: import("./places.js").Places, ratio?: number,
 *   sprites?: import("./sprites.js").Sprites,
 * }} Paint `places`: of the labels of this frame; `ratio`: device pixels per CSS pixel;
 *   `sprites`: kept between frames
 */

/** The letters in a capsule. */
const PILL = { size: 11, weight: 700 };
/** Widths of texts that are kept: ages are many. */
const WIDTHS_KEPT = 1000;
/** @type {Map<string, number>} by font and text */
const widths = new Map();

/**
 * As many pixels as the view has on this screen; setting a size clears the canvas.
 *
 * @param {HTMLCanvasElement | OffscreenCanvas} canvas
 * @param {Viewport} view
 * @param {number} ratio device pixels per CSS pixel
 */
export function matchPixels(canvas, view, ratio) {
  const width = Math.round(view.width * ratio);
  const height = Math.round(view.height * ratio);
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
}

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
  const { colour = theme.text } = style;
  ctx.font = fontOf(theme, style);
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
 * @param {Theme} theme
 * @param {{size?: number, weight?: number}} style
 */
const fontOf = ({ font }, { size = 12, weight = 600 }) => `${weight} ${size}px ${font}`;

/**
 * The width of a label (px).
 *
 * @param {Pick<Paint, "ctx" | "theme">} paint
 * @param {string} text
 * @param {{size?: number, weight?: number}} [style] as for `label`
 */
export function widthOf({ ctx, theme }, text, style = {}) {
  const font = fontOf(theme, style);
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
export function pill(paint, text, x, y, fill, colour) {
  const { ctx, theme } = paint;
  const width = widthOfPill(paint, text);
  ctx.font = fontOf(theme, PILL);
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

/** @param {Pick<Paint, "ctx" | "theme">} paint @param {string} text */
export const widthOfPill = (paint, text) => widthOf(paint, text, PILL) + 12;

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
