import { createTouch } from "../../iveg/static/js/map/gestures.js";
import { equal, test } from "./harness.js";

/** A touch whose meanings are written down. */
function listened() {
  /** @type {(string | number)[][]} */
  const meant = [];
  const touch = createTouch({
    pan: (dx, dy) => void meant.push(["pan", dx, dy]),
    zoom: (px, py, factor) => void meant.push(["zoom", px, py, factor]),
    pinch: (...how) => void meant.push(["pinch", ...how]),
    tapMeans: () => (px, py) => void meant.push(["tap", px, py]),
    doubleTap: (px, py) => void meant.push(["doubleTap", px, py]),
    hover: (px, py) => void meant.push(["hover", px, py]),
  });
  return { touch, meant };
}

/** Waits until something is meant. @param {(string | number)[][]} meant */
async function something(meant) {
  const deadline = performance.now() + 2000;
  while (!meant.length && performance.now() < deadline) {
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
}

test("a glove that trembles still taps", async () => {
  const { touch, meant } = listened();
  touch.down(1, { x: 50, y: 50 });
  touch.move(1, { x: 54, y: 51 });
  touch.up(1, { x: 54, y: 51 }, 0);
  await something(meant);
  equal(meant, [["tap", 54, 51]]);
});
