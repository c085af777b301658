/**
 * The layers that hardly ever change, drawn once per viewport, theme, language, greenhouse
 * and what is known of it.
 *
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {[name: string, draw: (paint: Paint) => void]} StaticLayer
 */

/** The hatching of what no camera sees grows denser with time alone. */
const DENSER_MS = 1000;

/** @param {StaticLayer[]} layers from the ground up */
export function createStaticImage(layers) {
  const canvas = new OffscreenCanvas(1, 1);
  const ctx = /** @type {OffscreenCanvasRenderingContext2D} */ (
    canvas.getContext("2d", { alpha: false })
  );
  /** @type {unknown[]} */
  let drawnFor = [];

  /** @param {Paint} paint @param {number} ratio @param {StaticLayer[]} shown */
  function redraw(paint, ratio, shown) {
    const { view, theme } = paint;
    canvas.width = Math.round(view.width * ratio);
    canvas.height = Math.round(view.height * ratio);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.fillStyle = theme.bg;
    ctx.fillRect(0, 0, view.width, view.height);
    for (const [, draw] of shown) draw({ ...paint, ctx });
  }

  return {
    /**
     * @param {Paint} paint
     * @param {number} ratio device pixels per CSS pixel
     * @param {(layer: string) => boolean} isOn
     * @returns {OffscreenCanvas}
     */
    image(paint, ratio, isOn) {
      const shown = layers.filter(([name]) => isOn(name));
      const { view, theme, labels, scene } = paint;
      const { width, height, scale, x, y } = view;
      const place = [width, height, scale, x, y, ratio];
      const age = scene.coverage && Math.floor(scene.nowMs / DENSER_MS);
      const known = [scene.map, scene.costmap, scene.coverage, age];
      const wanted = [...place, theme, labels, ...known, ...shown];
      const isSame =
        wanted.length === drawnFor.length &&
        wanted.every((it, i) => it === drawnFor[i]);
      if (!isSame) redraw(paint, ratio, shown);
      drawnFor = wanted;
      return canvas;
    },
  };
}
