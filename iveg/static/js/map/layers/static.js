/** The static layers, drawn once per viewport, theme, greenhouse and language. */

/**
 * @typedef {import("./paint.js").Paint} Paint
 * @typedef {[name: string, draw: (paint: Paint) => void]} StaticLayer
 */

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
      const { width, height, scale, x, y } = paint.view;
      const place = [width, height, scale, x, y, ratio];
      const wanted = [...place, paint.theme, paint.labels, paint.scene.map, ...shown];
      const isSame =
        wanted.length === drawnFor.length &&
        wanted.every((it, i) => it === drawnFor[i]);
      if (!isSame) redraw(paint, ratio, shown);
      drawnFor = wanted;
      return canvas;
    },
  };
}
