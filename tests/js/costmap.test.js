import { writeAlpha } from "../../iveg/static/js/map/layers/costmap.js";
import { equal, test } from "./harness.js";

test("a grid's first row is the picture's lowest, and dear cells are dark", () => {
  const pixels = new Uint8ClampedArray(4 * 4);
  const grid = { age_s: 0, resolution: 1, width: 2, height: 2, origin: { x: 0, y: 0 } };
  writeAlpha(pixels, { ...grid, data: [100, 0, -1, 50] });
  const alphas = [3, 7, 11, 15].map((i) => pixels[i]);
  equal(alphas, [0, 26, 51, 0]);
});
