import { createTouch, wheelFactor } from "../../iveg/static/js/map/gestures.js";
import { equal, near, test } from "./harness.js";

/** A touch whose meanings are written down. */
function listened() {
  /** @type {(string | number)[][]} */
  const meant = [];
  /** @type {string[]} what the page asks for */
  const asking = [];
  const touch = createTouch({
    pan: (dx, dy) => void meant.push(["pan", dx, dy]),
    zoom: (px, py, factor) => void meant.push(["zoom", px, py, factor]),
    pinch: (...how) => void meant.push(["pinch", ...how]),
    tapMeans: () => {
      const asked = [...asking];
      return (px, py) => void meant.push(["tap", px, py, ...asked]);
    },
    doubleTap: (px, py) => void meant.push(["doubleTap", px, py]),
    hover: (px, py) => void meant.push(["hover", px, py]),
  });
  return { touch, meant, asking };
}

/** Waits until something is meant. @param {(string | number)[][]} meant */
async function something(meant) {
  const deadline = performance.now() + 2000;
  while (!meant.length && performance.now() < deadline) {
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
}

test("one finger drags", () => {
  const { touch, meant } = listened();
  touch.down(1, { x: 0, y: 0 });
  touch.move(1, { x: 10, y: 5 });
  touch.move(1, { x: 12, y: 5 });
  touch.up(1, { x: 12, y: 5 }, 0);
  equal(meant, [
    ["pan", 10, 5],
    ["pan", 2, 0],
  ]);
});

test("two fingers pinch about their middle", () => {
  const { touch, meant } = listened();
  touch.down(1, { x: 100, y: 100 });
  touch.down(2, { x: 200, y: 100 });
  touch.move(2, { x: 300, y: 100 });
  equal(meant, [["pinch", 50, 0, 200, 100, 2]]);
});

test("two taps at one place are a double tap and no tap", () => {
  const { touch, meant } = listened();
  for (const at of [0, 150]) {
    touch.down(1, { x: 50, y: 50 });
    touch.up(1, { x: 52, y: 50 }, at);
  }
  touch.end();
  equal(meant, [["doubleTap", 52, 50]]);
});

test("a glove that trembles still taps", async () => {
  const { touch, meant } = listened();
  touch.down(1, { x: 50, y: 50 });
  touch.move(1, { x: 54, y: 51 });
  touch.up(1, { x: 54, y: 51 }, 0);
  await something(meant);
  equal(meant, [["tap", 54, 51]]);
});

test("a tap does not answer what the page asks for only after it", async () => {
  const { touch, meant, asking } = listened();
  touch.down(1, { x: 50, y: 50 });
  touch.up(1, { x: 50, y: 50 }, 0);
  asking.push("a place for AGI");
  await something(meant);
  equal(meant, [["tap", 50, 50]]);
});

test("a wheel turned back undoes a wheel turned on, in any unit", () => {
  const wheel = { deltaMode: 0, ctrlKey: false };
  const there = wheelFactor({ ...wheel, deltaY: -100 });
  equal(there > 1, true);
  near(there * wheelFactor({ ...wheel, deltaY: 100 }), 1);
  near(wheelFactor({ ...wheel, deltaMode: 1, deltaY: -3 }), Math.exp(48 * 0.0016));
});
